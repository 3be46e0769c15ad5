//! What is compared: the bytes of a structure and its answers to rays.

use super::hierarchy::{Waiting, WaitingPacket};
use super::ray_strip::traverse::{PacketPart, Part};
use raystrips_geom::{Hit, Ray};

/// Bytes as the paper's Table 1 splits them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bytes {
    /// Triangles, and the vertices that they name.
    pub geometry: u64,
    /// Nodes.
    pub hierarchy: u64,
}

impl Bytes {
    /// Both.
    pub fn total(&self) -> u64 {
        self.geometry + self.hierarchy
    }
}

/// The memory of a traversal, kept from ray to ray.
#[derive(Debug, Default)]
pub struct Stacks {
    /// Nodes that wait for a ray.
    pub single: Vec<Waiting>,
    /// Nodes that wait for a packet.
    pub packet: Vec<WaitingPacket>,
    /// Parts of a strip that wait for a ray.
    pub strip: Vec<Part>,
    /// Parts of a strip that wait for a packet.
    pub strip_packet: Vec<PacketPart>,
    /// Four-wide nodes and triangle packets that wait for a ray, and where it meets them.
    pub multi: Vec<(u32, f32)>,
}

/// Something that finds closest hits.
pub trait Structure {
    /// Bytes of it.
    fn bytes(&self) -> Bytes;

    /// Closest hit of a valid ray. `u` and `v` are weights of the second and third corner as the structure stores the
    /// triangle.
    fn intersect(&self, stacks: &mut Stacks, ray: &Ray) -> Hit;

    /// Closest hits of four valid rays.
    fn intersect_packet(&self, stacks: &mut Stacks, rays: &[Ray; 4]) -> [Hit; 4] {
        rays.each_ref().map(|ray| self.intersect(stacks, ray))
    }

    /// How many of `rays` hit, one by one.
    fn count_hits(&self, rays: &[Ray]) -> usize {
        let mut stacks = Stacks::default();
        rays.iter().filter(|ray| self.intersect(&mut stacks, ray).is_hit()).count()
    }

    /// How many of `rays` hit, four at once; a rest that is no packet is traced one by one.
    fn count_hits_of_packets(&self, rays: &[Ray]) -> usize {
        let mut stacks = Stacks::default();
        let (packets, rest) = rays.as_chunks::<4>();
        let mut count =
            |packet| self.intersect_packet(&mut stacks, packet).iter().filter(|hit| hit.is_hit()).count();
        packets.iter().map(&mut count).sum::<usize>() + self.count_hits(rest)
    }
}
