//! The balanced spatial kd-tree along a strip (paper, section 4.1): halves by number, in units of a leaf, with two
//! planes a node.

use glam::Vec3;
use raystrips_geom::Aabb;

/// Triangles of a leaf.
pub const LEAF_TRIANGLES: usize = 2;

/// A node: the half that is on the left in space ends at `left_max`, the other begins at `right_min`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Split {
    /// Greatest coordinate of the left half.
    pub left_max: f32,
    /// Least coordinate of the right half.
    pub right_min: f32,
    /// Axis of both.
    pub axis: u8,
    /// True where the left half is the second one of the strip.
    pub reverse: bool,
}

/// Leaves of a strip with so many triangles.
#[inline]
pub fn units(triangles: usize) -> usize {
    triangles.div_ceil(LEAF_TRIANGLES)
}

/// Leaves in the first half of `units`; the nodes over the first half are one less, so that the second child of node
/// i is node i + `first_half(units)`.
#[inline]
pub fn first_half(units: u32) -> u32 {
    units.div_ceil(2)
}

/// The nodes of `strip` in pre-order; there are `units` - 1.
pub fn build(strip: &[u32], positions: &[Vec3]) -> Vec<Split> {
    let mut nodes = Vec::new();
    build_part(strip, positions, units(strip.len() - 2) as u32, &mut nodes);
    nodes
}

/// Appends the nodes over `strip` and gives the box around it.
fn build_part(strip: &[u32], positions: &[Vec3], units: u32, nodes: &mut Vec<Split>) -> Aabb {
    if units == 1 {
        return Aabb::of_points(strip.iter().map(|&v| positions[v as usize]));
    }
    let place = nodes.len();
    nodes.push(Split::default());
    let left = first_half(units);
    let edge = left as usize * LEAF_TRIANGLES;
    let first = build_part(&strip[..edge + 2], positions, left, nodes);
    let second = build_part(&strip[edge..], positions, units - left, nodes);
    nodes[place] = split(&first, &second);
    first.union(second)
}

/// Splits where the halves overlap least; a gap is less than no overlap.
fn split(first: &Aabb, second: &Aabb) -> Split {
    let candidates = (0..3u8).flat_map(|axis| {
        [(first, second, false), (second, first, true)].map(|(left, right, reverse)| Split {
            left_max: left.max[usize::from(axis)],
            right_min: right.min[usize::from(axis)],
            axis,
            reverse,
        })
    });
    let overlap = |split: &Split| split.left_max - split.right_min;
    candidates.min_by(|a, b| overlap(a).total_cmp(&overlap(b))).expect("there are three axes")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_those_of_the_paper_for_every_length() {
        let positions: Vec<Vec3> = (0..203).map(|i| Vec3::new(i as f32, (i % 2) as f32, 0.0)).collect();
        for triangles in 1..=200usize {
            let strip: Vec<u32> = (0..triangles as u32 + 2).collect();
            assert_eq!(build(&strip, &positions).len(), triangles.div_ceil(2) - 1);
        }
    }

    #[test]
    fn splits_separate_halves() {
        let positions: Vec<Vec3> = (0..10).map(|i| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0)).collect();
        let strip: Vec<u32> = (0..10).collect();
        let root = build(&strip, &positions)[0];
        assert_eq!(root, Split { left_max: 2.0, right_min: 2.0, axis: 0, reverse: false });
        let back: Vec<u32> = (0..10).rev().collect();
        assert!(build(&back, &positions)[0].reverse);
    }
}
