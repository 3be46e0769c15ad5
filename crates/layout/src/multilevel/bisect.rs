//! Two halves of a graph with few edges between them.

use super::Weighted;
use super::coarsen::coarsen;
use super::refine::refine;
use std::collections::VecDeque;

/// Below this many nodes a graph is cut at once.
const SMALL: usize = 48;

/// For each node whether it is in the second half. Both halves have a node if the graph has two.
pub(super) fn bisect(graph: &Weighted) -> Vec<bool> {
    let mut is_second = match graph.len() {
        0..=SMALL => grow(graph),
        count => {
            let (coarse, of) = coarsen(graph);
            // Without edges nothing can be joined.
            if coarse.len() > count - count / 8 { grow(graph) } else { projected(&bisect(&coarse), &of) }
        }
    };
    refine(graph, &mut is_second);
    is_second
}

fn projected(is_second: &[bool], of: &[u32]) -> Vec<bool> {
    of.iter().map(|&node| is_second[node as usize]).collect()
}

/// The half of the graph that is nearest to a node at its rim.
fn grow(graph: &Weighted) -> Vec<bool> {
    let rim = *breadth_first(graph, 0).last().unwrap_or(&0);
    let mut is_second = vec![true; graph.len()];
    let (mut weight, half) = (0, graph.weight().div_ceil(2));
    for node in breadth_first(graph, rim).into_iter().take(graph.len().saturating_sub(1)) {
        if weight >= half {
            break;
        }
        is_second[node as usize] = false;
        weight += u64::from(graph.weights[node as usize]);
    }
    is_second
}

/// All nodes by their distance from `start`; those that it does not reach follow, from the first of them on.
fn breadth_first(graph: &Weighted, start: u32) -> Vec<u32> {
    let mut is_seen = vec![false; graph.len()];
    let mut order = Vec::with_capacity(graph.len());
    let mut next = VecDeque::new();
    for start in std::iter::once(start).chain(0..graph.len() as u32) {
        if graph.len() == 0 || std::mem::replace(&mut is_seen[start as usize], true) {
            continue;
        }
        next.push_back(start);
        while let Some(node) = next.pop_front() {
            order.push(node);
            for &(to, _) in graph.edges(node) {
                if !std::mem::replace(&mut is_seen[to as usize], true) {
                    next.push_back(to);
                }
            }
        }
    }
    order
}
