//! Rays and hits, with the words of Embree: `org`, `dir`, `tnear`, `tfar`.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A ray segment: the points `org + t * dir` with `tnear <= t <= tfar`. `dir` need not be of unit length.
///
/// In memory it is what a ray file holds: eight f32 in this order.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Ray {
    /// Origin.
    pub org: Vec3,
    /// Least distance of a hit, in multiples of `dir`.
    pub tnear: f32,
    /// Direction.
    pub dir: Vec3,
    /// Greatest distance of a hit.
    pub tfar: f32,
}

impl Ray {
    /// The half line from `org` along `dir`.
    pub fn new(org: Vec3, dir: Vec3) -> Ray {
        Ray { org, tnear: 0.0, dir, tfar: f32::INFINITY }
    }

    /// The point at distance `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.org + self.dir * t
    }

    /// True where a tracer can answer: no NaN, a direction, a finite origin.
    pub fn is_valid(&self) -> bool {
        self.org.is_finite()
            && self.dir.is_finite()
            && self.dir != Vec3::ZERO
            && !self.tnear.is_nan()
            && !self.tfar.is_nan()
    }
}

/// The nearest intersection of a ray. The point is `(1 - u - v) p0 + u p1 + v p2` of the triangle's corners.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Hit {
    /// Distance in multiples of the ray's `dir`; infinity where nothing was hit.
    pub t: f32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
    /// Which instance, or [`Hit::NO_INSTANCE`]: a number of the pack.
    pub instance: u32,
    /// Which triangle: an opaque number of the tracer, ascending with the triangle's place in the pack.
    pub prim_id: u64,
}

impl Hit {
    /// What was hit stands where it is in the pack.
    pub const NO_INSTANCE: u32 = u32::MAX;
    /// Nothing was hit.
    pub const MISS: Hit =
        Hit { t: f32::INFINITY, u: 0.0, v: 0.0, instance: Hit::NO_INSTANCE, prim_id: u64::MAX };

    /// True where something was hit.
    pub fn is_hit(&self) -> bool {
        self.prim_id != u64::MAX
    }
}
