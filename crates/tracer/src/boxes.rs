//! A ray against the eight boxes of a node.
//!
//! A plane is at `origin + q * spacing`, so its distance is `q * (spacing * inv) + (origin - org) * inv`: one
//! multiplication and one addition a plane. That form loses digits when the node is far away against its size,
//! and the triangle test rounds vertices too, so every box is widened by [`SLACK`] times the distance of the
//! node's farthest corner (largest component). The widened box is conservative for both; compare Ize 2013, who
//! widens by the error of the division alone.

use crate::prepared::PreparedRay;
use raystrips_geom::grid::power_of_two;
use raystrips_pack::layout::{ChildBoxes, WIDTH};

/// Relative widening of boxes: 16 units in the last place. The sum of all roundings in a box test and in the
/// transformation of a vertex is below 10.
const SLACK: f32 = 1.0 / (1 << 20) as f32;

/// Where a ray is inside each box.
pub(crate) struct BoxHits {
    /// Entry; never before the entry into the node.
    pub tnear: [f32; WIDTH],
    /// Exit.
    pub tfar: [f32; WIDTH],
    /// Bit *i*: box *i* is met before `limit`.
    pub mask: u8,
}

/// The grid of a node as the ray sees it: distance of plane `q` along axis *i* is `q * step[i] + start[i]`,
/// right within `slack[i]`.
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
pub(crate) fn test_boxes(boxes: &ChildBoxes, ray: &PreparedRay, entry: f32, limit: f32) -> BoxHits {
    let grid = RayGrid::new(boxes, ray);
    let mut tnear = [entry; WIDTH];
    let mut tfar = [ray.tfar; WIDTH];
    for axis in 0..3 {
        let forward = ray.inv_dir[axis] >= 0.0;
        let (near, far) =
            if forward { (&boxes.lo[axis], &boxes.hi[axis]) } else { (&boxes.hi[axis], &boxes.lo[axis]) };
        let step = grid.step[axis];
        let (start_near, start_far) =
            (grid.start[axis] - grid.slack[axis], grid.start[axis] + grid.slack[axis]);
        for i in 0..WIDTH {
            tnear[i] = max(f32::from(near[i]) * step + start_near, tnear[i]);
        }
        for i in 0..WIDTH {
            tfar[i] = min(f32::from(far[i]) * step + start_far, tfar[i]);
        }
    }
    let mut mask = 0u8;
    for i in 0..WIDTH {
        mask |= u8::from(tnear[i] <= min(tfar[i], limit)) << i;
    }
    BoxHits { tnear, tfar, mask }
}

/// `b` where `a` is NaN: one instruction, unlike [`f32::max`].
#[inline(always)]
pub(crate) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `b` where `a` is NaN.
#[inline(always)]
pub(crate) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
