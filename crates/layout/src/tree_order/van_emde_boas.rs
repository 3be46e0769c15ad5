//! The upper half of the levels, then each subtree of the lower half, both in the same way.

use crate::Tree;

pub(super) fn order(tree: &Tree) -> Vec<u32> {
    let mut layout = Layout { tree, levels: levels(tree), order: Vec::with_capacity(tree.len()) };
    for &root in tree.roots() {
        layout.add(root, layout.levels[root as usize]);
    }
    layout.order
}

/// Levels below each node, itself counted.
fn levels(tree: &Tree) -> Vec<u32> {
    let mut levels = vec![1; tree.len()];
    for node in (0..tree.len() as u32).rev() {
        let below = tree.children(node).iter().map(|&child| levels[child as usize]).max();
        levels[node as usize] += below.unwrap_or(0);
    }
    levels
}

struct Layout<'a> {
    tree: &'a Tree,
    levels: Vec<u32>,
    order: Vec<u32>,
}

impl Layout<'_> {
    /// Adds `node` and what is less than `levels` levels below it.
    fn add(&mut self, node: u32, levels: u32) {
        let levels = levels.min(self.levels[node as usize]);
        if levels == 1 {
            self.order.push(node);
            return;
        }
        let upper = levels / 2;
        self.add(node, upper);
        for root in self.at_level(node, upper) {
            self.add(root, levels - upper);
        }
    }

    /// The nodes `level` levels below `node`, from first to last.
    fn at_level(&self, node: u32, level: u32) -> Vec<u32> {
        let mut nodes = vec![node];
        for _ in 0..level {
            nodes = nodes.iter().flat_map(|&node| self.tree.children(node)).copied().collect();
        }
        nodes
    }
}
