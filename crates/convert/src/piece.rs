//! One piece, from the scratch file to pages.

use crate::assemble::{Assembled, PageStyle, assemble};
use crate::block::Block;
use crate::borders::{self, Position};
use crate::distribute::Pieces;
use crate::emitters::emitters;
use crate::layout::vertices::order_vertices;
use crate::mesh::{Welded, encode_ids};
use crate::proxy::{Level, Simplified};
use crate::strands::{PieceOfStrands, StrandThinning};
use crate::{ConvertError, ConvertParams};
use raystrips_geom::{Aabb, RadiusCode};
use raystrips_pack::{BlockEntry, Emitter};
use raystrips_strips::StripTree;
use std::path::Path;

/// What is the same for all pieces of a kind.
pub(crate) struct Context<'a> {
    pub params: &'a ConvertParams,
    /// The pack.
    pub output: &'a Path,
    pub pieces: &'a Pieces,
    /// Box of each piece.
    pub boxes: Vec<Aabb>,
    /// Bytes of a stored id; 0 if none are kept.
    pub id_bytes: u8,
    pub kind: Kind<'a>,
}

/// What pieces are of.
#[derive(Clone, Copy)]
pub(crate) enum Kind<'a> {
    Triangles {
        /// For each geometry whether it shines.
        shines: &'a [bool],
        /// How pieces are simplified, if they are.
        first_level: Option<&'a Level>,
    },
    Strands {
        radii: RadiusCode,
        /// How pieces are thinned for a proxy, if they are.
        thinning: Option<StrandThinning>,
    },
}

/// A piece that can be written.
pub(crate) struct BuiltPiece {
    pub assembled: Assembled,
    pub emitters: Vec<Emitter>,
    /// As stored.
    pub ids: Vec<u8>,
    /// Attributes of the pages, and their directory; empty if there are none.
    pub attributes: (Vec<BlockEntry>, Vec<u8>),
    /// Vertices that other pieces may have too.
    pub shared_vertices: Vec<Position>,
    /// Vertices that no other piece has.
    pub own_vertices: u64,
    /// The first level of the proxy; nothing if none is made.
    pub simplified: Simplified,
}

/// Builds piece `number` of its kind, whose triangles or segments are numbered from `first_primitive` on. `finished` is
/// told how many more of these are done.
pub(crate) fn build(
    context: &Context,
    number: usize,
    first_primitive: u64,
    finished: &(dyn Fn(usize) + Sync),
) -> Result<BuiltPiece, ConvertError> {
    match context.kind {
        Kind::Triangles { shines, first_level } => {
            build_triangles(context, (shines, first_level), number, first_primitive, finished)
        }
        Kind::Strands { radii, thinning } => {
            build_strands(context, (radii, thinning), number, first_primitive, finished)
        }
    }
}

fn build_triangles(
    context: &Context,
    (shines, first_level): (&[bool], Option<&Level>),
    number: usize,
    first_triangle: u64,
    finished: &(dyn Fn(usize) + Sync),
) -> Result<BuiltPiece, ConvertError> {
    let Welded { mesh, ids, attributes, .. } = context.pieces.read(number)?;
    let shared_vertices = borders::shared(&mesh.positions, &borders::overlaps(&context.boxes, number));
    let emitters = emitters(shines, &mesh);
    let mut built = raystrips_strips::build(&mesh, &context.params.strips, finished);
    order_vertices(context.params.layout, &mut built.clusters);
    let (assembled, ids) = finish(context, &built, &ids, RadiusCode::default(), first_triangle)?;
    let attributes = attributes.of_pages(&built, &assembled.pages);
    drop(built);
    let own_vertices = (mesh.positions.len() - shared_vertices.len()) as u64;
    let simplify = |level: &Level| level.simplified(mesh, Vec::new(), number);
    let simplified = first_level.map(simplify).unwrap_or_default();
    Ok(BuiltPiece { assembled, emitters, ids, attributes, shared_vertices, own_vertices, simplified })
}

fn build_strands(
    context: &Context,
    (radii, thinning): (RadiusCode, Option<StrandThinning>),
    number: usize,
    first_segment: u64,
    finished: &(dyn Fn(usize) + Sync),
) -> Result<BuiltPiece, ConvertError> {
    let PieceOfStrands { strands, ids } = PieceOfStrands::read(context.pieces, number, radii)?;
    let built = raystrips_strips::build_strands(&strands, radii, finished);
    drop(strands);
    let (assembled, ids) = finish(context, &built, &ids, radii, first_segment)?;
    drop(built);
    let mut simplified = Simplified::default();
    if let Some(thinning) = thinning {
        context.pieces.for_each_part(number, |bytes| {
            Block::all(bytes).try_for_each(|block| {
                simplified.add_strands(&block?, thinning, StrandThinning::default());
                Ok(())
            })
        })?;
    }
    // Points that pieces share are counted by the import.
    let (emitters, shared_vertices) = (Vec::new(), Vec::new());
    let attributes = (vec![BlockEntry::default(); assembled.pages.len()], Vec::new());
    Ok(BuiltPiece { assembled, emitters, ids, attributes, shared_vertices, own_vertices: 0, simplified })
}

/// Pages and stored ids of a built piece.
fn finish(
    context: &Context,
    built: &StripTree,
    ids: &[u64],
    radii: RadiusCode,
    first_primitive: u64,
) -> Result<(Assembled, Vec<u8>), ConvertError> {
    let style = PageStyle { size: context.params.page_size as usize, layout: context.params.layout, radii };
    let ids = if context.id_bytes > 0 { encode_ids(built, ids, context.id_bytes) } else { Vec::new() };
    let assembled = assemble(built, style, first_primitive).map_err(ConvertError::write(context.output))?;
    Ok((assembled, ids))
}
