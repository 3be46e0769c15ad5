//! Ray-Strips as published (Lauterbach, Yoon, Manocha 2007): a hierarchy of boxes by the surface area heuristic down
//! to strips, and a balanced spatial kd-tree without pointers along each strip.
//!
//! Where the text slips, this does what must be meant:
//! - Trees halve *units* of two triangles, not triangles, so that n triangles have the ceil(n / 2) - 1 nodes that
//!   section 4.1 gives; halving triangles has more (6 = 3 + 3 = (2 + 1) + (2 + 1) has 3 and not 2). See [`tree`].
//! - Nodes are in pre-order: the first child follows its parent, and the second one is found by the number of units in
//!   the first half. Section 4.1 says "an array without the need for child pointers" alone, and the usual order of
//!   heaps needs complete trees.
//! - Algorithm 1 ends at two *indices* where section 4.1 has leaves of two triangles; left and right are read as
//!   triangles.
//! - Algorithm 1 leaves the range of the ray as it is when only the far child is taken, and does not compare what it
//!   takes from the stack with the hit found since. See [`traverse`].
//! - Zero components of directions are not treated. See [`super::ray`].
//! - The winding of every second triangle, of which nothing is said, is left alone: both faces are hit.
//! - Table 5's strips times their length are 15 to 27 % more than the triangles: swaps, degenerate triangles that turn
//!   a strip, take places too. So they do here; triangles and places are told apart in [`Statistics`].
//!
//! Strips are those of meshoptimizer's stripifier, as STRIPE has no successor; materials are left out.

mod edges;
mod packet;
mod record;
mod stripify;
pub mod traverse;
mod tree;

use super::hierarchy::{Hierarchy, Link};
use super::mesh::Mesh;
use super::packet::{Packet, PacketHits};
use super::ray::{PreparedRay, hit_or_miss};
use super::structure::{Bytes, Stacks, Structure};
use glam::Vec3;
use raystrips_geom::{Aabb, Hit, Ray};
use raystrips_strips::Bvh;
use record::{RecordWriter, StripRecord};
use stripify::Stripifier;

pub use tree::LEAF_TRIANGLES;

/// What the paper leaves open.
#[derive(Clone, Copy, Debug)]
pub struct Params {
    /// Most triangles of a piece in which strips are looked for (section 3.3.1, "up to a certain triangle count").
    pub chunk_triangles: usize,
    /// Parts of so many leaves are tested whole, which section 5.2 allows at every step.
    pub whole_units: u32,
}

impl Params {
    /// What comes nearest to the paper's figures: with these pieces the bunny has about the bytes of Table 1, and with
    /// the leaves of Algorithm 1 about the speed beside the plain hierarchy that Table 3 tells.
    pub const PUBLISHED: Params = Params { chunk_triangles: 256, whole_units: 1 };
    /// What is fastest: small pieces have more boxes and better ones, and the nodes over the last few triangles cost
    /// more than they save.
    pub const TUNED: Params = Params { chunk_triangles: 32, whole_units: 4 };
}

/// What strips came of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Pieces in which strips were looked for.
    pub chunks: usize,
    /// Strips.
    pub strips: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Triangles in strips, swaps included.
    pub places: usize,
    /// Nodes of the trees along strips.
    pub tree_nodes: usize,
    /// Nodes of the hierarchy down to strips, leaves included.
    pub nodes: usize,
}

/// Ray-Strips of a mesh.
pub struct RayStrips {
    positions: Vec<Vec3>,
    /// Leaves name strips by their place in `records`.
    hierarchy: Hierarchy,
    records: Vec<u8>,
    statistics: Statistics,
    params: Params,
}

