//! Points on triangles that know their own error, and rays that start safely off them.
//!
//! A ray that starts exactly at a hit point may find the surface it leaves again. Starting it a fixed distance
//! away fails for scenes of other sizes, so the distance follows from rounding errors, as in Wächter and Binder,
//! "A Fast and Robust Method for Avoiding Self-Intersection" (Ray Tracing Gems, 2019) and section 6.8 of
//! "Physically Based Rendering". Unlike both, the point is computed from barycentrics in f64, which puts it in
//! the plane of the triangle up to its own rounding to f32; what is left is
//!
//! - the rounding of the point: relative to its coordinates, and
//! - the rounding of the next intersection test, which computes in edges from the ray's origin to the corners:
//!   relative to their length. Measured along the normal it does not grow for grazing rays.

use glam::Vec3;
use raystrips_geom::{Ray, Segment};

/// Bound of both errors, in half ulps of the numbers they are relative to. One is the rounding of the point and
/// one that of the ray's origin; the rest is for the tracer. The test below finds no ray in three million
/// (`PROPTEST_CASES=3000000`) that meets its own triangle.
const RELATIVE_ERROR: f64 = 8.0 / (1u32 << 24) as f64;

/// In slivers the error of the barycentrics shows too: it grows with the inverse of the sine of their angle, up
/// to this much here, so that the offset stays about 10^-5 of the edges at most.
const MAX_SLIVER: f64 = 16.0;

/// Rounding of the share of a segment, which moves the ball that touches its surface and so changes its radius.
const SHARE_ERROR: f64 = 1.0 / (1u32 << 23) as f64;

/// Shadow rays end this share of their length before the light, so as not to be blocked by it.
const SHADOW_MARGIN: f32 = 1e-4;

/// A point on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfacePoint {
    pub p: Vec3,
    /// Unit normal of the triangle, towards its front.
    pub ng: Vec3,
    /// Distance from the plane beyond which a ray that leaves does not meet the triangle again.
    pub error: f32,
}

impl SurfacePoint {
    /// The point `(1 - u - v) p0 + u p1 + v p2`. `None` where the triangle has no area or is not finite.
    pub fn on_triangle(corners: &[Vec3; 3], u: f32, v: f32) -> Option<SurfacePoint> {
        let [p0, p1, p2] = corners.map(|corner| corner.as_dvec3());
        let (u, v) = (f64::from(u), f64::from(v));
        let (e1, e2) = (p1 - p0, p2 - p0);
        let cross = e1.cross(e2);
        let ng = cross.try_normalize()?;
        let p = p0 + e1 * u + e2 * v;
        let rounding = ng.abs().dot(p.abs());
        let sliver = (e1.length_squared() * e2.length_squared() / cross.length_squared()).sqrt();
        let edges = e1.abs().max(e2.abs()).element_sum() * sliver.min(MAX_SLIVER);
        let error = RELATIVE_ERROR * (rounding + edges);
        Some(SurfacePoint { p: p.as_vec3(), ng: ng.as_vec3(), error: error as f32 })
    }

    /// The point at distance `t` of `ray`, which enters the segment there, at this share of its length. `None` where the
    /// segment is not finite.
    ///
    /// Computed from the ball that touches the segment's surface there, which is exact up to its own rounding however far the
    /// ray came.
    pub fn on_segment(segment: &Segment, share: f32, ray: &Ray, t: f32) -> Option<SurfacePoint> {
        let [a, b] = segment.ends.map(|end| end.as_dvec3());
        let [ra, rb] = segment.radii.map(f64::from);
        let share = f64::from(share);
        let (center, radius) = (a + (b - a) * share, ra + (rb - ra) * share);
        let met = ray.org.as_dvec3() + ray.dir.as_dvec3() * f64::from(t);
        // Where the ray hardly touches, rounding may turn this away from the ray.
        let ng = (met - center).try_normalize()?;
        let p = center + ng * radius;
        let rounding = ng.abs().dot(p.abs()) + radius + (b - a).abs().element_sum();
        let error = RELATIVE_ERROR * rounding + SHARE_ERROR * (rb - ra).abs();
        Some(SurfacePoint { p: p.as_vec3(), ng: ng.as_vec3(), error: error as f32 })
    }

    /// Origin for rays that leave to the side of `n`, which is `ng` or its opposite.
    pub fn origin(&self, n: Vec3) -> Vec3 {
        self.p + n * self.error
    }

    /// The half line along `dir`, which points to the side of `n`.
    pub fn spawn(&self, n: Vec3, dir: Vec3) -> Ray {
        Ray::new(self.origin(n), dir)
    }
}

/// The segment between two points that decides whether they see each other.
pub(crate) fn shadow_ray(from: Vec3, to: Vec3) -> Ray {
    Ray { org: from, tnear: 0.0, dir: to - from, tfar: 1.0 - SHADOW_MARGIN }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{cosine_hemisphere, uniform_triangle};
    use proptest::prelude::*;

    /// Moeller-Trumbore in f32: the distance of the plane along the ray, as a plain tracer computes it.
    fn intersect_f32([p0, p1, p2]: [Vec3; 3], ray: &Ray) -> Option<f32> {
        let (e1, e2, s) = (p1 - p0, p2 - p0, ray.org - p0);
        let (q, r) = (s.cross(e1), ray.dir.cross(e2));
        let inv_det = 1.0 / e1.dot(r);
        let (u, v, t) = (s.dot(r) * inv_det, ray.dir.dot(q) * inv_det, e2.dot(q) * inv_det);
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
    }

    fn unit_cube() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1f32..1.0).prop_map(Vec3::from_array)
    }

    proptest! {
        #[test]
        fn rays_leave_their_triangle(
            shape in prop::array::uniform3(unit_cube()),
            place in unit_cube(),
            log_size in -3f32..6.0,
            log_distance in -2f32..3.0,
            on in prop::array::uniform2(0f32..1.0),
            towards in prop::array::uniform2(0f32..1.0),
            front: bool,
        ) {
            let size = 10f32.powf(log_size);
            let center = place * size * 10f32.powf(log_distance);
            let corners = shape.map(|corner| center + corner * size);
            let [u, v] = uniform_triangle(on);
            let Some(point) = SurfacePoint::on_triangle(&corners, u, v) else { return Ok(()) };
            let n = if front { point.ng } else { -point.ng };
            let (dir, cosine) = cosine_hemisphere(n, towards);
            prop_assume!(cosine > 1e-3);

            let ray = point.spawn(n, dir);
            prop_assert_eq!(intersect_f32(corners, &ray), None);
            let height = (ray.org.as_dvec3() - corners[0].as_dvec3()).dot(n.as_dvec3());
            prop_assert!(height > 0.0);
            let scale = f64::from(center.length() + 6.0 * size);
            prop_assert!(ray.org.as_dvec3().distance(point.p.as_dvec3()) < 1e-5 * scale);
        }
    }

    #[test]
    fn degenerate_triangles_have_no_points() {
        assert_eq!(SurfacePoint::on_triangle(&[Vec3::ONE; 3], 0.2, 0.2), None);
        assert_eq!(SurfacePoint::on_triangle(&[Vec3::NAN; 3], 0.2, 0.2), None);
    }
}
