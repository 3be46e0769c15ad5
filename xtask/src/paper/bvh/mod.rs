//! The plain hierarchy of boxes that the paper compares with: a binary one by the surface area heuristic with one
//! triangle a leaf, or a few (section 6.1).

mod minimal;
mod optimized;

pub use minimal::Minimal;
pub use optimized::Optimized;

use super::hierarchy::{Hierarchy, Link};
use super::mesh::Mesh;
use super::packet::{Packet, PacketHits};
use super::ray::{PreparedRay, hit_or_miss};
use super::structure::{Bytes, Stacks, Structure};
use raystrips_geom::{Hit, Ray};

/// Triangles in the order of leaves.
pub trait TriangleList {
    /// The triangles of `mesh` in the given order.
    fn new(mesh: &Mesh, order: &[u32]) -> Self;

    /// Bytes of the triangles, with the vertices that they name.
    fn bytes(&self) -> u64;

    /// Replaces `best` where `ray` meets triangle `i` nearer.
    fn test(&self, i: usize, ray: &PreparedRay, best: &mut Hit);

    /// The same for four rays at once.
    fn test_packet(&self, i: usize, packet: &Packet, best: &mut PacketHits);
}

/// A hierarchy of boxes over triangles.
pub struct PlainBvh<T> {
    hierarchy: Hierarchy,
    triangles: T,
}

impl<T: TriangleList> PlainBvh<T> {
    /// Builds over `mesh`, with leaves of at most `leaf_size` triangles.
    pub fn build(mesh: &Mesh, leaf_size: usize) -> PlainBvh<T> {
        let built = raystrips_strips::bvh::build(&mesh.boxes(), &|items| items.len() <= leaf_size);
        let mut leaf =
            |items: std::ops::Range<usize>| Link { first: items.start as u32, count: items.len() as u32 };
        let hierarchy = Hierarchy::new(&built.tree, &mut leaf);
        PlainBvh { hierarchy, triangles: T::new(mesh, &built.order) }
    }

    /// Nodes, leaves included.
    pub fn node_count(&self) -> usize {
        self.hierarchy.node_count()
    }
}

fn items(link: Link) -> std::ops::Range<usize> {
    link.first as usize..(link.first + link.count) as usize
}

impl<T: TriangleList> Structure for PlainBvh<T> {
    fn bytes(&self) -> Bytes {
        Bytes { geometry: self.triangles.bytes(), hierarchy: self.hierarchy.bytes() }
    }

    #[inline]
    fn intersect(&self, stacks: &mut Stacks, ray: &Ray) -> Hit {
        let ray = PreparedRay::new(ray);
        let mut best = ray.no_hit();
        self.hierarchy.traverse(&ray, &mut stacks.single, &mut best, |link, _, best| {
            items(link).for_each(|i| self.triangles.test(i, &ray, best));
        });
        hit_or_miss(best)
    }

    #[inline]
    fn intersect_packet(&self, stacks: &mut Stacks, rays: &[Ray; 4]) -> [Hit; 4] {
        let Some(packet) = Packet::new(rays) else {
            return rays.each_ref().map(|ray| self.intersect(stacks, ray));
        };
        let mut best = PacketHits::new(&packet);
        self.hierarchy.traverse_packet(&packet, &mut stacks.packet, &mut best, |leaf, best| {
            items(leaf.link).for_each(|i| self.triangles.test_packet(i, &packet, best));
        });
        best.finish()
    }
}