impl RayStrips {
    /// Builds over `mesh`.
    ///
    /// # Panics
    /// If a strip can become longer than its two bytes of length can tell.
    pub fn build(mesh: &Mesh, params: Params) -> RayStrips {
        let chunks =
            raystrips_strips::bvh::build(&mesh.boxes(), &|items| items.len() <= params.chunk_triangles);
        let mut builder = Builder {
            mesh,
            stripifier: Stripifier::new(mesh),
            writer: RecordWriter::default(),
            places: Vec::new(),
            statistics: Statistics { triangles: mesh.triangles.len(), ..Statistics::default() },
        };
        let tree = chunks.tree.graft(&mut |_, items| builder.chunk(&chunks.order[items]));
        let Builder { writer, places, mut statistics, .. } = builder;
        let hierarchy = Hierarchy::new(&tree, &mut |strip| Link {
            first: places[strip.start],
            count: strip.len() as u32,
        });
        statistics.nodes = hierarchy.node_count();
        RayStrips {
            positions: mesh.positions.clone(),
            hierarchy,
            records: writer.finish(),
            statistics,
            params,
        }
    }

    /// What strips there are.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Vertices of each strip.
    #[cfg(test)]
    pub fn strips(&self) -> impl Iterator<Item = Vec<u32>> {
        let strips = std::iter::successors(Some(0), |&place| {
            Some(place + StripRecord::at(&self.records, place).bytes())
        });
        strips.take(self.statistics.strips).map(|place| StripRecord::at(&self.records, place).vertices())
    }

    #[inline]
    fn strip(&self, link: Link) -> StripRecord<'_> {
        StripRecord::at(&self.records, link.first as usize)
    }
}

/// Strips of one piece after the other.
struct Builder<'m> {
    mesh: &'m Mesh,
    stripifier: Stripifier<'m>,
    writer: RecordWriter,
    /// Where in the records each strip is.
    places: Vec<u32>,
    statistics: Statistics,
}

impl Builder<'_> {
    /// The hierarchy of a piece: a strip, or, where no strip spans it, one over as many as it takes (section 4.2).
    fn chunk(&mut self, triangles: &[u32]) -> Bvh {
        let strips = self.stripifier.strips(triangles);
        let vertex = |&v: &u32| self.mesh.positions[v as usize];
        let boxes: Vec<Aabb> = strips.iter().map(|strip| Aabb::of_points(strip.iter().map(vertex))).collect();
        let built = raystrips_strips::bvh::build(&boxes, &|_| false);
        for &strip in &built.order {
            self.push(&strips[strip as usize]);
        }
        self.statistics.chunks += 1;
        built.tree
    }

    fn push(&mut self, strip: &[u32]) {
        let tree = tree::build(strip, &self.mesh.positions);
        self.statistics.strips += 1;
        self.statistics.places += strip.len() - 2;
        self.statistics.tree_nodes += tree.len();
        self.places.push(self.writer.push(&tree, strip));
    }
}

impl Structure for RayStrips {
    fn bytes(&self) -> Bytes {
        let trees = self.statistics.tree_nodes * record::NODE_BYTES;
        let vertices = size_of_val(&self.positions[..]);
        Bytes {
            geometry: (vertices + self.records.len() - trees) as u64,
            hierarchy: self.hierarchy.bytes() + trees as u64,
        }
    }

    #[inline]
    fn intersect(&self, stacks: &mut Stacks, ray: &Ray) -> Hit {
        let ray = PreparedRay::new(ray);
        let mut best = ray.no_hit();
        let Stacks { single, strip: stack, .. } = stacks;
        self.hierarchy.traverse(&ray, single, &mut best, |link, range, best| {
            let strip = self.strip(link);
            self.trace_strip(&strip, &ray, strip.whole(range), stack, best);
        });
        hit_or_miss(best)
    }

    #[inline]
    fn intersect_packet(&self, stacks: &mut Stacks, rays: &[Ray; 4]) -> [Hit; 4] {
        let Some(packet) = Packet::new(rays) else {
            return rays.each_ref().map(|ray| self.intersect(stacks, ray));
        };
        let mut best = PacketHits::new(&packet);
        let Stacks { packet: stack, strip, strip_packet, .. } = stacks;
        self.hierarchy.traverse_packet(&packet, stack, &mut best, |leaf, best| {
            self.trace_strip_packet(&packet, leaf, strip_packet, strip, best);
        });
        best.finish()
    }
}
