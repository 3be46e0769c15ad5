//! Simplifies one in-core piece of mesh by quadric error (Garland and Heckbert 1997), and measures how far two meshes
//! are apart.
//!
//! [`simplify`] collapses edges in the order of the error that it makes (`queue`), each to the point where its
//! [`Quadric`] is least. `work_mesh` is the mesh while it changes, `planes` the quadrics to begin with, `legal`
//! what a collapse does to the triangles around it, `collapse` the order of things. Where edges are not what a mesh is
//! made of, [`merge_in_cells`] and [`thin`] come first.
//!
//! A piece may be one of many: vertices that others have too are *locked*, and vertices come with the quadrics that
//! stand for the surface they have replaced so far, so that pieces can be simplified, regrouped with other borders and
//! simplified again, and errors remain errors against the original. The [`CostCurve`]s of pieces tell at what cost all
//! of them together have as many triangles as are wanted.

mod cells;
pub mod closest;
mod collapse;
mod curve;
mod legal;
pub mod measure;
mod parts;
mod planes;
mod quadric;
mod queue;
mod repeated;
mod thin;
mod weld;
mod work_mesh;

pub use cells::merge_in_cells;
pub use closest::ClosestPoint;
pub use collapse::simplify;
pub use curve::CostCurve;
pub use measure::{Distances, measure};
pub use parts::Parts;
pub use quadric::{Quadric, StoredQuadric};
pub use thin::{Thinning, thin};
pub use weld::weld;

use glam::{DVec3, Vec3};

/// A piece of mesh. Equal positions must be one vertex for edges between triangles to be edges ([`weld`]).
#[derive(Clone, Debug, Default)]
pub struct Piece {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Corners as vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Geometry of each triangle.
    pub geometries: Vec<u32>,
    /// True for vertices that must stay as they are. Empty if there are none.
    pub locked: Vec<bool>,
    /// The quadric of each vertex, if the surface was simplified before; empty to have them made from the triangles.
    ///
    /// Where pieces share a vertex, each makes the part of its quadric that its own triangles give, so that the sum
    /// over pieces is the whole. It must stay the sum: where the vertex goes to several of the next pieces, give them what
    /// [`StoredQuadric::take`] gives.
    pub quadrics: Vec<StoredQuadric>,
    /// What is computed is relative to this: best about the middle of the piece.
    pub origin: DVec3,
}

/// When to stop: with as few triangles as `triangles`, or where no collapse costs less than `max_cost`.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Triangles to keep.
    pub triangles: usize,
    /// Least cost that no collapse may have: what [`CostCurve`] counts, so that pieces which are simplified one by one
    /// end where all of them in one would.
    pub max_cost: f64,
}

impl Target {
    /// As many as `triangles` are to be kept, whatever the cost.
    pub fn triangles(triangles: usize) -> Target {
        Target { triangles, max_cost: f64::INFINITY }
    }
}

/// A simplified piece.
#[derive(Clone, Debug, Default)]
pub struct Simplified {
    /// What is left. Every vertex is used, or locked and unused as it was before; all have their quadrics.
    pub piece: Piece,
    /// For each vertex the one of the input that it was, or that others were collapsed onto. Ascending.
    pub sources: Vec<u32>,
    /// The largest error of a collapse in scene units: the root of the mean squared distance of a vertex to the surface
    /// that it stands for, as the quadric tells it.
    pub error: f64,
    /// How many triangles were left by the cost of collapses.
    pub curve: CostCurve,
}
