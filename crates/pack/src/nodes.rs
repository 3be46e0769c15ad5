//! The check of nodes, which is the same in a page and above the pages.

use crate::layout::{ChildBoxes, WIDTH};

/// What a place for a child holds.
pub(crate) enum Child {
    /// Nothing.
    None,
    /// The node of that number.
    Node(usize),
    /// A strip or an entry that exists.
    Leaf,
    /// A strip or an entry that does not, and why.
    Broken(&'static str),
}

/// Checks each node by itself, and that they form trees of at most `depth_limit` levels, parents before their
/// children. Gives the number of trees.
pub(crate) fn check_nodes<N>(
    nodes: &[N],
    depth_limit: usize,
    check_node: impl Fn(&N) -> Result<(), &'static str>,
    children: impl Fn(&N) -> [Child; WIDTH],
) -> Result<usize, String> {
    // Level of each node; 0 as long as it is nobody's child.
    let mut level = vec![0; nodes.len()];
    let mut tree_count = 0;
    for (i, node) in nodes.iter().enumerate() {
        let wrong = |what: &str| Err(format!("node {i}: {what}"));
        if let Err(what) = check_node(node) {
            return wrong(what);
        }
        tree_count += usize::from(level[i] == 0);
        let here = level[i].max(1);
        if here > depth_limit {
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
                Child::Node(c) if c <= i || c >= nodes.len() || level[c] != 0 => return wrong("bad child"),
                Child::Node(c) => level[c] = here + 1,
            }
        }
    }
    Ok(tree_count)
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
