//! One in-core piece of mesh to a hierarchy over Ray-Strips (Lauterbach, Yoon, Manocha 2007).
//!
//! [`build`] composes the steps, each in a file of its own: a surface area hierarchy down to *clusters*, which
//! share at most 256 vertices ([`cluster`]); strips in each cluster ([`stripify`]); a balanced tree along each
//! strip ([`split_tree`]); groups of strips that fill a node, and a hierarchy over those ([`groups`]).
//!
//! Unlike the paper, which cuts the mesh into chunks and takes whatever strips span them, strips are found
//! first and the hierarchy goes on down to them, so a strip is never larger than the area it saves bytes for.
//!
//! [`build_strands`] does the same for hair ([`strands`]).

pub mod bvh;
pub mod cluster;
pub mod collapse;
pub mod groups;
pub mod split_tree;
pub mod strands;
pub mod stripify;

pub use bvh::Bvh;
pub use cluster::Cluster;
pub use collapse::Collapse;
pub use strands::{StrandWindow, Strands, build_strands};
pub use stripify::{Source, Strip};

use glam::Vec3;
use rayon::prelude::*;
use raystrips_geom::Aabb;
use std::ops::Range;

/// A piece of mesh. Equal positions must be one vertex for strips to run across.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Corners as vertices; no two corners of a triangle are the same.
    pub triangles: Vec<[u32; 3]>,
    /// Geometry of each triangle.
    pub geometries: Vec<u32>,
}

impl Mesh {
    /// Corners of triangle `i`.
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        self.triangles[i].map(|v| self.positions[v as usize])
    }
}

/// Parameters of [`build`].
#[derive(Clone, Copy, Debug)]
pub struct StripParams {
    /// Most windows of a strip; 1 makes trees along strips unnecessary.
    pub max_windows: usize,
}

impl Default for StripParams {
    /// One window: `docs/RESULTS.md`, "Length of strips".
    fn default() -> StripParams {
        StripParams { max_windows: 1 }
    }
}

/// Most strips of a group: the children of a node.
pub const GROUP_STRIPS: usize = 8;

/// A built piece.
#[derive(Clone, Debug)]
pub struct StripTree {
    /// Hierarchy whose leaves are single groups of strips, numbered through all clusters.
    pub tree: Bvh,
    /// Clusters.
    pub clusters: Vec<Cluster>,
    /// For each group its cluster and its place there.
    pub groups: Vec<(u32, u32)>,
}

/// Builds the hierarchy of a piece. The result does not depend on the number of threads. `finished` is told from any
/// thread how many more triangles are in strips.
///
/// Memory: about 150 bytes a triangle. Time: O(n log n).
///
/// # Panics
/// If the mesh has no triangles or indices out of range.
pub fn build(mesh: &Mesh, params: &StripParams, finished: &(dyn Fn(usize) + Sync)) -> StripTree {
    let bounds: Vec<Aabb> = (0..mesh.triangles.len()).map(|i| Aabb::of_points(mesh.corners(i))).collect();
    let built = bvh::build(&bounds, &|triangles| cluster::fits(mesh, triangles));
    let cluster = |range: &Range<usize>| {
        let cluster = Cluster::build(mesh, &built.order[range.clone()], params, GROUP_STRIPS);
        finished(range.len());
        cluster
    };
    let clusters = built.tree.leaves().par_iter().map(cluster).unzip();
    tree_of_clusters(built.tree, clusters)
}

/// A hierarchy down to clusters, and those with their own, made one.
fn tree_of_clusters(tree: Bvh, (clusters, trees): (Vec<Cluster>, Vec<Bvh>)) -> StripTree {
    let mut trees = trees.into_iter();
    let tree = tree.graft(&mut |_, _| trees.next().expect("a tree for each cluster"));
    let numbered =
        |(cluster, c): (usize, &Cluster)| (0..c.groups.len()).map(move |i| (cluster as u32, i as u32));
    let groups = clusters.iter().enumerate().flat_map(numbered).collect();
    StripTree { tree, clusters, groups }
}
