//! Four rays that are traced together (Wald et al. 2001), as the paper's 2x2 blocks of pixels.

use super::ray::{PreparedRay, hit_or_miss};
use glam::{Vec3, Vec4};
use raystrips_geom::{Hit, Ray};

/// Four rays, a lane each.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// The rays one by one.
    pub rays: [PreparedRay; 4],
    /// Origins by axis.
    pub org: [Vec4; 3],
    /// Directions by axis.
    pub dir: [Vec4; 3],
    /// Reciprocals of directions by axis.
    pub inv_dir: [Vec4; 3],
    /// Least distances of hits.
    pub tnear: Vec4,
    /// By axis: true where all directions point to greater coordinates, else none does.
    pub positive: [bool; 3],
    /// The origin of all rays, if it is one.
    pub shared_origin: Option<Vec3>,
}

impl Packet {
    /// Four valid rays as a packet; `None` if their directions differ in sign on some axis, so that they do not agree
    /// on which child is near: they are traced one by one.
    #[inline]
    pub fn new(rays: &[Ray; 4]) -> Option<Packet> {
        let rays = rays.each_ref().map(PreparedRay::new);
        let inv_dir = by_axis(&rays, |ray| ray.inv_dir);
        let zero = Vec4::ZERO;
        let negative = inv_dir.map(|inv| inv.cmplt(zero).bitmask());
        if negative.iter().any(|&mask| mask != 0 && mask != 0b1111) {
            return None;
        }
        let origin = rays[0].org;
        Some(Packet {
            org: by_axis(&rays, |ray| ray.org),
            dir: by_axis(&rays, |ray| ray.dir),
            inv_dir,
            tnear: Vec4::from_array(rays.map(|ray| ray.tnear)),
            positive: negative.map(|mask| mask == 0),
            shared_origin: rays.iter().all(|ray| ray.org == origin).then_some(origin),
            rays,
        })
    }
}

#[inline]
fn by_axis(rays: &[PreparedRay; 4], part: impl Fn(&PreparedRay) -> Vec3) -> [Vec4; 3] {
    let parts = rays.each_ref().map(part);
    [0, 1, 2].map(|axis| Vec4::from_array(parts.map(|p| p[axis])))
}

/// The best hits of a packet so far.
#[derive(Clone, Copy, Debug)]
pub struct PacketHits {
    /// The hits.
    pub hits: [Hit; 4],
    /// Their distances once more, as lanes.
    pub t: Vec4,
}

impl PacketHits {
    /// No hits yet.
    #[inline]
    pub fn new(packet: &Packet) -> PacketHits {
        let hits = packet.rays.each_ref().map(PreparedRay::no_hit);
        PacketHits { t: Vec4::from_array(hits.map(|hit| hit.t)), hits }
    }

    /// Takes in new hits of the rays in `mask`, which are nearer.
    #[inline]
    pub fn update(&mut self, mask: u32, t: Vec4, u: Vec4, v: Vec4, prim_id: u64) {
        let (t, u, v) = (t.to_array(), u.to_array(), v.to_array());
        for i in lanes(mask) {
            self.hits[i] = Hit { t: t[i], u: u[i], v: v[i], prim_id };
        }
        self.t = Vec4::from_array(self.hits.map(|hit| hit.t));
    }

    /// Lets `search` look for a nearer hit of ray `i` alone.
    #[inline]
    pub fn search_single(&mut self, i: usize, search: impl FnOnce(&mut Hit)) {
        search(&mut self.hits[i]);
        self.t[i] = self.hits[i].t;
    }

    /// The results.
    #[inline]
    pub fn finish(self) -> [Hit; 4] {
        self.hits.map(hit_or_miss)
    }
}

/// The rays in `mask`.
#[inline]
pub fn lanes(mask: u32) -> impl Iterator<Item = usize> {
    (0..4).filter(move |i| mask >> i & 1 != 0)
}
