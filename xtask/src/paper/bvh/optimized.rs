//! "Optimized" triangles (paper, sections 3.2 and 6.1): 48 precomputed bytes, the projection of Wald's thesis (2004,
//! section 7.1).
//!
//! The plane is solved for the axis on which the normal is largest, and the weights of two corners are linear
//! functions of the other two coordinates.

use super::super::mesh::Mesh;
use super::super::packet::{Packet, PacketHits};
use super::super::ray::PreparedRay;
use super::TriangleList;
use glam::{DVec3, Vec4};
use raystrips_geom::Hit;

/// A precomputed triangle.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
struct Projected {
    /// The plane: x\[k\] + n\[0\] x\[u\] + n\[1\] x\[v\] = n\[2\].
    n: [f32; 3],
    /// Axis that is projected along; `u` and `v` are the next two.
    k: u32,
    /// Weight of the second corner, linear in x\[u\] and x\[v\].
    second: [f32; 3],
    _pad: u32,
    /// Weight of the third corner.
    third: [f32; 3],
    triangle: u32,
}

const _: () = assert!(size_of::<Projected>() == 48);

/// Precomputed triangles.
pub struct Optimized {
    triangles: Vec<Projected>,
}

/// The axes after each.
const NEXT: [usize; 5] = [0, 1, 2, 0, 1];

impl Projected {
    fn new(corners: [DVec3; 3], triangle: u32) -> Projected {
        let [a, b, c] = corners;
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let k = normal.abs().max_position();
        let (u, v) = (NEXT[k + 1], NEXT[k + 2]);
        let weight = |along: DVec3, away: f64| {
            let (du, dv) = (along[v] * away / normal[k], -along[u] * away / normal[k]);
            [du, dv, -(du * a[u] + dv * a[v])].map(|x| x as f32)
        };
        Projected {
            n: [normal[u] / normal[k], normal[v] / normal[k], normal.dot(a) / normal[k]].map(|x| x as f32),
            k: k as u32,
            second: weight(ac, 1.0),
            _pad: 0,
            third: weight(ab, -1.0),
            triangle,
        }
    }
}

impl TriangleList for Optimized {
    fn new(mesh: &Mesh, order: &[u32]) -> Optimized {
        let projected = |&i: &u32| Projected::new(mesh.corners(i as usize).map(|p| p.as_dvec3()), i);
        Optimized { triangles: order.iter().map(projected).collect() }
    }

    fn bytes(&self) -> u64 {
        size_of_val(&self.triangles[..]) as u64
    }

    #[inline]
    fn test(&self, i: usize, ray: &PreparedRay, best: &mut Hit) {
        let tri = &self.triangles[i];
        let k = (tri.k % 3) as usize;
        let (ku, kv) = (NEXT[k + 1], NEXT[k + 2]);
        let (org, dir): (&[f32; 3], &[f32; 3]) = (ray.org.as_ref(), ray.dir.as_ref());
        let slope = dir[k] + tri.n[0] * dir[ku] + tri.n[1] * dir[kv];
        let height = tri.n[2] - org[k] - tri.n[0] * org[ku] - tri.n[1] * org[kv];
        let t = height / slope;
        if !(t >= ray.tnear && t < best.t) {
            return;
        }
        let (x, y) = (org[ku] + t * dir[ku], org[kv] + t * dir[kv]);
        let u = x * tri.second[0] + y * tri.second[1] + tri.second[2];
        let v = x * tri.third[0] + y * tri.third[1] + tri.third[2];
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            *best = Hit { t, u, v, prim_id: u64::from(tri.triangle), ..Hit::MISS };
        }
    }

    #[inline]
    fn test_packet(&self, i: usize, packet: &Packet, best: &mut PacketHits) {
        let tri = &self.triangles[i];
        let k = (tri.k % 3) as usize;
        let (ku, kv) = (NEXT[k + 1], NEXT[k + 2]);
        let Packet { org, dir, .. } = packet;
        let (n, second, third) = (&tri.n, &tri.second, &tri.third);
        let t = (Vec4::splat(n[2]) - org[k] - n[0] * org[ku] - n[1] * org[kv])
            / (dir[k] + dir[ku] * n[0] + dir[kv] * n[1]);
        let between = t.cmpge(packet.tnear) & t.cmplt(best.t);
        if !between.any() {
            return;
        }
        let (x, y) = (org[ku] + t * dir[ku], org[kv] + t * dir[kv]);
        let u = x * second[0] + y * second[1] + second[2];
        let v = x * third[0] + y * third[1] + third[2];
        let inside = u.min(v).cmpge(Vec4::ZERO) & (u + v).cmple(Vec4::ONE);
        let mask = (between & inside).bitmask();
        if mask != 0 {
            best.update(mask, t, u, v, u64::from(tri.triangle));
        }
    }
}
