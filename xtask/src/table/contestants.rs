//! Everything that the paper's tables compare, built over one model.

use super::models::Model;
use crate::paper::bvh::{Minimal, Optimized, PlainBvh};
use crate::paper::mesh::Mesh;
use crate::paper::multi_bvh::{MultiBvh, SingleTriangles};
use crate::paper::ray_strip::{LEAF_TRIANGLES, Params, RayStrips};
use crate::paper::structure::{Bytes, Structure};

/// Name of our own structure.
pub const OURS: &str = "this program";
/// What others are compared with: the paper's BVH.
pub const BASE: &str = "BVH, optimized, 1 a leaf";
/// Name of the paper's Ray-Strips.
pub const RAY_STRIPS: &str = "Ray-Strips as published";
/// Name of the same with what the paper leaves open chosen for speed.
pub const TUNED_RAY_STRIPS: &str = "Ray-Strips, tuned";

/// Triangles of a leaf with "a few" (paper, section 6.1).
const FEW: usize = 4;

/// The structures of the papers.
pub struct Contestants {
    pub optimized: [PlainBvh<Optimized>; 2],
    pub minimal: [PlainBvh<Minimal>; 2],
    pub strips: RayStrips,
    pub tuned_strips: RayStrips,
    pub multi: MultiBvh,
}

impl Contestants {
    /// Builds all of them.
    pub fn build(mesh: &Mesh) -> Contestants {
        Contestants {
            optimized: [1, FEW].map(|leaf_size| PlainBvh::build(mesh, leaf_size)),
            minimal: [1, FEW].map(|leaf_size| PlainBvh::build(mesh, leaf_size)),
            strips: RayStrips::build(mesh, Params::PUBLISHED),
            tuned_strips: RayStrips::build(mesh, Params::TUNED),
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
        f(TUNED_RAY_STRIPS, &self.tuned_strips);
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

/// A sentence on the two kinds of Ray-Strips.
pub fn about_strips() -> String {
    let Params { chunk_triangles: published, .. } = Params::PUBLISHED;
    let Params { chunk_triangles: tuned, whole_units } = Params::TUNED;
    let whole = whole_units as usize * LEAF_TRIANGLES;
    format!(
        "Published Ray-Strips are of pieces of up to {published} triangles and have leaves of {LEAF_TRIANGLES}; tuned \
         ones are of pieces of up to {tuned}, and parts of up to {whole} triangles are tested whole."
    )
}

/// MB as the paper counts them.
pub fn megabytes(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}
