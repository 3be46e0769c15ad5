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

/// Checks that nodes have finite grids and form trees of at most `depth_limit` levels, parents before their
/// children, and gives the number of trees.
pub(crate) fn check_nodes<N>(
    nodes: &[N],
    depth_limit: usize,
    boxes: impl Fn(&N) -> &ChildBoxes,
    children: impl Fn(&N) -> [Child; WIDTH],
) -> Result<usize, String> {
    // Level of each node; 0 as long as it is nobody's child.
    let mut level = vec![0; nodes.len()];
    let mut tree_count = 0;
    for (i, node) in nodes.iter().enumerate() {
        let wrong = |what: &str| Err(format!("node {i}: {what}"));
        if !boxes_are_sane(boxes(node)) {
            return wrong("bad grid");
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

/// True where planes are finite: what the box test needs to be free of NaN.
fn boxes_are_sane(boxes: &ChildBoxes) -> bool {
    boxes.exponent.iter().all(|&e| e > -127) && {
        let grid = boxes.grid();
        (0..3).all(|axis| grid.origin[axis].is_finite() && grid.plane(axis, 255).is_finite())
    }
}
