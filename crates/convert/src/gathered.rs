//! All pieces of a conversion: those of triangles, then those of hair.
//!
//! A piece is of one kind, so both kinds are divided by themselves and meet in the root of the hierarchy.

use crate::distribute::{PieceSource, Pieces};
use crate::partition::Census;
use raystrips_geom::Aabb;
use raystrips_pack::GeometryBounds;
use raystrips_strips::Bvh;

/// Pieces of triangles and of strands, of which there are some of one kind at least.
pub(crate) struct Gathered {
    pub triangles: Option<Pieces>,
    pub strands: Option<Pieces>,
}

impl Gathered {
    /// `None` if there is nothing.
    pub fn new(triangles: Option<Pieces>, strands: Option<Pieces>) -> Option<Gathered> {
        (triangles.is_some() || strands.is_some()).then_some(Gathered { triangles, strands })
    }

    /// The kinds that there are.
    pub fn kinds(&self) -> impl Iterator<Item = &Pieces> {
        self.triangles.iter().chain(&self.strands)
    }

    fn sources(&self) -> impl Iterator<Item = &PieceSource> {
        self.kinds().flat_map(|pieces| &pieces.sources)
    }

    /// Number of pieces.
    pub fn piece_count(&self) -> usize {
        self.sources().count()
    }

    /// Triangles and segments of all pieces.
    pub fn primitives(&self) -> u64 {
        self.sources().map(|source| source.primitives).sum()
    }

    /// For each piece the number of triangles and segments before it.
    pub fn first_primitives(&self) -> Vec<u64> {
        let before = |sum: &mut u64, source: &PieceSource| {
            let first = *sum;
            *sum += source.primitives;
            Some(first)
        };
        self.sources().scan(0, before).collect()
    }

    /// The hierarchy over all pieces: leaf i is piece i.
    pub fn tree(&self) -> Bvh {
        let mut trees = self.kinds().map(|pieces| pieces.tree.clone());
        let tree = match (trees.next(), trees.next()) {
            (Some(a), Some(b)) => {
                Bvh::Inner { bounds: a.bounds().union(b.bounds()), children: Box::new([a, b]) }
            }
            (a, b) => a.or(b).expect("there are pieces"),
        };
        tree.number_leaves()
    }

    /// Box around all.
    pub fn bounds(&self) -> Aabb {
        self.kinds().fold(Aabb::EMPTY, |all, pieces| all.union(pieces.tree.bounds()))
    }

    /// What looks at all of it have told.
    pub fn census(&self) -> Census {
        let mut census = Census::default();
        self.kinds().for_each(|pieces| census.merge(&pieces.census));
        census
    }

    /// Box of each of so many geometries.
    pub fn geometry_bounds(&self, geometries: usize) -> Vec<GeometryBounds> {
        self.census().geometry_bounds(geometries)
    }
}
