//! Windows of a piece, or of all pieces, found beside the others of their strands again.

use crate::ConvertError;
use crate::block::{Block, StoredWindow};
use crate::distribute::Pieces;
use crate::proxy::Strand;
use glam::Vec3;
use raystrips_geom::RadiusCode;
use raystrips_strips::{StrandWindow, Strands};
use std::io;

/// A piece with where its segments come from.
#[derive(Default)]
pub(crate) struct PieceOfStrands {
    pub strands: Strands,
    /// Number in the input of each segment.
    pub ids: Vec<u64>,
}

impl PieceOfStrands {
    /// Reads piece `number`.
    pub fn read(pieces: &Pieces, number: usize, code: RadiusCode) -> Result<PieceOfStrands, ConvertError> {
        let mut piece = PieceOfStrands::default();
        pieces.for_each_part(number, |bytes| {
            Block::all(bytes).try_for_each(|block| {
                piece.add(&block?, code);
                Ok(())
            })
        })?;
        if piece.ids.len() as u64 != pieces.sources[number].primitives {
            let what = "strands are missing in a scratch file; try again";
            return Err(ConvertError::Scratch(io::Error::new(io::ErrorKind::InvalidData, what)));
        }
        Ok(piece)
    }

    fn add(&mut self, block: &Block, code: RadiusCode) {
        let strands = &mut self.strands;
        let base = strands.positions.len() as u32;
        strands.positions.extend(block.points());
        strands.radii.extend(block.radii().map(|radius| code.encode(radius)));
        for window in block.windows() {
            strands.windows.push(StrandWindow {
                first: base + u32::from(window.first),
                segments: window.segments as u8,
                geometry: block.geometry(),
            });
            let first = block.first_id() + u64::from(window.segment);
            self.ids.extend(first..first + u64::from(window.segments));
        }
    }
}

/// Windows of any pieces in the order of the input.
#[derive(Default)]
pub(crate) struct SortedStrands {
    windows: Vec<Window>,
}

struct Window {
    /// Number in the input of its first segment, and of the first one of its strand.
    segment: u64,
    strand: u64,
    geometry: u32,
    points: Vec<(Vec3, f32)>,
}

impl SortedStrands {
    /// Adds all blocks in `bytes`.
    pub fn add(&mut self, bytes: &[u8]) -> io::Result<()> {
        for block in Block::all(bytes) {
            let block = block?;
            let positions = block.points();
            let points: Vec<(Vec3, f32)> = positions.zip(block.radii()).collect();
            let id = |place: u16| block.first_id() + u64::from(place);
            self.windows.extend(block.windows().map(|StoredWindow { first, segments, segment, strand }| {
                Window {
                    segment: id(segment),
                    strand: id(strand),
                    geometry: block.geometry(),
                    points: points[first.into()..=usize::from(first + segments)].to_vec(),
                }
            }));
        }
        Ok(())
    }

    /// The strands, each with its geometry.
    pub fn finish(mut self) -> Vec<Strand> {
        self.windows.sort_by_key(|window| window.segment);
        let mut strands: Vec<Strand> = Vec::new();
        let mut last = None;
        for window in self.windows {
            match strands.last_mut() {
                Some((_, points)) if last == Some(window.strand) => points.extend(&window.points[1..]),
                _ => strands.push((window.geometry, window.points)),
            }
            last = Some(window.strand);
        }
        strands
    }
}
