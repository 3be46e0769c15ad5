//! Orders of the nodes of a tree.

mod cache_oblivious;
mod van_emde_boas;

use crate::{Permutation, Tree};

/// How the nodes of a tree are ordered. In all orders parents come before their children.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeOrder {
    /// Level by level.
    BreadthFirst,
    /// Each node, then all that is below its first child, then all that is below its second, ...
    DepthFirst,
    /// The upper half of the levels, then each subtree of the lower half, both in the same way (van Emde Boas; Prokop
    /// 1999): few blocks of any size on the way from the root to a leaf, if all leaves are as probable.
    VanEmdeBoas,
    /// The most probable nodes from the root on, some √n of n, then each subtree below them, both in the same way (Yoon
    /// and Manocha 2006, "Cache-efficient layouts of bounding volume hierarchies").
    CacheOblivious,
}

impl TreeOrder {
    /// The order of the nodes of `tree`.
    ///
    /// Memory: up to 20 bytes a node. Time: O(n log log n), but for trees like chains.
    pub fn of(self, tree: &Tree) -> Permutation {
        let order = match self {
            TreeOrder::BreadthFirst => breadth_first(tree),
            TreeOrder::DepthFirst => depth_first(tree),
            TreeOrder::VanEmdeBoas => van_emde_boas::order(tree),
            TreeOrder::CacheOblivious => cache_oblivious::order(tree),
        };
        Permutation::of_order(order).expect("every node is visited once")
    }
}

fn breadth_first(tree: &Tree) -> Vec<u32> {
    let mut order = tree.roots().to_vec();
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        order.extend_from_slice(tree.children(node));
        next += 1;
    }
    order
}

fn depth_first(tree: &Tree) -> Vec<u32> {
    let mut order = Vec::with_capacity(tree.len());
    let mut to_visit: Vec<u32> = tree.roots().iter().rev().copied().collect();
    while let Some(node) = to_visit.pop() {
        order.push(node);
        to_visit.extend(tree.children(node).iter().rev());
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::testing::{any_tree, full_binary};
    use proptest::prelude::*;

    const ALL: [TreeOrder; 4] =
        [TreeOrder::BreadthFirst, TreeOrder::DepthFirst, TreeOrder::VanEmdeBoas, TreeOrder::CacheOblivious];

    #[test]
    fn small_trees_have_known_orders() {
        let order = |how: TreeOrder, levels| how.of(&full_binary(levels)).order().to_vec();
        assert_eq!(order(TreeOrder::BreadthFirst, 3), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(order(TreeOrder::DepthFirst, 3), [0, 1, 3, 4, 2, 5, 6]);
        // Two levels above, two below.
        let four = [0, 1, 2, 3, 7, 8, 4, 9, 10, 5, 11, 12, 6, 13, 14];
        assert_eq!(order(TreeOrder::VanEmdeBoas, 4), four);
    }

    /// Blocks of `size` nodes that are met on the way from the root to all leaves, on average.
    fn blocks_a_descent(order: &Permutation, levels: u32, size: u32) -> f64 {
        let places = order.places();
        let leaves = (1u32 << (levels - 1)) - 1..(1 << levels) - 1;
        let blocks = |leaf: u32| {
            let path = std::iter::successors(Some(leaf), |&node| node.checked_sub(1).map(|i| i / 2));
            let mut blocks: Vec<u32> = path.map(|node| places[node as usize] / size).collect();
            blocks.sort_unstable();
            blocks.dedup();
            blocks.len()
        };
        leaves.clone().map(blocks).sum::<usize>() as f64 / leaves.len() as f64
    }

    #[test]
    fn descents_meet_fewer_blocks_at_every_size() {
        let tree = full_binary(12);
        for size in [8, 32, 128, 512] {
            let blocks = ALL.map(|how| blocks_a_descent(&how.of(&tree), 12, size));
            let [breadth, depth, van_emde_boas, oblivious] = blocks;
            assert!(van_emde_boas < depth.min(breadth), "blocks of {size}: {blocks:?}");
            assert!(oblivious < depth.min(breadth), "blocks of {size}: {blocks:?}");
        }
    }

    proptest! {
        #[test]
        fn parents_come_first(tree in any_tree()) {
            for how in ALL {
                let places = how.of(&tree).places();
                for node in 0..tree.len() as u32 {
                    let place = |node: u32| places[node as usize];
                    prop_assert!(tree.children(node).iter().all(|&child| place(node) < place(child)), "{how:?}");
                }
            }
        }
    }
}
