//! The ray-triangle test of Möller and Trumbore (1997), for one of each and for four lanes: four rays and a triangle,
//! or a ray and four triangles.
//!
//! A triangle seen from its side has infinite or undefined weights and is missed.

use super::ray::PreparedRay;
use glam::{BVec4A, Vec3, Vec4};
use raystrips_geom::Hit;

/// Replaces `best` where `ray` meets the triangle with corner `a` and edges from there nearer.
#[inline]
pub fn test(a: Vec3, [e1, e2]: [Vec3; 2], prim_id: u64, ray: &PreparedRay, best: &mut Hit) {
    let s = ray.org - a;
    let p = ray.dir.cross(e2);
    let inv_det = 1.0 / e1.dot(p);
    let u = s.dot(p) * inv_det;
    if !(0.0..=1.0).contains(&u) {
        return;
    }
    let q = s.cross(e1);
    let v = ray.dir.dot(q) * inv_det;
    let t = e2.dot(q) * inv_det;
    if v >= 0.0 && u + v <= 1.0 && t >= ray.tnear && t < best.t {
        *best = Hit { t, u, v, prim_id, ..Hit::MISS };
    }
}

/// Four vectors by axis.
pub type Lanes = [Vec4; 3];

/// Where four lanes meet.
pub struct Met {
    /// True in lanes that meet.
    pub inside: BVec4A,
    /// Distances.
    pub t: Vec4,
    /// Weights of the second corners.
    pub u: Vec4,
    /// Weights of the third corners.
    pub v: Vec4,
}

/// Where rays and triangles of the same lane meet, at any distance.
#[inline]
pub fn test_lanes(org: &Lanes, dir: &Lanes, a: &Lanes, [e1, e2]: &[Lanes; 2]) -> Met {
    let s = [org[0] - a[0], org[1] - a[1], org[2] - a[2]];
    let p = cross(dir, e2);
    let q = cross(&s, e1);
    let inv_det = Vec4::ONE / dot(e1, &p);
    let (u, v, t) = (dot(&s, &p) * inv_det, dot(dir, &q) * inv_det, dot(e2, &q) * inv_det);
    Met { inside: u.cmpge(Vec4::ZERO) & v.cmpge(Vec4::ZERO) & (u + v).cmple(Vec4::ONE), t, u, v }
}

/// The same vector in all lanes.
#[inline]
pub fn splat(v: Vec3) -> Lanes {
    [Vec4::splat(v.x), Vec4::splat(v.y), Vec4::splat(v.z)]
}

#[inline]
fn dot(a: &Lanes, b: &Lanes) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: &Lanes, b: &Lanes) -> Lanes {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
