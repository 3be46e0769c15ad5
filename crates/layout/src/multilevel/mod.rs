//! An order that is good for blocks of every size: the graph is cut in two where that cuts few edges, and each half in the
//! same way.
//!
//! Yoon et al. 2005 cut into four and try all orders of the four; here each half goes to the side where more of its edges
//! to the outside lead. Halves are found on several levels (Karypis and Kumar 1998): pairs of neighbors are joined until
//! few nodes are left, those are cut, and the border is made better on each level on the way back.

mod bisect;
mod coarsen;
mod refine;

use crate::{Graph, Permutation};

/// A graph with weights: part of another one, or nodes that stand for several of it.
struct Weighted {
    starts: Vec<u32>,
    /// Neighbors and the weights of the edges to them.
    edges: Vec<(u32, u32)>,
    weights: Vec<u32>,
}

impl Weighted {
    fn len(&self) -> usize {
        self.weights.len()
    }

    fn edges(&self, node: u32) -> &[(u32, u32)] {
        let node = node as usize;
        &self.edges[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    fn weight(&self) -> u64 {
        self.weights.iter().map(|&weight| u64::from(weight)).sum()
    }
}

/// Nodes whose places follow each other.
struct Part {
    graph: Weighted,
    /// Number of each node in the whole graph.
    numbers: Vec<u32>,
    /// For each node, edges to what comes after this part less edges to what comes before it.
    pull: Vec<i64>,
}

pub(crate) fn order(graph: &Graph) -> Permutation {
    let nodes = 0..graph.len() as u32;
    let mut starts = vec![0];
    let mut edges = Vec::new();
    for node in nodes.clone() {
        edges.extend(graph.neighbors(node).iter().map(|&other| (other, 1)));
        starts.push(edges.len() as u32);
    }
    let weighted = Weighted { starts, edges, weights: vec![1; graph.len()] };
    let mut order = Vec::with_capacity(graph.len());
    let mut parts = vec![Part { graph: weighted, numbers: nodes.collect(), pull: vec![0; graph.len()] }];
    while let Some(part) = parts.pop() {
        if part.numbers.len() <= 1 {
            order.extend(part.numbers);
            continue;
        }
        let [first, second] = part.divide();
        parts.extend([second, first]);
    }
    Permutation::of_order(order).expect("every node is in one part")
}

impl Part {
    /// Both halves, the first one first.
    fn divide(self) -> [Part; 2] {
        let mut is_second = bisect::bisect(&self.graph);
        let pull_of = |side: bool| -> i64 {
            self.pull.iter().zip(&is_second).filter(|&(_, &s)| s == side).map(|(pull, _)| pull).sum()
        };
        if pull_of(false) > pull_of(true) {
            is_second.iter_mut().for_each(|side| *side = !*side);
        }
        [false, true].map(|side| self.half(&is_second, side))
    }

    /// The nodes on one side.
    fn half(&self, is_second: &[bool], side: bool) -> Part {
        let inside = |node: u32| is_second[node as usize] == side;
        let mut number_in_half = vec![0; self.numbers.len()];
        let nodes: Vec<u32> = (0..self.numbers.len() as u32).filter(|&node| inside(node)).collect();
        for (number, &node) in (0..).zip(&nodes) {
            number_in_half[node as usize] = number;
        }
        let (mut starts, mut edges, mut pull) = (vec![0], Vec::new(), Vec::with_capacity(nodes.len()));
        for &node in &nodes {
            let own = self.graph.edges(node).iter();
            edges
                .extend(own.clone().filter(|e| inside(e.0)).map(|&(to, w)| (number_in_half[to as usize], w)));
            starts.push(edges.len() as u32);
            let across: i64 = own.filter(|e| !inside(e.0)).map(|e| i64::from(e.1)).sum();
            pull.push(self.pull[node as usize] + if side { -across } else { across });
        }
        Part {
            graph: Weighted {
                starts,
                edges,
                weights: nodes.iter().map(|&node| self.graph.weights[node as usize]).collect(),
            },
            numbers: nodes.iter().map(|&node| self.numbers[node as usize]).collect(),
            pull,
        }
    }
}
