//! Binary hierarchies to wide nodes, by dynamic programming (Ylitie, Karras, Laine 2017, section 3).
//!
//! Which of the nodes below become children of a wide node is chosen so that the sum of the areas of all wide nodes is
//! least: that is what a ray is expected to visit. To open the largest child again and again is simpler, but ends
//! with nodes of two or three children above the leaves, which are most of all nodes.

use crate::bvh::Bvh;
use std::array::from_fn;

/// Children of a wide node.
const WIDTH: usize = 8;

/// How the subtrees of a hierarchy, whose leaves hold one item each, become wide nodes. Subtrees are numbered in
/// pre-order.
pub struct Collapse {
    /// For each inner subtree, and for 1 to [`WIDTH`] roots: how many of the roots are in its left half.
    left_roots: Vec<[u8; WIDTH + 1]>,
}

/// A subtree and its number.
pub type Numbered<'a> = (&'a Bvh, usize);

impl Collapse {
    /// Decides for all of `tree`.
    pub fn of(tree: &Bvh) -> Collapse {
        let mut collapse = Collapse { left_roots: Vec::with_capacity(2 * tree.items().len()) };
        collapse.costs(tree);
        collapse
    }

    /// The children of the wide node that stands for an inner subtree; nothing for a leaf.
    pub fn children<'a>(&self, node: Numbered<'a>) -> Vec<Numbered<'a>> {
        let mut children = Vec::with_capacity(WIDTH);
        if let Some(halves) = halves(node) {
            self.divide(node.1, halves, WIDTH, &mut children);
        }
        children
    }

    /// Appends the roots of a forest of at most `roots` subtrees for `node`.
    fn forest<'a>(&self, node: Numbered<'a>, roots: usize, out: &mut Vec<Numbered<'a>>) {
        // A left half without roots says that one for the whole is best.
        match halves(node).filter(|_| roots > 1 && self.left_roots[node.1][roots] > 0) {
            Some(halves) => self.divide(node.1, halves, roots, out),
            None => out.push(node),
        }
    }

    fn divide<'a>(
        &self,
        number: usize,
        [left, right]: [Numbered<'a>; 2],
        roots: usize,
        out: &mut Vec<Numbered<'a>>,
    ) {
        let chosen = usize::from(self.left_roots[number][roots]);
        self.forest(left, chosen, out);
        self.forest(right, roots - chosen, out);
    }

    /// Decides below `tree`, and gives the least costs of a forest of at most 1, 2, ... roots for it.
    fn costs(&mut self, tree: &Bvh) -> [f32; WIDTH + 1] {
        let number = self.left_roots.len();
        self.left_roots.push([0; WIDTH + 1]);
        let area = tree.bounds().half_area();
        let Bvh::Inner { children, .. } = tree else { return [area; WIDTH + 1] };
        let left = self.costs(&children[0]);
        let right = self.costs(&children[1]);
        let best = |roots: usize| {
            let costs = (1..roots).map(|i| (left[i] + right[roots - i], i as u8));
            costs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::INFINITY, 0))
        };
        let (below, chosen) = best(WIDTH);
        let as_node = area + below;
        let divided: [(f32, u8); WIDTH + 1] = from_fn(|roots| {
            let (cost, i) = best(roots);
            if cost < as_node { (cost, i) } else { (as_node, 0) }
        });
        self.left_roots[number] = divided.map(|d| d.1);
        // The last one is looked up when the subtree has become a node, whose children are not that node again.
        self.left_roots[number][WIDTH] = chosen;
        divided.map(|d| d.0)
    }
}

/// Both halves of an inner subtree with their numbers.
fn halves((tree, number): Numbered) -> Option<[Numbered; 2]> {
    let Bvh::Inner { children, .. } = tree else { return None };
    let left_subtrees = 2 * children[0].items().len() - 1;
    Some([(&children[0], number + 1), (&children[1], number + 1 + left_subtrees)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh;
    use glam::Vec3;
    use proptest::prelude::*;
    use raystrips_geom::Aabb;

    /// Wide nodes above the leaves, and their items in order.
    fn walk(collapse: &Collapse, node: Numbered, items: &mut Vec<usize>) -> usize {
        if let Bvh::Leaf { items: here, .. } = node.0 {
            items.extend(here.clone());
            return 0;
        }
        let children = collapse.children(node);
        assert!((2..=WIDTH).contains(&children.len()));
        1 + children.into_iter().map(|c| walk(collapse, c, items)).sum::<usize>()
    }

    fn check(bounds: &[Aabb]) -> usize {
        let tree = bvh::build(bounds, &|_| false).tree;
        let mut items = Vec::new();
        let nodes = walk(&Collapse::of(&tree), (&tree, 0), &mut items);
        assert!(items.into_iter().eq(0..bounds.len()));
        nodes
    }

    #[test]
    fn equal_boxes_fill_their_nodes() {
        let bounds: Vec<Aabb> =
            (0..64).map(|i| Aabb::EMPTY.grow(Vec3::new(i as f32, 0.0, 0.0)).grow(Vec3::ONE)).collect();
        assert!(check(&bounds) <= 11, "{} nodes", check(&bounds));
    }

    proptest! {
        #[test]
        fn every_item_stays(points in prop::collection::vec(prop::array::uniform3(-1e3f32..1e3), 2..200)) {
            let bounds: Vec<Aabb> = points.iter().map(|&p| Aabb::EMPTY.grow(Vec3::from_array(p))).collect();
            check(&bounds);
        }
    }
}
