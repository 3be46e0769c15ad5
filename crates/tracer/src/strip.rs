//! A ray down the tree along a strip (Lauterbach et al. 2007, algorithm 1).
//!
//! Corrected: a range is cut at the planes for the near and for the far part alike; a part on the stack that
//! lies behind the best hit is left; rays almost along a split plane are covered by the slack of the planes.

use crate::boxes::{RayGrid, max, min};
use crate::prepared::PreparedRay;
use crate::simd::Simd;
use crate::window::{WindowHit, test_window};
use raystrips_geom::strip::WINDOW_TRIANGLES;
use raystrips_pack::StripView;

/// Windows of a strip still to be tested: the subtree at `node` over `count` windows from `first`.
#[derive(Clone, Copy, Default)]
struct Part {
    node: usize,
    first: usize,
    count: usize,
    tnear: f32,
    tfar: f32,
}

/// Most parts that wait: one a level of a tree over at most 43 windows, and one.
const STACK: usize = 8;

/// Tests the strip against the ray, which is inside its box from `tnear` to `tfar`, and tells `found` of every
/// triangle that it meets. `grid` is that of the node which holds the strip; a strip of one window needs none.
#[inline(always)]
pub(crate) fn test_strip<S: Simd>(
    s: S,
    ray: &PreparedRay,
    grid: impl FnOnce() -> RayGrid,
    strip: &StripView,
    points: &[f32],
    (tnear, tfar): (f32, f32),
    found: &mut impl StripHits,
) {
    if strip.window_count() == 1 {
        test_window(s, ray, points, strip.window(0), |hit| found.hit(strip, hit, tnear));
        return;
    }
    let grid = grid();
    let mut stack = [Part::default(); STACK];
    stack[0] = Part { node: 0, first: 0, count: strip.window_count(), tnear, tfar };
    let mut waiting = 1;
    while waiting > 0 {
        waiting -= 1;
        let part = stack[waiting];
        if part.tnear > part.tfar || part.tnear > found.limit() {
            continue;
        }
        if part.count == 1 {
            test_window(s, ray, points, strip.window(part.first), |mut hit| {
                hit.triangle += part.first * WINDOW_TRIANGLES;
                found.hit(strip, hit, part.tnear);
            });
        } else {
            let (near, far) = split(ray, &grid, strip, &part);
            stack[waiting] = far;
            stack[waiting + 1] = near;
            waiting += 2;
        }
    }
}

/// Takes the triangles of a strip that were hit.
pub(crate) trait StripHits {
    /// Up to where hits still matter.
    fn limit(&self) -> f32;
    /// A triangle was hit, the one at `hit.triangle` in the strip, in a window whose box is entered at `entry`.
    fn hit(&mut self, strip: &StripView, hit: WindowHit, entry: f32);
}

/// The two halves of `part`, the one that the ray meets first being first.
#[inline(always)]
fn split(ray: &PreparedRay, grid: &RayGrid, strip: &StripView, part: &Part) -> (Part, Part) {
    let split = strip.split(part.node);
    let axis = usize::from(split.axis);
    let left_count = part.count.div_ceil(2);
    let left = Part { node: part.node + 1, count: left_count, ..*part };
    let right = Part {
        node: part.node + left_count,
        first: part.first + left_count,
        count: part.count - left_count,
        ..*part
    };
    let (lower, upper) = if split.reversed { (right, left) } else { (left, right) };
    let at = |plane: u8| f32::from(plane) * grid.step[axis];
    let (near, far, near_plane, far_plane) = if ray.forward[axis] {
        (lower, upper, split.lower_max, split.upper_min)
    } else {
        (upper, lower, split.upper_min, split.lower_max)
    };
    let exit = at(near_plane) + grid.after[axis];
    let entry = at(far_plane) + grid.before[axis];
    (Part { tfar: min(exit, part.tfar), ..near }, Part { tnear: max(entry, part.tnear), ..far })
}
