//! Everything that the paper's tables compare, built over one model.

use super::models::Model;
use crate::paper::bvh::{Minimal, Optimized, PlainBvh};
use crate::paper::mesh::Mesh;
use crate::paper::multi_bvh::{MultiBvh, SingleTriangles};
use crate::paper::ray_strip::{CHUNK_TRIANGLES, RayStrips, SHORT_CHUNK_TRIANGLES};
use crate::paper::structure::{Bytes, Structure};

/// Name of our own structure.
pub const OURS: &str = "this program";
/// What others are compared with: the paper's BVH.
pub const BASE: &str = "BVH, optimized, 1 a leaf";
/// Name of the paper's Ray-Strips.
pub const RAY_STRIPS: &str = "Ray-Strips as published";
/// Name of the same over smaller pieces.
pub const SHORT_RAY_STRIPS: &str = "the same, shorter";

/// What the two kinds of Ray-Strips are.
pub const PIECES: &str =
    "The published Ray-Strips are built from pieces of at most 256 triangles, the shorter ones of 32.";
const _: () = assert!(CHUNK_TRIANGLES == 256 && SHORT_CHUNK_TRIANGLES == 32);

/// Triangles of a leaf with "a few" (paper, section 6.1).
const FEW: usize = 4;

/// The structures of the papers.
pub struct Contestants {
    pub optimized: [PlainBvh<Optimized>; 2],
    pub minimal: [PlainBvh<Minimal>; 2],
    pub strips: RayStrips,
    pub short_strips: RayStrips,
    pub multi: MultiBvh,
}

impl Contestants {
    /// Builds all of them.
    pub fn build(mesh: &Mesh) -> Contestants {
        Contestants {
            optimized: [1, FEW].map(|leaf_size| PlainBvh::build(mesh, leaf_size)),
            minimal: [1, FEW].map(|leaf_size| PlainBvh::build(mesh, leaf_size)),
            strips: RayStrips::build(mesh, CHUNK_TRIANGLES),
            short_strips: RayStrips::build(mesh, SHORT_CHUNK_TRIANGLES),
            multi: MultiBvh::build(mesh),
        }
    }

    /// Calls `f` with the name of each.
    pub fn for_each<'a>(&'a self, mut f: impl FnMut(&'static str, &'a dyn Structure)) {
        f(BASE, &self.optimized[0]);
        f("BVH, optimized, 4 a leaf", &self.optimized[1]);
        f("BVH, minimal, 1 a leaf", &self.minimal[0]);
        f("BVH, minimal, 4 a leaf", &self.minimal[1]);
        f(RAY_STRIPS, &self.strips);
        f(SHORT_RAY_STRIPS, &self.short_strips);
        f("multi-BVH, triangle packets", &self.multi);
    }

    /// The multi-BVH without triangle packets, which differs in speed only.
    pub fn single_triangles(&self) -> SingleTriangles<'_> {
        SingleTriangles(&self.multi)
    }
}

/// Bytes of our own structure as the paper splits them: vertices and strips; trees along strips, nodes, and what pages
/// cost.
pub fn our_bytes(model: &Model) -> Bytes {
    let bytes = &model.report.manifest.bytes;
    Bytes {
        geometry: bytes.vertices + bytes.indices,
        hierarchy: bytes.strip_trees + bytes.nodes + bytes.page_overhead,
    }
}

/// MB as the paper counts them.
pub fn megabytes(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}
