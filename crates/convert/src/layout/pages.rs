//! The order of the pages of a piece in the file. Their numbers stay those of the hierarchy, which decide between hits at
//! the same distance.

use super::Layout;
use crate::assemble::Root;
use raystrips_geom::Aabb;
use raystrips_layout::{Graph, Permutation, Tree};
use raystrips_strips::Bvh;

/// The order of `count` pages, which are numbered depth first; leaf i of `tree` leads to root i.
pub(crate) fn order_pages(layout: Layout, tree: &Bvh, roots: &[Root], count: usize) -> Permutation {
    match layout.of_tree() {
        Some(how) => {
            let (tree, leaves) = tree_of(tree);
            let nodes = how.of(&tree);
            let visited = nodes.order().iter().filter_map(|&node| leaves[node as usize]);
            by_first_visit(visited.map(|root| roots[root].page), count)
        }
        None => {
            let centers = centers(tree, roots, count);
            layout.of_graph().of(&Graph::new(count, &[]), &centers)
        }
    }
}

/// A hierarchy in pre-order, and for each node its item if it is a leaf.
fn tree_of(tree: &Bvh) -> (Tree, Vec<Option<usize>>) {
    let (mut parents, mut areas, mut leaves) = (Vec::new(), Vec::new(), Vec::new());
    let mut to_visit = vec![(tree, None)];
    while let Some((tree, parent)) = to_visit.pop() {
        let number = parents.len() as u32;
        parents.push(parent);
        areas.push(tree.bounds().half_area());
        match tree {
            Bvh::Leaf { items, .. } => leaves.push(Some(items.start)),
            Bvh::Inner { children, .. } => {
                leaves.push(None);
                to_visit.extend(children.iter().rev().map(|child| (child, Some(number))));
            }
        }
    }
    (Tree::new(&parents, areas), leaves)
}

/// Pages in the order in which they are first named.
fn by_first_visit(named: impl Iterator<Item = u32>, count: usize) -> Permutation {
    let mut first = vec![usize::MAX; count];
    for (place, page) in named.enumerate() {
        first[page as usize] = first[page as usize].min(place);
    }
    Permutation::by_key(&first)
}

/// The middle of what is in each page.
fn centers(tree: &Bvh, roots: &[Root], count: usize) -> Vec<[f32; 3]> {
    let mut boxes = vec![Aabb::EMPTY; count];
    for (root, bounds) in roots.iter().zip(tree.leaf_bounds()) {
        let page = &mut boxes[root.page as usize];
        *page = page.union(bounds);
    }
    boxes.iter().map(|b| b.center().to_array()).collect()
}
