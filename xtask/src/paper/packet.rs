//! Four rays that are traced together (Wald et al. 2001), as the paper's 2x2 blocks of pixels.

use super::moeller_trumbore::Lanes;
use super::ray::{PreparedRay, hit_or_miss};
use glam::{Vec3, Vec4};
use raystrips_geom::{Hit, Ray};

/// Four rays, a lane each.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// The rays one by one.
    pub rays: [PreparedRay; 4],
    /// Origins by axis.
    pub org: Lanes,
    /// Directions by axis.
    pub dir: Lanes,
    /// Reciprocals of directions by axis.
    pub inv_dir: Lanes,
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
        let rays = &[
            PreparedRay::new(&rays[0]),
            PreparedRay::new(&rays[1]),
            PreparedRay::new(&rays[2]),
            PreparedRay::new(&rays[3]),
        ];
        let inv_dir = by_axis(rays, |ray| ray.inv_dir);
        let negative = |axis: usize| inv_dir[axis].cmplt(Vec4::ZERO).bitmask();
        let negative = [negative(0), negative(1), negative(2)];
        if negative.iter().any(|&mask| mask != 0 && mask != 0b1111) {
            return None;
        }
        let origin = rays[0].org;
        Some(Packet {
            org: by_axis(rays, |ray| ray.org),
            dir: by_axis(rays, |ray| ray.dir),
            inv_dir,
            tnear: lanes_of(rays, |ray| ray.tnear),
            positive: [negative[0] == 0, negative[1] == 0, negative[2] == 0],
            shared_origin: rays.iter().all(|ray| ray.org == origin).then_some(origin),
            rays: *rays,
        })
    }
}

// Arrays are written out here and elsewhere: the compiler does not inline what `map` on arrays becomes.

#[inline]
fn by_axis(rays: &[PreparedRay; 4], part: impl Fn(&PreparedRay) -> Vec3) -> Lanes {
    [lanes_of(rays, |r| part(r).x), lanes_of(rays, |r| part(r).y), lanes_of(rays, |r| part(r).z)]
}

#[inline]
fn lanes_of(rays: &[PreparedRay; 4], part: impl Fn(&PreparedRay) -> f32) -> Vec4 {
    Vec4::new(part(&rays[0]), part(&rays[1]), part(&rays[2]), part(&rays[3]))
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
        let [a, b, c, d] = &packet.rays;
        let hits = [a.no_hit(), b.no_hit(), c.no_hit(), d.no_hit()];
        PacketHits { t: Vec4::new(a.tfar, b.tfar, c.tfar, d.tfar), hits }
    }

    /// Takes in new hits of the rays in `mask`, which are nearer.
    #[inline]
    pub fn update(&mut self, mask: u32, t: Vec4, u: Vec4, v: Vec4, prim_id: u64) {
        let (u, v) = (u.to_array(), v.to_array());
        for i in lanes(mask) {
            self.hits[i] = Hit { t: t[i], u: u[i], v: v[i], prim_id, ..Hit::MISS };
        }
        let [a, b, c, d] = &self.hits;
        self.t = Vec4::new(a.t, b.t, c.t, d.t);
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
        let [a, b, c, d] = self.hits;
        [hit_or_miss(a), hit_or_miss(b), hit_or_miss(c), hit_or_miss(d)]
    }
}

/// The rays in `mask`.
#[inline]
pub fn lanes(mask: u32) -> impl Iterator<Item = usize> {
    (0..4).filter(move |i| mask >> i & 1 != 0)
}
