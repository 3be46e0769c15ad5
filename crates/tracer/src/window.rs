//! A ray against one window of a strip: up to six triangles over eight vertices.
//!
//! The watertight test of Woop, Benthin and Wald (JCGT 2013), with edge functions shared along the strip: for
//! *n* triangles 2 *n* + 1 of them instead of 3 *n*. Vertices are sheared so that the ray is the z axis, and
//! `edge(a, b) = a.x b.y - a.y b.x` tells on which side of it the edge passes.
//!
//! Why no ray slips through: the difference of two rounded products may be rounded to zero but never gets the
//! wrong sign, and `edge(b, a)` is exactly `-edge(a, b)`; where one is zero, all three of the triangle are
//! computed again in f64, in which products of f32 are exact. So each edge has one sign for all triangles
//! that share it, and at a vertex all triangles see the same rounded point. There must be no fused
//! multiply-add in an edge function: it would break the antisymmetry.

use crate::prepared::PreparedRay;
use glam::Vec3;
use raystrips_geom::strip::{WINDOW_TRIANGLES, WINDOW_VERTICES};

/// Lanes of a window's arrays.
const LANES: usize = WINDOW_VERTICES;

/// A triangle of a window that the ray meets.
pub(crate) struct WindowHit {
    pub triangle: usize,
    pub t: f32,
    /// Weights of the second and third corner, corners wound as in `[pivot, k + 1, k + 2]`.
    pub u: f32,
    pub v: f32,
}

/// Calls `found` for every triangle of the window that the ray meets, `tnear <= t <= tfar`, `t` finite.
#[inline(always)]
pub(crate) fn test_window(
    ray: &PreparedRay,
    vertices: &[Vec3],
    (count, turns, refs): (usize, u8, &[u8]),
    mut found: impl FnMut(WindowHit),
) {
    let (x, y, z) = shear(ray, vertices, refs);
    // Consecutive edges: along[k] = edge(v[k], v[k + 1]); the last lane is never used.
    let mut along = [0.0; LANES];
    for k in 0..LANES - 1 {
        along[k] = x[k] * y[k + 1] - y[k] * x[k + 1];
    }
    let pivots = PIVOTS[usize::from(turns >> 1) & 31];
    // Closing edges: closing[k] = edge(v[k + 2], pivot).
    let mut closing = [0.0; LANES];
    for k in 0..WINDOW_TRIANGLES {
        let p = usize::from(pivots[k]);
        closing[k] = x[k + 2] * y[p] - y[k + 2] * x[p];
    }
    let mut inside = 0u32;
    let mut opening = [0.0; LANES];
    for k in 0..WINDOW_TRIANGLES {
        // The edge into the triangle: from its pivot to v[k + 1].
        opening[k] = if turns >> k & 1 == 0 { along[k] } else { -closing[k.saturating_sub(1)] };
        let (a, b, c) = (along[k + 1], closing[k], opening[k]);
        let negative = (a < 0.0) | (b < 0.0) | (c < 0.0);
        let positive = (a > 0.0) | (b > 0.0) | (c > 0.0);
        inside |= u32::from(!(negative & positive)) << k;
    }
    inside &= (1 << count) - 1;
    while inside != 0 {
        let k = inside.trailing_zeros() as usize;
        inside &= inside - 1;
        let p = usize::from(pivots[k]);
        let mut weights = [along[k + 1], closing[k], opening[k]];
        if weights.contains(&0.0) {
            weights = exact_weights([x[p], x[k + 1], x[k + 2]], [y[p], y[k + 1], y[k + 2]]);
        }
        if let Some((t, u, v)) = distance(ray, weights, [z[p], z[k + 1], z[k + 2]]) {
            found(WindowHit { triangle: k, t, u, v });
        }
    }
}

/// The vertices of a window, relative to the ray; the last one stands for those that a short window lacks.
#[inline(always)]
fn shear(ray: &PreparedRay, vertices: &[Vec3], refs: &[u8]) -> ([f32; LANES], [f32; LANES], [f32; LANES]) {
    let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let last = refs.len() - 1;
    for k in 0..LANES {
        let vertex = vertices[usize::from(refs[k.min(last)])];
        x[k] = vertex[ray.kx] - ray.org[ray.kx];
        y[k] = vertex[ray.ky] - ray.org[ray.ky];
        z[k] = vertex[ray.kz] - ray.org[ray.kz];
    }
    for k in 0..LANES {
        x[k] -= ray.shear_x * z[k];
        y[k] -= ray.shear_y * z[k];
    }
    (x, y, z)
}

/// Distance and weights of a triangle whose edge functions do not differ in sign. Weights are those of the
/// pivot, the second and the third corner, not normalized.
#[inline(always)]
fn distance(ray: &PreparedRay, weights: [f32; 3], z: [f32; 3]) -> Option<(f32, f32, f32)> {
    let [a, b, c] = weights;
    let negative = (a < 0.0) | (b < 0.0) | (c < 0.0);
    let positive = (a > 0.0) | (b > 0.0) | (c > 0.0);
    let sum = a + b + c;
    if (negative & positive) | (sum == 0.0) {
        return None;
    }
    let inverse = 1.0 / sum;
    let t = (a * z[0] + b * z[1] + c * z[2]) * inverse * ray.scale_z;
    (t >= ray.tnear && t <= ray.tfar && t < f32::INFINITY).then_some((t, b * inverse, c * inverse))
}

/// The edge functions of a triangle without rounding error in their signs.
#[cold]
#[inline(never)]
fn exact_weights(x: [f32; 3], y: [f32; 3]) -> [f32; 3] {
    let edge = |a: usize, b: usize| {
        let exact = f64::from(x[a]) * f64::from(y[b]) - f64::from(y[a]) * f64::from(x[b]);
        let rounded = exact as f32;
        // Too small for f32, but with a sign.
        if rounded == 0.0 && exact != 0.0 { f32::MIN_POSITIVE.copysign(exact as f32) } else { rounded }
    };
    [edge(1, 2), edge(2, 0), edge(0, 1)]
}

/// For each pattern of turn bits 1 to 5: the pivot of each triangle, as a place in the window.
const PIVOTS: [[u8; WINDOW_TRIANGLES]; 32] = {
    let mut table = [[0; WINDOW_TRIANGLES]; 32];
    let mut bits = 0;
    while bits < 32 {
        let mut k = 1;
        while k < WINDOW_TRIANGLES {
            table[bits][k] = if bits >> (k - 1) & 1 == 0 { k as u8 } else { table[bits][k - 1] };
            k += 1;
        }
        bits += 1;
    }
    table
};
