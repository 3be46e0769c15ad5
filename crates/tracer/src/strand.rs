//! A ray against segments of a strand: round cones, each the hull of two balls.
//!
//! First all segments of a window at once are tested for how near the ray passes, with a slack that is greater than all
//! roundings. Those that are left are met in f64. Only where a ray enters a segment is a hit: a ray that starts inside
//! of a strand leaves it without one. Segments that follow each other share a ball, and what is computed of a ball depends
//! on nothing else of the segment, so no ray slips through between them.

use crate::prepared::PreparedRay;
use crate::simd::{LANES, Simd};
use crate::window::NEXT;
use glam::DVec3;
use raystrips_geom::Segment;

/// A ball whose center a ray passes at a distance d is at most this times d away in the plane at right angles to the
/// main axis of the ray.
const PLANE_RATIO: f32 = 1.733;
/// Slack for what is rounded, as a share of the coordinates.
const SLACK: f32 = 1.0 / (1 << 20) as f32;

/// Bit *k*: the ray, being the z axis of the sheared points, may meet the segment from point *k* to the next.
#[inline(always)]
pub(crate) fn near_segments<S: Simd>(s: S, [x, y, z]: [S::F; 3], radii: &[f32; LANES]) -> u32 {
    let next = |v: S::F| s.permute(v, &NEXT);
    let radii = s.load(radii);
    let size = s.max(s.max(s.abs(x), s.abs(y)), s.abs(z));
    let reach = s.add(s.mul(radii, s.splat(PLANE_RATIO)), s.mul(size, s.splat(SLACK)));
    let reach = s.max(reach, next(reach));
    let (x1, y1) = (next(x), next(y));
    let (dx, dy) = (s.sub(x1, x), s.sub(y1, y));
    let cross = s.sub(s.mul(x, dy), s.mul(y, dx));
    let length_squared = s.add(s.mul(dx, dx), s.mul(dy, dy));
    // Near the line through both points: |cross| / length is the distance.
    let wide = s.mul(reach, s.splat(1.0 + 2.0 * SLACK));
    let is_beside = s.le(s.mul(cross, cross), s.mul(wide, s.mul(wide, length_squared)))
        | s.le(length_squared, s.mul(wide, wide));
    // And in the box around both.
    let zero = s.splat(0.0);
    let overlaps =
        |a: S::F, b: S::F| s.le(s.sub(s.min(a, b), wide), zero) & s.le(zero, s.add(s.max(a, b), wide));
    is_beside & overlaps(x, x1) & overlaps(y, y1)
}

/// Where the ray enters a segment, if that is with `tnear <= t <= tfar`, and what share of the segment lies before that.
///
/// The hull of two balls is a cone between two circles and what of the balls lies beyond those. The ray enters where it
/// first meets any of these, all of which lie in the hull.
pub(crate) fn meet(ray: &PreparedRay, segment: &Segment) -> Option<(f32, f32)> {
    let along = ray.direction();
    let org = DVec3::new(f64::from(ray.org[0]), f64::from(ray.org[1]), f64::from(ray.org[2]));
    let [a, b] = segment.ends.map(|end| end.as_dvec3() - org);
    let [ra, rb] = segment.radii.map(f64::from);
    let mut first: Option<(f64, f64)> = None;
    let mut add = |t: f64, share: f64| {
        if first.is_none_or(|(least, _)| t < least) {
            first = Some((t, share));
        }
    };
    for (center, radius, share) in [(a, ra, 0.0), (b, rb, 1.0)] {
        if let Some(t) = enter_ball(along, center, radius) {
            add(t, share);
        }
    }
    meet_cone(along, (a, ra), (b, rb), &mut add);
    let (t, share) = first?;
    let t = t as f32;
    let on_segment = ray.tnear <= t && t <= ray.tfar && t < f32::INFINITY;
    on_segment.then_some((t, share as f32))
}

/// Where a ray from zero along `along` enters a ball.
fn enter_ball(along: DVec3, center: DVec3, radius: f64) -> Option<f64> {
    let inverse = 1.0 / along.length_squared();
    let middle = center.dot(along) * inverse;
    // From the point nearest to the center: what is subtracted is small, so little is lost.
    let left = radius * radius - (center - along * middle).length_squared();
    (left >= 0.0).then(|| middle - (left * inverse).sqrt())
}

/// Where a ray from zero along `along` meets the cone that touches both balls, between the circles where it does.
fn meet_cone(along: DVec3, (a, ra): (DVec3, f64), (b, rb): (DVec3, f64), add: &mut impl FnMut(f64, f64)) {
    let axis = b - a;
    let growth = rb - ra;
    // Squared length of the cone's side between the circles; none if one ball holds the other.
    let axis_squared = axis.length_squared();
    let side_squared = axis_squared - growth * growth;
    if side_squared <= 0.0 {
        return;
    }
    // Begin near the segment, so that squares of great distances do not cancel.
    let start = (a + b).dot(along) * 0.5 / along.length_squared();
    let from_a = along * start - a;
    // A point p is on the cone where |p - c|² = r² for the ball (c, r) that touches the cone there, at share s of the axis:
    // side² |p - a|² - (axis·(p - a))² - 2 ra growth axis·(p - a) - ra² axis² = 0.
    let (axis_along, axis_from) = (axis.dot(along), axis.dot(from_a));
    let quadratic = side_squared * along.length_squared() - axis_along * axis_along;
    let linear = side_squared * from_a.dot(along) - axis_from * axis_along - ra * growth * axis_along;
    let constant = side_squared * from_a.length_squared()
        - axis_from * axis_from
        - 2.0 * ra * growth * axis_from
        - ra * ra * axis_squared;
    let discriminant = linear * linear - quadratic * constant;
    if discriminant < 0.0 {
        return;
    }
    let root = discriminant.sqrt();
    // Both roots without cancellation (Numerical Recipes, 5.6).
    let q = -(linear + root.copysign(linear));
    for t in [q / quadratic, constant / q] {
        // Share of the axis at which the ball touches the cone there; it is on this half of the double cone.
        let share = (axis_from + t * axis_along + ra * growth) / side_squared;
        if (0.0..=1.0).contains(&share) {
            add(start + t, share);
        }
    }
}
