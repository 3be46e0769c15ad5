//! A ray against one window of a strip: up to six triangles over eight vertices.
//!
//! Whether a triangle is met is decided as by Woop, Benthin and Wald (JCGT 2013), with edge functions shared
//! along the strip: for *n* triangles 2 *n* + 1 of them instead of 3 *n*. Vertices are sheared so that the ray is
//! the z axis, and `edge(a, b) = a.x b.y - a.y b.x` tells on which side of it the edge passes.
//!
//! Why no ray slips through: the difference of two rounded products may be rounded to zero but never gets the
//! wrong sign, and `edge(b, a)` is exactly `-edge(a, b)`; where one is zero, all three of the triangle are
//! computed again in f64, in which products of f32 are exact. So each edge has one sign for all triangles
//! that share it, and at a vertex all triangles see the same rounded point. There must be no fused
//! multiply-add in an edge function: it would break the antisymmetry.
//!
//! Where it is met is computed in f64 from the vertices as they are, for the few triangles that are. In f32 the
//! distance of a triangle seen from its side would be off by many times the rounding of its vertices.

use crate::boxes::each;
use crate::prepared::PreparedRay;
use crate::simd::{LANES, Simd, Words};
use raystrips_geom::strip::WINDOW_TRIANGLES;

/// A triangle of a window that the ray meets.
pub(crate) struct WindowHit {
    pub triangle: usize,
    pub t: f32,
    /// Weights of the second and third corner, corners taken as pivot, k + 1, k + 2.
    pub u: f32,
    pub v: f32,
}

/// Calls `found` for every triangle of the window that the ray meets with `tnear <= t <= tfar`, `t` finite. The
/// window has `count` triangles, turn bits and vertices; see [`Simd::gather`] for `points`.
#[inline(always)]
pub(crate) fn test_window<S: Simd>(
    s: S,
    ray: &PreparedRay,
    points: &[f32],
    (count, turns, refs): (usize, u8, &[u8]),
    mut found: impl FnMut(WindowHit),
) {
    let [x, y, z] = s.gather(points, &eight(refs), &ray.order);
    let z = s.sub(z, s.splat(ray.org_z));
    let x = s.sub(s.sub(x, s.splat(ray.org_x)), s.mul(s.splat(ray.shear_x), z));
    let y = s.sub(s.sub(y, s.splat(ray.org_y)), s.mul(s.splat(ray.shear_y), z));

    let turns = &TURNS[usize::from(turns >> 1) & 31];
    let at = |v: S::F, lanes: &Words| s.permute(v, lanes);
    let edge = |ax: S::F, ay: S::F, bx: S::F, by: S::F| s.sub(s.mul(ax, by), s.mul(ay, bx));
    // Edges from vertex k to k + 1; from k + 2 to the pivot; from the pivot to k + 1.
    let along = edge(x, y, at(x, &NEXT), at(y, &NEXT));
    let (pivot_x, pivot_y) = (at(x, &turns.pivot), at(y, &turns.pivot));
    let closing = edge(at(x, &SECOND_NEXT), at(y, &SECOND_NEXT), pivot_x, pivot_y);
    let opening = s.select(&turns.mask, s.neg(at(closing, &PREVIOUS)), along);

    // The weight of a corner is the edge function of the other two.
    let (a, b, c) = (at(along, &NEXT), closing, opening);
    let zero = s.splat(0.0);
    let least = s.min(s.min(a, b), c);
    let greatest = s.max(s.max(a, b), c);
    let mut inside = (s.le(zero, least) | s.le(greatest, zero)) & ((1 << count) - 1);
    if inside == 0 {
        return;
    }
    let on_edge = inside & (s.eq(a, zero) | s.eq(b, zero) | s.eq(c, zero));
    if on_edge != 0 {
        let (x, y) = (s.store(x), s.store(y));
        for k in lanes_of(on_edge) {
            let corners = [turns.pivot.0[k] as usize, k + 1, k + 2];
            inside &= !(u32::from(passes_outside(corners.map(|i| x[i]), corners.map(|i| y[i]))) << k);
        }
    }
    for k in lanes_of(inside) {
        let corner = |i: usize| {
            let first = 1 + 3 * usize::from(refs[i]);
            [points[first], points[first + 1], points[first + 2]]
        };
        let corners = [corner(turns.pivot.0[k] as usize), corner(k + 1), corner(k + 2)];
        if let Some((t, u, v)) = meet(ray, corners) {
            found(WindowHit { triangle: k, t, u, v });
        }
    }
}

/// The places of the bits that are set.
#[inline(always)]
fn lanes_of(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (lane < 32).then_some(lane)
    })
}

