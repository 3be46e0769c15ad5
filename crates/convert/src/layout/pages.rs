//! The order of pages in a piece.

use super::Layout;
use crate::assemble::Assembled;
use raystrips_geom::Aabb;
use raystrips_layout::{Graph, Permutation, Tree};
use raystrips_strips::Bvh;

/// Orders the pages of a piece, which come depth first.
pub(crate) fn order_pages(layout: Layout, assembled: &mut Assembled) {
    if layout == Layout::DepthFirst {
        return;
    }
    let order = match layout.of_tree() {
        Some(how) => {
            let (tree, leaves) = tree_of(&assembled.tree);
            let nodes = how.of(&tree);
            let roots = nodes.order().iter().filter_map(|&node| leaves[node as usize]);
            by_first_visit(roots.map(|root| assembled.roots[root].page), assembled.pages.len())
        }
        None => {
            let centers = centers(assembled);
            layout.of_graph().of(&Graph::new(centers.len(), &[]), &centers)
        }
    };
    assembled.pages = order.apply(std::mem::take(&mut assembled.pages));
    let places = order.places();
    assembled.roots.iter_mut().for_each(|root| root.page = places[root.page as usize]);
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
fn centers(assembled: &Assembled) -> Vec<[f32; 3]> {
    let mut boxes = vec![Aabb::EMPTY; assembled.pages.len()];
    for (root, bounds) in assembled.roots.iter().zip(assembled.tree.leaf_bounds()) {
        let page = &mut boxes[root.page as usize];
        *page = page.union(bounds);
    }
    boxes.iter().map(|b| b.center().to_array()).collect()
}
