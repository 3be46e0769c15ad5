//! The most probable nodes from the root on, then each subtree below them, both in the same way.

use crate::Tree;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

pub(super) fn order(tree: &Tree) -> Vec<u32> {
    let depth_first = super::depth_first(tree);
    let mut rank = vec![0; tree.len()];
    for (place, &node) in (0..).zip(&depth_first) {
        rank[node as usize] = place;
    }
    let mut layout = Layout {
        tree,
        rank,
        cluster: vec![0; tree.len()],
        clusters: 1,
        order: Vec::with_capacity(tree.len()),
    };
    tree.roots().iter().for_each(|&root| layout.add(root));
    layout.order
}

struct Layout<'a> {
    tree: &'a Tree,
    /// Place of each node in depth-first order.
    rank: Vec<u32>,
    /// Cluster that each node is in at present, and how many there were.
    cluster: Vec<u32>,
    clusters: u32,
    order: Vec<u32>,
}

/// A node that may be the next one.
struct Candidate {
    probability: f32,
    rank: u32,
    node: u32,
}

impl Layout<'_> {
    /// Adds `root` and all below it that is in the same cluster.
    fn add(&mut self, root: u32) {
        let cluster = self.cluster[root as usize];
        let count = self.count(root, cluster);
        if count <= 2 {
            self.order.push(root);
            let below = self.tree.children(root).iter();
            self.order.extend(below.filter(|&&child| self.cluster[child as usize] == cluster));
            return;
        }
        let mut below = self.grow(root, (count as f64).sqrt().ceil() as usize);
        self.add(root);
        // Subtrees that are near in space are near in depth-first order.
        below.sort_unstable_by_key(|&node| self.rank[node as usize]);
        below.into_iter().for_each(|node| self.add(node));
    }

    fn count(&self, root: u32, cluster: u32) -> usize {
        let (mut to_visit, mut count) = (vec![root], 0);
        while let Some(node) = to_visit.pop() {
            count += 1;
            let below = self.tree.children(node).iter();
            to_visit.extend(below.filter(|&&child| self.cluster[child as usize] == cluster));
        }
        count
    }

    /// Puts `root` and the most probable nodes below it, `count` in all, into a cluster of their own. Gives the nodes below
    /// that stay.
    fn grow(&mut self, root: u32, count: usize) -> Vec<u32> {
        let old = self.cluster[root as usize];
        let new = self.clusters;
        self.clusters += 1;
        let mut candidates = BinaryHeap::from([self.candidate(root)]);
        for _ in 0..count {
            let Some(Candidate { node, .. }) = candidates.pop() else { break };
            self.cluster[node as usize] = new;
            let below = self.tree.children(node).iter();
            let below = below.filter(|&&child| self.cluster[child as usize] == old);
            candidates.extend(below.map(|&child| self.candidate(child)));
        }
        candidates.into_iter().map(|candidate| candidate.node).collect()
    }

    fn candidate(&self, node: u32) -> Candidate {
        Candidate { probability: self.tree.probability(node), rank: self.rank[node as usize], node }
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Candidate) -> Ordering {
        self.probability.total_cmp(&other.probability).then(other.rank.cmp(&self.rank))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Candidate) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Candidate) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}
