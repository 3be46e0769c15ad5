//! Makes the border between two halves better (Fiduccia and Mattheyses 1982).

use super::Weighted;
use std::collections::BinaryHeap;

/// Passes at most; most borders do not get better after two.
const PASSES: usize = 4;
/// Moves without a gain after which a pass ends.
const PATIENCE: usize = 64;

/// Moves nodes from one half to the other while fewer edges are cut, or as many with halves more equal. Halves stay within
/// 45 to 55 % of the weight, but for what one node weighs.
pub(super) fn refine(graph: &Weighted, is_second: &mut [bool]) {
    let mut border = Border::new(graph, is_second);
    for _ in 0..PASSES {
        if !border.pass() {
            break;
        }
    }
}

struct Border<'a> {
    graph: &'a Weighted,
    is_second: &'a mut [bool],
    /// For each node how much less is cut when it moves.
    gains: Vec<i64>,
    /// Weight of both halves.
    weights: [u64; 2],
    /// Nodes in both halves.
    counts: [usize; 2],
    /// What a half may weigh.
    most: u64,
}

impl<'a> Border<'a> {
    fn new(graph: &'a Weighted, is_second: &'a mut [bool]) -> Border<'a> {
        let (mut weights, mut counts) = ([0; 2], [0; 2]);
        for (&side, &weight) in is_second.iter().zip(&graph.weights) {
            weights[usize::from(side)] += u64::from(weight);
            counts[usize::from(side)] += 1;
        }
        let heaviest = graph.weights.iter().copied().max().unwrap_or(0);
        let most = (graph.weight() * 11 / 20).max(graph.weight() / 2 + u64::from(heaviest));
        let mut border = Border { graph, is_second, gains: Vec::new(), weights, counts, most };
        border.gains = (0..graph.len() as u32).map(|node| border.gain(node)).collect();
        border
    }

    fn gain(&self, node: u32) -> i64 {
        let side = self.is_second[node as usize];
        let across = |&(to, weight): &(u32, u32)| {
            if self.is_second[to as usize] == side { -i64::from(weight) } else { i64::from(weight) }
        };
        self.graph.edges(node).iter().map(across).sum()
    }

    /// Moves every node once at most, the best first, and takes back what came after the best state. Tells whether that is
    /// better than before.
    fn pass(&mut self) -> bool {
        let is_at_border = |&node: &u32| {
            let side = self.is_second[node as usize];
            self.graph.edges(node).iter().any(|&(to, _)| self.is_second[to as usize] != side)
        };
        let entry = |node: u32, gain: i64| (gain, std::cmp::Reverse(node));
        let nodes = (0..self.graph.len() as u32).filter(is_at_border);
        let mut queue: BinaryHeap<_> = nodes.map(|node| entry(node, self.gains[node as usize])).collect();
        let mut is_moved = vec![false; self.graph.len()];
        let mut moves = Vec::new();
        let (mut gained, mut best) = (0, (0, std::cmp::Reverse(self.imbalance())));
        let mut best_moves = 0;
        while let Some((gain, std::cmp::Reverse(node))) = queue.pop() {
            let is_stale = is_moved[node as usize] || gain != self.gains[node as usize];
            if is_stale || !self.may_move(node) {
                continue;
            }
            is_moved[node as usize] = true;
            self.flip(node);
            moves.push(node);
            gained += gain;
            if (gained, std::cmp::Reverse(self.imbalance())) > best {
                (best, best_moves) = ((gained, std::cmp::Reverse(self.imbalance())), moves.len());
            }
            if moves.len() - best_moves > PATIENCE {
                break;
            }
            let near = self.graph.edges(node).iter().filter(|edge| !is_moved[edge.0 as usize]);
            queue.extend(near.map(|&(to, _)| entry(to, self.gains[to as usize])));
        }
        moves[best_moves..].iter().for_each(|&node| self.flip(node));
        best_moves > 0
    }

    fn imbalance(&self) -> u64 {
        self.weights[0].abs_diff(self.weights[1])
    }

    /// Whether the other half does not get too heavy, nor this one empty.
    fn may_move(&self, node: u32) -> bool {
        let side = usize::from(self.is_second[node as usize]);
        let weight = u64::from(self.graph.weights[node as usize]);
        self.counts[side] > 1 && self.weights[1 - side] + weight <= self.most
    }

    fn flip(&mut self, node: u32) {
        let side = usize::from(self.is_second[node as usize]);
        let weight = u64::from(self.graph.weights[node as usize]);
        self.is_second[node as usize] = side == 0;
        self.weights[side] -= weight;
        self.weights[1 - side] += weight;
        self.counts[side] -= 1;
        self.counts[1 - side] += 1;
        self.gains[node as usize] = -self.gains[node as usize];
        for &(to, weight) in self.graph.edges(node) {
            let is_cut = self.is_second[to as usize] != self.is_second[node as usize];
            self.gains[to as usize] += if is_cut { 2 } else { -2 } * i64::from(weight);
        }
    }
}
