//! The check of nodes, which is the same in a page and above the pages.

use crate::layout::{ChildBoxes, WIDTH};

/// What a place for a child holds.
pub(crate) enum Child {
    /// Nothing.
    None,
    /// The node of that number.
    Node(usize),
    /// A strip, an entry or an instance that exists.
    Leaf,
    /// One that does not, and why.
    Broken(&'static str),
}

/// Where a node is.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    /// The root of its tree.
    pub root: usize,
    /// Levels from there to the node, both included.
    pub level: usize,
}

/// Checks each node by itself, and that they form trees of at most `depth_limit` levels, parents before their
/// children. Gives the place of each.
pub(crate) fn check_nodes<N>(
    nodes: &[N],
    depth_limit: usize,
    check_node: impl Fn(&N) -> Result<(), &'static str>,
    children: impl Fn(&N) -> [Child; WIDTH],
) -> Result<Vec<Place>, String> {
    // A root as long as it is nobody's child.
    let mut places: Vec<Place> = (0..nodes.len()).map(|root| Place { root, level: 1 }).collect();
    for (i, node) in nodes.iter().enumerate() {
        let wrong = |what: &str| Err(format!("node {i}: {what}"));
        if let Err(what) = check_node(node) {
            return wrong(what);
        }
        let here = places[i];
        if here.level > depth_limit {
            return wrong("too deep");
        }
        let mut ended = false;
        for (slot, child) in children(node).into_iter().enumerate() {
            match child {
                Child::None if slot == 0 => return wrong("no children"),
                Child::None => ended = true,
                _ if ended => return wrong("a child after an empty place"),
                Child::Leaf => {}
                Child::Broken(what) => return wrong(what),
                Child::Node(c) if c <= i || c >= nodes.len() || places[c].root != c => {
                    return wrong("bad child");
                }
                Child::Node(c) => places[c] = Place { root: here.root, level: here.level + 1 },
            }
        }
    }
    Ok(places)
}

/// Checks that planes above the pages are finite: what the box test needs to be free of NaN.
pub(crate) fn check_boxes(boxes: &ChildBoxes) -> Result<(), &'static str> {
    let grid = boxes.grid();
    let is_finite = |axis: usize| grid.origin[axis].is_finite() && grid.plane(axis, 255).is_finite();
    match boxes.exponent.iter().all(|&e| e > -127) && (0..3).all(is_finite) && boxes.reserved == 0 {
        true => Ok(()),
        false => Err("bad grid"),
    }
}