/// The vertices of a window; the last one stands for those that a short window lacks.
#[inline(always)]
fn eight(refs: &[u8]) -> [u8; LANES] {
    match refs.first_chunk() {
        Some(full) => *full,
        None => std::array::from_fn(|k| refs[k.min(refs.len() - 1)]),
    }
}

/// Whether the ray passes outside of a sheared triangle, one of whose edge functions is zero in f32.
#[cold]
#[inline(never)]
fn passes_outside(x: [f32; 3], y: [f32; 3]) -> bool {
    let edge = |a: usize, b: usize| f64::from(x[a]) * f64::from(y[b]) - f64::from(y[a]) * f64::from(x[b]);
    let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];
    edges.iter().any(|&e| e < 0.0) && edges.iter().any(|&e| e > 0.0)
}

/// Distance and weights of the second and third corner where the ray meets a triangle that it does not pass
/// outside of. `None` for a triangle seen exactly from its side, and where the ray ends before or begins after.
#[inline(always)]
fn meet(ray: &PreparedRay, corners: [[f32; 3]; 3]) -> Option<(f32, f32, f32)> {
    let [kx, ky, kz] = each(|i| ray.order[1 + i] as usize - 1);
    let z = each(|i| f64::from(corners[i][kz]) - f64::from(ray.org_z));
    let along =
        |k: usize, org: f32, shear: f64| each(|i| f64::from(corners[i][k]) - f64::from(org) - shear * z[i]);
    let x = along(kx, ray.org_x, ray.exact_shear_x);
    let y = along(ky, ray.org_y, ray.exact_shear_y);
    let edge = |a: usize, b: usize| x[a] * y[b] - y[a] * x[b];
    let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];
    let sum: f64 = edges[0] + edges[1] + edges[2];
    if sum == 0.0 {
        return None;
    }
    let inverse = 1.0 / sum;
    let mut weights = each(|i| edges[i] * inverse);
    if weights[0] < 0.0 || weights[1] < 0.0 || weights[2] < 0.0 {
        weights = nearest_on_border(&x, &y);
    }
    let depth = weights[0] * z[0] + weights[1] * z[1] + weights[2] * z[2];
    let t = (depth * ray.exact_inverse_z) as f32;
    let on_segment = ray.tnear <= t && t <= ray.tfar && t < f32::INFINITY;
    on_segment.then_some((t, weights[1] as f32, weights[2] as f32))
}

/// Weights of the point on the border of a sheared triangle that is nearest to the ray. The ray passes outside by
/// less than the rounding of f32, so this is where it meets the triangle; negative weights would be that of a
/// point far away if the triangle is seen almost from its side.
#[cold]
#[inline(never)]
fn nearest_on_border(x: &[f64; 3], y: &[f64; 3]) -> [f64; 3] {
    let mut nearest = (f64::INFINITY, [1.0, 0.0, 0.0]);
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (dx, dy) = (x[j] - x[i], y[j] - y[i]);
        let length_squared = dx * dx + dy * dy;
        let share = -(x[i] * dx + y[i] * dy) / length_squared;
        let share = if length_squared > 0.0 { share.clamp(0.0, 1.0) } else { 0.0 };
        let (px, py) = (x[i] + share * dx, y[i] + share * dy);
        let distance_squared = px * px + py * py;
        if distance_squared < nearest.0 {
            let mut weights = [0.0; 3];
            weights[i] = 1.0 - share;
            weights[j] = share;
            nearest = (distance_squared, weights);
        }
    }
    nearest.1
}

/// Lane *k* takes from lane *k* + 1.
const NEXT: Words = Words([1, 2, 3, 4, 5, 6, 7, 7]);
/// Lane *k* takes from lane *k* + 2.
const SECOND_NEXT: Words = Words([2, 3, 4, 5, 6, 7, 7, 7]);
/// Lane *k* takes from lane *k* - 1.
const PREVIOUS: Words = Words([0, 0, 1, 2, 3, 4, 5, 6]);

/// What turn bits mean for lanes.
#[derive(Clone, Copy)]
struct Turns {
    /// Vertex that is the pivot of each triangle.
    pivot: Words,
    /// Triangles with a turn.
    mask: Words,
}

/// For each pattern of turn bits 1 to 5.
static TURNS: [Turns; 32] = {
    let mut table = [Turns { pivot: Words([0; LANES]), mask: Words([0; LANES]) }; 32];
    let mut bits = 0;
    while bits < 32 {
        let mut k = 1;
        while k < WINDOW_TRIANGLES {
            let turn = bits >> (k - 1) & 1 == 1;
            table[bits].pivot.0[k] = if turn { table[bits].pivot.0[k - 1] } else { k as i32 };
            table[bits].mask.0[k] = -(turn as i32);
            k += 1;
        }
        bits += 1;
    }
    table
};
