//! A ray against the eight boxes of a node.
//!
//! A plane is at `origin + q * spacing`, so its distance is `q * (spacing * inv) + (origin - org) * inv`: one
//! multiplication and one addition a plane. That form loses digits when the node is far away against its size,
//! and the triangle test rounds vertices too, so every box is widened by a [`Slack`] that covers the sum of all
//! roundings; compare Ize 2013, who widens by the error of the division alone. The slack is found once for each
//! subtree, not in each node, where it would be at the beginning of a chain of operations that wait for each
//! other.

use crate::prepared::PreparedRay;
use crate::simd::{LANES, Simd};
use raystrips_geom::grid::power_of_two;
use raystrips_pack::layout::ChildBoxes;

/// Widening relative to the distance of the farthest corner: 32 units in the last place. All roundings of a box
/// test and of the transformation of a vertex come to 16 at most, grids reaching up to twice as far as what is in
/// them.
const RELATIVE_SLACK: f32 = 1.0 / (1 << 19) as f32;

/// Where a ray is inside each box.
pub(crate) struct BoxHits {
    /// Entry; never before the entry into the node.
    pub tnear: [f32; LANES],
    /// Exit.
    pub tfar: [f32; LANES],
    /// Bit *i*: box *i* is met before the limit.
    pub mask: u32,
}

/// What box tests below a node must allow for, as a distance along the ray for planes across each axis.
#[derive(Clone, Copy)]
pub(crate) struct Slack([f32; 3]);

impl Slack {
    /// For a node with these boxes and all below it.
    #[inline(always)]
    pub fn below(boxes: &ChildBoxes, ray: &PreparedRay) -> Slack {
        let reach = |i: usize| (boxes.origin[i] - ray.org[i]).abs() + 255.0 * power_of_two(boxes.exponent[i]);
        let slack = max(max(reach(0), reach(1)), reach(2)) * RELATIVE_SLACK;
        Slack(each(|i| slack * ray.inv_dir[i].abs()))
    }
}

/// The grid of a node as the ray sees it: the distance of plane `q` along axis *i* is at least
/// `q * step[i] + before[i]` and at most `q * step[i] + after[i]`.
pub(crate) struct RayGrid {
    pub step: [f32; 3],
    pub before: [f32; 3],
    pub after: [f32; 3],
}

impl RayGrid {
    #[inline(always)]
    pub fn new(boxes: &ChildBoxes, ray: &PreparedRay, slack: &Slack) -> RayGrid {
        let start = each(|i| (boxes.origin[i] - ray.org[i]) * ray.inv_dir[i]);
        RayGrid {
            step: each(|i| power_of_two(boxes.exponent[i]) * ray.inv_dir[i]),
            before: each(|i| start[i] - slack.0[i]),
            after: each(|i| start[i] + slack.0[i]),
        }
    }
}

/// Tests the boxes of a node that the ray enters at `entry`, against hits up to `limit`.
#[inline(always)]
pub(crate) fn test_boxes<S: Simd>(
    s: S,
    boxes: &ChildBoxes,
    ray: &PreparedRay,
    slack: &Slack,
    entry: f32,
    limit: f32,
) -> BoxHits {
    let grid = RayGrid::new(boxes, ray, slack);
    let mut tnear = s.splat(entry);
    let mut tfar = s.splat(ray.tfar);
    for axis in 0..3 {
        let (lo, hi) = (&boxes.lo[axis], &boxes.hi[axis]);
        let (near, far) = if ray.forward[axis] { (lo, hi) } else { (hi, lo) };
        let step = s.splat(grid.step[axis]);
        let (before, after) = (s.splat(grid.before[axis]), s.splat(grid.after[axis]));
        // The new distance comes first: one that is NaN is passed over.
        tnear = s.max(s.add(s.mul(s.convert(near), step), before), tnear);
        tfar = s.min(s.add(s.mul(s.convert(far), step), after), tfar);
    }
    let mask = s.le(tnear, s.min(tfar, s.splat(limit)));
    BoxHits { tnear: s.store(tnear), tfar: s.store(tfar), mask }
}

/// One value a component: unlike `<[T; 3]>::map`, always inlined.
#[inline(always)]
pub(crate) fn each<T>(f: impl Fn(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
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
