//! How a model is simplified, which depends on what it is made of.
//!
//! Collapsing edges makes parts coarser; a part that gets less than a handful of triangles vanishes. Where that would
//! happen to most of a model, there are two ways. If it is a surface after all, of patches that do not quite touch, as
//! models are that were exported face by face, it is made whole. Else, as with the leaves of a tree, some parts stay
//! and grow.

use crate::ConvertError;
use crate::distribute::Pieces;
use crate::mesh::Welded;
use glam::DVec3;
use raystrips_geom::Aabb;
use raystrips_simplify::{Parts, Piece, Thinning, merge_in_cells, thin};
use raystrips_strips::Mesh;

/// A part of fewer triangles is no part any more.
const LEAST_PART: f64 = 4.0;
/// Share of the triangles that may be in parts that would vanish.
const MOST_VANISHING: f64 = 0.5;
/// Share of the sides of triangles that may have no other triangle, if it is a surface.
const MOST_OPEN: f64 = 0.3;
/// What is nearer than this share of an edge may be meant to touch.
const GAP: f64 = 0.05;
/// So much more of the parts is kept at first than there is to be in the end: the rest is left to edge collapses.
const RESERVE: f64 = 1.2;
/// Most triangles of an element, if all that is made of elements is to be thinned.
const ELEMENT_TRIANGLES: u32 = 1024;

/// How to simplify.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SimplifyMethod {
    /// As it suits the model.
    #[default]
    Auto,
    /// By collapsing edges of least quadric error, whatever the model.
    Quadric,
    /// By leaving out parts, whatever their shape, as far as they have no more than some thousand triangles.
    Stochastic,
}

/// What is done to pieces before they are simplified for the first time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Preparation {
    /// Vertices within a cell of this size are one.
    pub cell: Option<f64>,
    pub thinning: Option<Thinning>,
}

impl Preparation {
    /// What suits the model of which `samples` are pieces, when this share of its triangles is to stay.
    pub fn new(
        pieces: &Pieces,
        samples: &[usize],
        method: SimplifyMethod,
        kept: f64,
    ) -> Result<Preparation, ConvertError> {
        let thinning = |small_part| Thinning { small_part, kept: (kept * RESERVE).min(1.0) };
        let vanishing = (LEAST_PART / kept.max(1e-9)) as u32;
        match method {
            SimplifyMethod::Quadric => return Ok(Preparation::default()),
            SimplifyMethod::Stochastic => {
                let thinning = Some(thinning(vanishing.max(ELEMENT_TRIANGLES)));
                return Ok(Preparation { thinning, ..Preparation::default() });
            }
            SimplifyMethod::Auto => {}
        }
        let mut look = Look::default();
        for &number in samples {
            look.add(&pieces.read(number)?.mesh, vanishing);
        }
        if look.vanishing <= MOST_VANISHING * look.triangles {
            return Ok(Preparation::default());
        }
        let cell = GAP * look.edges / (3.0 * look.vanishing);
        let mut merged = Look::default();
        for &number in samples {
            let Welded { mesh, .. } = pieces.read(number)?;
            merged.add(&to_mesh(merge_in_cells(to_piece(mesh), cell)), vanishing);
        }
        Ok(if merged.vanishing <= MOST_VANISHING * merged.triangles && merged.is_surface() {
            Preparation { cell: Some(cell), thinning: None }
        } else {
            Preparation { cell: None, thinning: Some(thinning(vanishing)) }
        })
    }

    /// Merges vertices, before it is known which are locked.
    pub fn merge(&self, piece: Piece) -> Piece {
        match self.cell {
            Some(cell) => merge_in_cells(piece, cell),
            None => piece,
        }
    }

    /// Leaves out parts.
    pub fn thin(&self, piece: &mut Piece) {
        if let Some(thinning) = self.thinning {
            thin(piece, thinning);
        }
    }
}

/// What some pieces are made of.
#[derive(Default)]
struct Look {
    triangles: f64,
    /// Triangles in parts that would vanish.
    vanishing: f64,
    /// Sum of the lengths of their edges.
    edges: f64,
    /// Sides of triangles that no other triangle has.
    open_sides: f64,
}

impl Look {
    fn add(&mut self, mesh: &Mesh, vanishing: u32) {
        let parts = Parts::of(mesh.positions.len(), &mesh.triangles);
        self.triangles += mesh.triangles.len() as f64;
        for (i, &part) in parts.of_triangle.iter().enumerate() {
            if parts.sizes[part as usize] < vanishing {
                let [a, b, c] = mesh.corners(i);
                self.vanishing += 1.0;
                self.edges += f64::from(a.distance(b) + b.distance(c) + c.distance(a));
            }
        }
        let mut sides: Vec<[u32; 2]> = mesh.triangles.iter().copied().flat_map(sides).collect();
        sides.sort_unstable();
        self.open_sides += sides.chunk_by(|a, b| a == b).filter(|sides| sides.len() == 1).count() as f64;
    }

    /// True if most triangles are beside each other. Triangles that only cross each other have points in common, too,
    /// when points that are near are one.
    fn is_surface(&self) -> bool {
        self.open_sides <= MOST_OPEN * 3.0 * self.triangles
    }
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)])
}

/// A piece without locks that has not been simplified.
pub(crate) fn to_piece(Mesh { positions, triangles, geometries }: Mesh) -> Piece {
    let origin = DVec3::from(Aabb::of_points(positions.iter().copied()).center());
    Piece { positions, triangles, geometries, origin, ..Piece::default() }
}

fn to_mesh(Piece { positions, triangles, geometries, .. }: Piece) -> Mesh {
    Mesh { positions, triangles, geometries }
}
