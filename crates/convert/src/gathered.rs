//! All pieces of a conversion: those of triangles, then those of hair, then those of parts that instances show.
//!
//! A piece is of one kind, so both kinds are divided by themselves and meet in the root of the hierarchy. Parts have
//! hierarchies of their own.

use crate::distribute::{PieceSource, Pieces};
use crate::partition::Census;
use raystrips_extmem::Spool;
use raystrips_geom::Aabb;
use raystrips_pack::GeometryBounds;
use raystrips_strips::Bvh;
use std::sync::Arc;

/// Pieces of triangles, of strands, and of triangles of parts; there are some.
pub(crate) struct Gathered {
    pub triangles: Option<Pieces>,
    pub strands: Option<Pieces>,
    /// None of a part without area.
    pub parts: Vec<Option<Pieces>>,
}

impl Gathered {
    /// `None` if there is nothing.
    pub fn new(
        triangles: Option<Pieces>,
        strands: Option<Pieces>,
        parts: Vec<Option<Pieces>>,
    ) -> Option<Gathered> {
        let gathered = Gathered { triangles, strands, parts };
        let is_some = gathered.all().next().is_some();
        is_some.then_some(gathered)
    }

    /// What stands in the scene: the kinds that there are.
    fn kinds(&self) -> impl Iterator<Item = &Pieces> {
        self.triangles.iter().chain(&self.strands)
    }

    /// The same, and then the parts.
    pub fn all(&self) -> impl Iterator<Item = &Pieces> {
        self.kinds().chain(self.parts.iter().flatten())
    }

    /// The spools that pieces are in.
    pub fn spools(&self) -> Vec<&Spool> {
        let mut spools: Vec<&Arc<Spool>> = self.all().map(|pieces| &pieces.spool).collect();
        spools.dedup_by(|a, b| Arc::ptr_eq(a, b));
        spools.into_iter().map(|spool| &**spool).collect()
    }

    fn sources(&self) -> impl Iterator<Item = &PieceSource> {
        self.all().flat_map(|pieces| &pieces.sources)
    }

    /// Number of pieces.
    pub fn piece_count(&self) -> usize {
        self.sources().count()
    }

    /// Pieces of what stands in the scene, which come first.
    pub fn scene_piece_count(&self) -> usize {
        self.kinds().map(|pieces| pieces.sources.len()).sum()
    }

    /// Triangles and segments of all pieces.
    pub fn primitives(&self) -> u64 {
        self.sources().map(|source| source.primitives).sum()
    }

    /// Those of what stands in the scene.
    pub fn scene_primitives(&self) -> u64 {
        self.kinds().map(Pieces::primitives).sum()
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

    /// The hierarchy over what stands in the scene, if anything does: leaf i is piece i.
    pub fn scene_tree(&self) -> Option<Bvh> {
        let trees = self.kinds().map(|pieces| pieces.tree.clone());
        trees.reduce(Bvh::join).map(Bvh::number_leaves)
    }

    /// Box around what stands in the scene.
    pub fn bounds(&self) -> Aabb {
        self.kinds().fold(Aabb::EMPTY, |all, pieces| all.union(pieces.tree.bounds()))
    }

    /// What looks at what stands in the scene have told.
    pub fn census(&self) -> Census {
        let mut census = Census::default();
        self.kinds().for_each(|pieces| census.merge(&pieces.census));
        census
    }

    /// Triangles without area.
    pub fn degenerate(&self) -> u64 {
        self.all().map(|pieces| pieces.census.degenerate).sum()
    }

    /// Box of what stands in the scene of each of so many geometries.
    pub fn geometry_bounds(&self, geometries: usize) -> Vec<GeometryBounds> {
        self.census().geometry_bounds(geometries)
    }
}
