//! A ray against the eight boxes of a node.
//!
//! A plane is at `origin + q * spacing`, so its distance is `q * (spacing * inv) + (origin - org) * inv`: one
//! multiplication and one addition a plane. That form loses digits when the node is far away against its size,
//! and the triangle test rounds vertices too, so every box is widened by [`SLACK`] times the distance of the
//! node's farthest corner (largest component). The widened box is conservative for both; compare Ize 2013, who
//! widens by the error of the division alone.

use crate::prepared::PreparedRay;
use crate::simd::{LANES, Simd};
use raystrips_geom::grid::power_of_two;
use raystrips_pack::layout::ChildBoxes;

/// Relative widening of boxes: 16 units in the last place. The sum of all roundings in a box test and in the
/// transformation of a vertex is below 10.
const SLACK: f32 = 1.0 / (1 << 20) as f32;

/// Where a ray is inside each box.
pub(crate) struct BoxHits {
    /// Entry; never before the entry into the node.
    pub tnear: [f32; LANES],
    /// Exit.
    pub tfar: [f32; LANES],
    /// Bit *i*: box *i* is met before the limit.
    pub mask: u32,
}

/// The grid of a node as the ray sees it: the distance of plane `q` along axis *i* is
/// `q * step[i] + start[i]`, right within `slack[i]`.
pub(crate) struct RayGrid {
    pub step: [f32; 3],
    pub start: [f32; 3],
    pub slack: [f32; 3],
}

impl RayGrid {
    #[inline(always)]
    pub fn new(boxes: &ChildBoxes, ray: &PreparedRay) -> RayGrid {
        let spacing = boxes.exponent.map(power_of_two);
        let offset = [0, 1, 2].map(|i| boxes.origin[i] - ray.org[i]);
        let reach = [0, 1, 2].map(|i| offset[i].abs() + 255.0 * spacing[i]);
        let slack = max(max(reach[0], reach[1]), reach[2]) * SLACK;
        RayGrid {
            step: [0, 1, 2].map(|i| spacing[i] * ray.inv_dir[i]),
            start: [0, 1, 2].map(|i| offset[i] * ray.inv_dir[i]),
            slack: [0, 1, 2].map(|i| slack * ray.inv_dir[i].abs()),
        }
    }
}

/// Tests the boxes of a node that the ray enters at `entry`, against hits up to `limit`.
#[inline(always)]
pub(crate) fn test_boxes<S: Simd>(
    s: S,
    boxes: &ChildBoxes,
    ray: &PreparedRay,
    entry: f32,
    limit: f32,
) -> BoxHits {
    let grid = RayGrid::new(boxes, ray);
    let mut tnear = s.splat(entry);
    let mut tfar = s.splat(ray.tfar);
    for axis in 0..3 {
        let (lo, hi) = (&boxes.lo[axis], &boxes.hi[axis]);
        let (near, far) = if ray.forward[axis] { (lo, hi) } else { (hi, lo) };
        let step = s.splat(grid.step[axis]);
        let start_near = s.splat(grid.start[axis] - grid.slack[axis]);
        let start_far = s.splat(grid.start[axis] + grid.slack[axis]);
        // The new distance comes first: one that is NaN is passed over.
        tnear = s.max(s.add(s.mul(s.convert(near), step), start_near), tnear);
        tfar = s.min(s.add(s.mul(s.convert(far), step), start_far), tfar);
    }
    let mask = s.le(tnear, s.min(tfar, s.splat(limit)));
    BoxHits { tnear: s.store(tnear), tfar: s.store(tfar), mask }
}

/// a if a > b, else b: one instruction, unlike [`f32::max`].
#[inline(always)]
pub(crate) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// a if a < b, else b.
#[inline(always)]
pub(crate) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
