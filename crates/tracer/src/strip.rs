//! A ray down the tree along a strip (Lauterbach et al. 2007, algorithm 1).
//!
//! Corrected: a range is cut at the planes for the near and for the far part alike; a part on the stack that
//! lies behind the best hit is left; rays almost along a split plane are covered by the slack of the planes.

use crate::boxes::RayGrid;
use crate::prepared::PreparedRay;
use crate::simd::{LANES, Simd};
use crate::window::{Candidates, WindowHit};
use raystrips_pack::strip_record::SPLIT_PLANE_STEP;
use raystrips_pack::{ClusterView, StripView, WindowHead};

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

/// Takes the triangles of a strip that were hit.
pub(crate) trait StripHits {
    /// Up to where hits still matter.
    fn limit(&self) -> f32;
    /// A triangle of window number `window` was hit. With `reversed`, the windows before flip the winding of this one.
    fn hit(&mut self, head: WindowHead, reversed: bool, window: usize, hit: WindowHit);
}

/// Tests a strip of several windows against the ray and tells `found` of every triangle that it meets. `grid` is that
/// of the page.
#[inline(always)]
pub(crate) fn test_long_strip<S: Simd>(
    s: S,
    ray: &PreparedRay,
    grid: &RayGrid,
    cluster: &ClusterView,
    strip: &StripView,
    found: &mut impl StripHits,
) {
    let mut stack = [Part::default(); STACK];
    stack[0] = Part { node: 0, first: 0, count: strip.window_count(), tnear: ray.tnear, tfar: found.limit() };
    let mut waiting = 1;
    while waiting > 0 {
        waiting -= 1;
        let part = stack[waiting];
        if part.tnear > part.tfar || part.tnear > found.limit() {
            continue;
        }
        if part.count == 1 {
            let (head, refs) = strip.window(part.first);
            let flips = strip.is_reversed_before(part.first);
            let mut candidates = Candidates::NONE;
            candidates.find(s, ray, head, &eight(refs, head.count()), cluster);
            candidates.meet(s, ray, |hit| found.hit(head, flips, part.first, hit));
        } else {
            let (near, far) = split(ray, grid, strip, &part);
            stack[waiting] = far;
            stack[waiting + 1] = near;
            waiting += 2;
        }
    }
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
    let along = |plane: u16| f32::from(plane) * f32::from(SPLIT_PLANE_STEP) * grid.step[axis];
    let (near, far, exit, entry) = if ray.inv_dir[axis] >= 0.0 {
        (lower, upper, along(split.lower_max) + grid.hi[axis], along(split.upper_min) + grid.lo[axis])
    } else {
        (upper, lower, along(split.upper_min) + grid.lo[axis], along(split.lower_max) + grid.hi[axis])
    };
    // Not f32::min and max: a distance that is NaN is passed over.
    let tfar = if exit < part.tfar { exit } else { part.tfar };
    let tnear = if entry > part.tnear { entry } else { part.tnear };
    (Part { tfar, ..near }, Part { tnear, ..far })
}

/// The vertices of a window of `count` triangles; the last one stands for those that a short window lacks.
fn eight(refs: &[u8], count: usize) -> [u8; LANES] {
    std::array::from_fn(|k| refs[k.min(count + 1)])
}
