//! Subtrees that fill blocks of one known size.

use crate::Tree;

/// A tree cut into treelets: parts that are connected and fit into a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Treelets {
    /// Treelet of each node; numbered such that the treelet of a parent has no greater number.
    pub of: Vec<u32>,
    /// Treelets.
    pub count: u32,
    /// Treelets that a walk from the root is expected to enter, by the probabilities of their roots.
    pub expected: f64,
}

/// Cuts `tree` into treelets of at most `max_bytes`, or of one node that has more, such that few are entered (Aila and
/// Karras 2010, "Architecture considerations for tracing incoherent rays", section 4.1: for each node, treelets below it
/// that were best are kept, and its own grows by the most probable node that still fits).
///
/// Memory: 20 bytes a node. Time: O(n m²) with m nodes a treelet.
///
/// # Panics
/// If there are not as many `bytes` as nodes.
pub fn treelets(tree: &Tree, bytes: &[u32], max_bytes: u32) -> Treelets {
    assert_eq!(tree.len(), bytes.len(), "nodes and their bytes");
    let all_bytes: f64 = bytes.iter().map(|&b| f64::from(b)).sum();
    let area: f64 = tree.roots().iter().map(|&root| f64::from(tree.probability(root))).sum();
    // Keeps treelets from becoming tiny where that costs no visits.
    let epsilon = area * f64::from(max_bytes) / (10.0 * all_bytes.max(1.0));
    let mut cutter = Cutter { tree, bytes, max_bytes, epsilon, best: vec![(0.0, 0); tree.len()] };
    for node in (0..tree.len() as u32).rev() {
        cutter.decide(node);
    }
    cutter.cut(area)
}

struct Cutter<'a> {
    tree: &'a Tree,
    bytes: &'a [u32],
    max_bytes: u32,
    epsilon: f64,
    /// For each node the least cost below it, and how many nodes its treelet has then.
    best: Vec<(f64, u32)>,
}

impl Cutter<'_> {
    /// Finds the best treelet with the root `node`; all below it are decided.
    fn decide(&mut self, node: u32) {
        let entry = f64::from(self.tree.probability(node)) + self.epsilon;
        let mut growth = Growth::from(node);
        let (mut best, mut size) = ((f64::INFINITY, 0), 0);
        while growth.step(self) {
            size += 1;
            let below: f64 = growth.cut.iter().map(|&child| self.best[child as usize].0).sum();
            if entry + below < best.0 {
                best = (entry + below, size);
            }
        }
        self.best[node as usize] = best;
    }

    fn cut(&self, area: f64) -> Treelets {
        let mut treelets = Treelets { of: vec![0; self.tree.len()], count: 0, expected: 0.0 };
        let mut roots: std::collections::VecDeque<u32> = self.tree.roots().iter().copied().collect();
        while let Some(root) = roots.pop_front() {
            let mut growth = Growth::from(root);
            (0..self.best[root as usize].1).for_each(|_| _ = growth.step(self));
            growth.inside.iter().for_each(|&node| treelets.of[node as usize] = treelets.count);
            treelets.expected += f64::from(self.tree.probability(root)) / area.max(f64::MIN_POSITIVE);
            treelets.count += 1;
            roots.extend(growth.cut);
        }
        treelets
    }
}

/// A treelet while it grows.
struct Growth {
    inside: Vec<u32>,
    /// Nodes below it.
    cut: Vec<u32>,
    used_bytes: u32,
}

impl Growth {
    fn from(root: u32) -> Growth {
        Growth { inside: Vec::new(), cut: vec![root], used_bytes: 0 }
    }

    /// Takes in the most probable node of the cut that fits; the first one always does.
    fn step(&mut self, cutter: &Cutter) -> bool {
        let fits = |&place: &usize| {
            let bytes = cutter.bytes[self.cut[place] as usize];
            self.inside.is_empty() || self.used_bytes.saturating_add(bytes) <= cutter.max_bytes
        };
        let probability = |place: usize| cutter.tree.probability(self.cut[place]);
        let candidates = (0..self.cut.len()).filter(fits);
        let Some(place) =
            candidates.max_by(|&a, &b| probability(a).total_cmp(&probability(b)).then(b.cmp(&a)))
        else {
            return false;
        };
        let node = self.cut.remove(place);
        self.inside.push(node);
        self.used_bytes = self.used_bytes.saturating_add(cutter.bytes[node as usize]);
        self.cut.extend_from_slice(cutter.tree.children(node));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::testing::{any_tree, full_binary};
    use proptest::prelude::*;

    #[test]
    fn full_trees_are_cut_into_full_trees() {
        // Six levels in blocks of seven nodes: one treelet of three levels above eight of them.
        let treelets = treelets(&full_binary(6), &[10; 63], 70);
        assert_eq!(treelets.count, 9);
        assert!((0..7).all(|node| treelets.of[node] == 0));
    }

    #[test]
    fn nodes_larger_than_a_block_stand_alone() {
        let treelets = treelets(&full_binary(2), &[100, 3, 3], 10);
        assert_eq!((treelets.count, treelets.of), (3, vec![0, 1, 2]));
    }

    proptest! {
        #[test]
        fn treelets_fit_and_are_connected(tree in any_tree(), max_bytes in 1u32..100) {
            let bytes: Vec<u32> = (0..tree.len() as u32).map(|i| i * 7 % 13 + 1).collect();
            let treelets = treelets(&tree, &bytes, max_bytes);
            let mut used = vec![(0, 0); treelets.count as usize];
            for (of, bytes) in treelets.of.iter().zip(&bytes) {
                let (nodes, sum) = &mut used[*of as usize];
                *nodes += 1;
                *sum += bytes;
            }
            prop_assert!(used.iter().all(|&(nodes, bytes)| nodes == 1 || nodes > 1 && bytes <= max_bytes));
            // A treelet is entered from above once: it has as many nodes as ways within it, and one root.
            let inner = |node: u32| {
                let same = |&&child: &&u32| treelets.of[child as usize] == treelets.of[node as usize];
                tree.children(node).iter().filter(same).count()
            };
            let ways: usize = (0..tree.len() as u32).map(inner).sum();
            prop_assert_eq!(tree.len() - ways, treelets.count as usize);
        }
    }
}
