//! A graph of about half as many nodes: pairs that are joined by heavy edges become one.

use super::Weighted;

const NONE: u32 = u32::MAX;

/// The smaller graph, and for each node the one that stands for it there.
pub(super) fn coarsen(graph: &Weighted) -> (Weighted, Vec<u32>) {
    let (of, pairs) = pairs(graph);
    let mut coarse =
        Weighted { starts: vec![0], edges: Vec::new(), weights: Vec::with_capacity(pairs.len()) };
    // Where the edge to a node is in the list that is being made.
    let mut place = vec![usize::MAX; pairs.len()];
    for (number, pair) in (0..).zip(&pairs) {
        let begin = coarse.edges.len();
        for &node in pair.iter().filter(|&&node| node != NONE) {
            for &(to, weight) in graph.edges(node) {
                let to = of[to as usize];
                match place[to as usize] {
                    _ if to == number => {}
                    usize::MAX => {
                        place[to as usize] = coarse.edges.len();
                        coarse.edges.push((to, weight));
                    }
                    place => coarse.edges[place].1 += weight,
                }
            }
        }
        coarse.edges[begin..].iter().for_each(|&(to, _)| place[to as usize] = usize::MAX);
        coarse.starts.push(coarse.edges.len() as u32);
        let weights = pair.iter().filter(|&&node| node != NONE).map(|&node| graph.weights[node as usize]);
        coarse.weights.push(weights.sum());
    }
    (coarse, of)
}

/// Pairs each node with the neighbor, free yet, that the heaviest edge leads to; those of few edges choose first, so that
/// few are left alone.
fn pairs(graph: &Weighted) -> (Vec<u32>, Vec<[u32; 2]>) {
    let mut of = vec![NONE; graph.len()];
    let mut pairs = Vec::new();
    let mut nodes: Vec<u32> = (0..graph.len() as u32).collect();
    nodes.sort_by_key(|&node| graph.edges(node).len());
    for node in nodes {
        if of[node as usize] != NONE {
            continue;
        }
        let free = graph.edges(node).iter().filter(|edge| of[edge.0 as usize] == NONE);
        // Among equals the lightest, so that nodes stay about as heavy.
        let rank = |&(to, weight): &(u32, u32)| (weight, !graph.weights[to as usize], !to);
        let other = free.max_by_key(|&edge| rank(edge)).map_or(NONE, |edge| edge.0);
        of[node as usize] = pairs.len() as u32;
        if other != NONE {
            of[other as usize] = pairs.len() as u32;
        }
        pairs.push([node, other]);
    }
    (of, pairs)
}
