//! A ray against one window of a strip: up to six triangles over eight vertices, or as many segments of a [`strand`].
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

use crate::prepared::PreparedRay;
use crate::simd::{LANES, Simd, Words};
use crate::strand;
use glam::Vec3;
use raystrips_geom::Segment;
use raystrips_geom::strip::WINDOW_TRIANGLES;
use raystrips_pack::{ClusterView, StrandView, WindowHead};

/// A triangle or segment of a window that the ray meets.
pub(crate) struct WindowHit {
    pub triangle: usize,
    pub t: f32,
    /// Weights of the second and third corner, corners taken as pivot, k + 1, k + 2. Of a segment, what share of it lies
    /// before the hit, and zero.
    pub u: f32,
    pub v: f32,
}

/// The triangles of a window that a ray may meet: what the test of all at once leaves to be looked at one by one.
#[derive(Clone, Copy)]
pub(crate) struct Candidates {
    /// Bit *k*: triangle *k*.
    pub mask: u32,
    /// Those of which an edge function is zero in f32.
    on_edge: u32,
    /// That of the window.
    pub head: WindowHead,
    /// Vertices, by axis.
    vertices: [[f32; LANES]; 4],
    /// Sheared vertices.
    x: [f32; LANES],
    y: [f32; LANES],
    /// Radii of the points of a strand.
    radii: [f32; LANES],
}

impl Candidates {
    pub const NONE: Candidates = Candidates {
        mask: 0,
        on_edge: 0,
        head: WindowHead(0),
        vertices: [[0.0; LANES]; 4],
        x: [0.0; LANES],
        y: [0.0; LANES],
        radii: [0.0; LANES],
    };

    /// Those of a window. Of fewer than eight vertices the last one is repeated. No branch depends on what is found.
    #[inline(always)]
    pub fn find<S: Simd>(
        &mut self,
        s: S,
        ray: &PreparedRay,
        head: WindowHead,
        refs: &[u8; LANES],
        cluster: &ClusterView,
    ) {
        self.decode(s, head, refs, cluster);
        self.test(s, ray);
    }

    /// Takes in the vertices of a window of triangles.
    #[inline(always)]
    pub fn decode<S: Simd>(&mut self, s: S, head: WindowHead, refs: &[u8; LANES], cluster: &ClusterView) {
        let [x, y, z] = s.decode(cluster.vertex_bytes(), cluster.vertex_code(), refs);
        (self.vertices[0], self.vertices[1], self.vertices[2]) = (s.store(x), s.store(y), s.store(z));
        self.head = head;
    }

    /// Takes in the points of a window of a strand, and their radii.
    #[inline(always)]
    pub fn decode_strand<S: Simd>(&mut self, s: S, strand: StrandView, cluster: &ClusterView) {
        let ([x, y, z], radii) = s.decode_strand(cluster, strand);
        (self.vertices[0], self.vertices[1], self.vertices[2]) = (s.store(x), s.store(y), s.store(z));
        self.radii = s.store(radii);
        self.head = strand.head();
    }

    /// Tests the window that was decoded.
    #[inline(always)]
    pub fn test<S: Simd>(&mut self, s: S, ray: &PreparedRay) {
        let along = |i: usize| {
            let vertices = s.load(&self.vertices[ray.axes[i] as usize & 3]);
            s.sub(vertices, s.splat(ray.org_sheared[i]))
        };
        let z = along(2);
        let x = s.sub(along(0), s.mul(s.splat(ray.shear[0]), z));
        let y = s.sub(along(1), s.mul(s.splat(ray.shear[1]), z));
        if self.head.is_strand() {
            self.mask = strand::near_segments(s, [x, y, z], &self.radii) & ((1 << self.head.segments()) - 1);
            return;
        }
        (self.x, self.y) = (s.store(x), s.store(y));

        let turns = turns_of(self.head);
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
        self.mask = (s.le(zero, least) | s.le(greatest, zero)) & ((1 << self.head.count()) - 1);
        self.on_edge = self.mask & (s.eq(a, zero) | s.eq(b, zero) | s.eq(c, zero));
    }

