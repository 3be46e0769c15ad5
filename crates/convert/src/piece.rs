//! One piece, from the scratch file to pages.

use crate::assemble::{Assembled, assemble};
use crate::borders::{self, Position};
use crate::distribute::Pieces;
use crate::emitters::emitters;
use crate::layout::vertices::order_vertices;
use crate::mesh::{Welded, encode_ids};
use crate::proxy::{Level, Simplified};
use crate::{ConvertError, ConvertParams};
use raystrips_geom::Aabb;
use raystrips_pack::Emitter;
use std::path::Path;

/// What is the same for all pieces.
pub(crate) struct Context<'a> {
    pub params: &'a ConvertParams,
    /// The pack.
    pub output: &'a Path,
    pub pieces: &'a Pieces,
    /// Box of each piece.
    pub boxes: Vec<Aabb>,
    /// For each geometry whether it shines.
    pub shines: &'a [bool],
    /// Bytes of a stored id; 0 if none are kept.
    pub id_bytes: u8,
    /// How pieces are simplified, if they are.
    pub first_level: Option<&'a Level>,
}

/// A piece that can be written.
pub(crate) struct BuiltPiece {
    pub assembled: Assembled,
    pub emitters: Vec<Emitter>,
    /// As stored.
    pub ids: Vec<u8>,
    /// Vertices that other pieces may have too.
    pub shared_vertices: Vec<Position>,
    /// Vertices that no other piece has.
    pub own_vertices: u64,
    /// The first level of the proxy; nothing if none is made.
    pub simplified: Simplified,
}

/// Builds piece `number`, whose triangles are numbered from `first_triangle` on. `finished` is told how many more
/// triangles are in strips.
pub(crate) fn build(
    context: &Context,
    number: usize,
    first_triangle: u64,
    finished: &(dyn Fn(usize) + Sync),
) -> Result<BuiltPiece, ConvertError> {
    let Welded { mesh, ids, .. } = context.pieces.read(number)?;
    let shared_vertices = borders::shared(&mesh.positions, &borders::overlaps(&context.boxes, number));
    let emitters = emitters(context.shines, &mesh);
    let mut built = raystrips_strips::build(&mesh, &context.params.strips, finished);
    let (page_size, layout) = (context.params.page_size as usize, context.params.layout);
    order_vertices(layout, &mut built.clusters);
    let ids = if context.id_bytes > 0 { encode_ids(&built, &ids, context.id_bytes) } else { Vec::new() };
    let own_vertices = (mesh.positions.len() - shared_vertices.len()) as u64;
    let assembled =
        assemble(&built, (page_size, layout), first_triangle).map_err(ConvertError::write(context.output))?;
    drop(built);
    let simplify = |level: &Level| level.simplified(mesh, Vec::new(), number);
    let simplified = context.first_level.map(simplify).unwrap_or_default();
    Ok(BuiltPiece { assembled, emitters, ids, shared_vertices, own_vertices, simplified })
}