    /// Calls `found` for every triangle or segment that the ray meets with `tnear <= t <= tfar`, `t` finite.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, s: S, ray: &PreparedRay, mut found: impl FnMut(WindowHit)) {
        if self.head.is_strand() {
            return lanes_of(self.mask).for_each(|k| {
                if let Some((t, u)) = strand::meet(ray, &self.segment(k)) {
                    found(WindowHit { triangle: k, t, u, v: 0.0 });
                }
            });
        }
        let pivots = &turns_of(self.head).pivot.0;
        for k in lanes_of(self.mask) {
            let three = [pivots[k] as usize % LANES, (k + 1) % LANES, (k + 2) % LANES];
            let is_on_edge = self.on_edge >> k & 1 == 1;
            if is_on_edge && passes_outside(three.map(|i| self.x[i]), three.map(|i| self.y[i])) {
                continue;
            }
            let along = |i: usize| {
                let vertices = &self.vertices[ray.axes[i] as usize & 3];
                [vertices[three[0]], vertices[three[1]], vertices[three[2]], 0.0]
            };
            if let Some((t, u, v)) = meet(s, ray, [along(0), along(1), along(2)]) {
                found(WindowHit { triangle: k, t, u, v });
            }
        }
    }
}

impl Candidates {
    /// Segment `k` of a strand.
    #[inline(always)]
    fn segment(&self, k: usize) -> Segment {
        let point = |k: usize| Vec3::from_array([0, 1, 2].map(|axis| self.vertices[axis][k % LANES]));
        Segment {
            ends: [point(k), point(k + 1)],
            radii: [self.radii[k % LANES], self.radii[(k + 1) % LANES]],
        }
    }
}

#[inline(always)]
fn turns_of(head: WindowHead) -> &'static Turns {
    &TURNS[usize::from(head.turns() >> 1) & 31]
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

/// Whether the ray passes outside of a sheared triangle, one of whose edge functions is zero in f32.
#[cold]
#[inline(never)]
fn passes_outside(x: [f32; 3], y: [f32; 3]) -> bool {
    let edge = |a: usize, b: usize| f64::from(x[a]) * f64::from(y[b]) - f64::from(y[a]) * f64::from(x[b]);
    let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];
    edges.iter().any(|&e| e < 0.0) && edges.iter().any(|&e| e > 0.0)
}

/// Distance and weights of the second and third corner where the ray meets a triangle that it does not pass
/// outside of: `corners[axis][corner]`, axes as the ray has them. `None` for a triangle seen exactly from its side,
/// and where the ray ends before or begins after.
#[inline(always)]
fn meet<S: Simd>(s: S, ray: &PreparedRay, corners: [[f32; 4]; 3]) -> Option<(f32, f32, f32)> {
    let from_org = |i: usize| s.sub64(s.widen(&corners[i]), s.splat64(f64::from(ray.org_sheared[i])));
    let z = from_org(2);
    let shear = |i: usize| s.sub64(from_org(i), s.mul64(s.splat64(ray.exact_shear[i]), z));
    let (x, y) = (shear(0), shear(1));
    // The weight of a corner is the edge function of the other two.
    let (x1, y1) = (s.rotate64::<1>(x), s.rotate64::<1>(y));
    let (x2, y2) = (s.rotate64::<2>(x), s.rotate64::<2>(y));
    let [edge0, edge1, edge2, _] = s.store64(s.sub64(s.mul64(x1, y2), s.mul64(y1, x2)));
    let sum = edge0 + edge1 + edge2;
    if sum == 0.0 {
        return None;
    }
    let inverse = 1.0 / sum;
    let mut weights = [edge0 * inverse, edge1 * inverse, edge2 * inverse];
    if weights[0] < 0.0 || weights[1] < 0.0 || weights[2] < 0.0 {
        weights = nearest_on_border(&s.store64(x), &s.store64(y));
    }
    let z = s.store64(z);
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
fn nearest_on_border(x: &[f64; 4], y: &[f64; 4]) -> [f64; 3] {
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
pub(crate) const NEXT: Words = Words([1, 2, 3, 4, 5, 6, 7, 7]);
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
