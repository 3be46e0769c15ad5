//! One piece of a level: fewer triangles, as blocks for the next level.

use super::locks::Locks;
use super::method::{Preparation, to_piece};
use crate::ConvertError;
use crate::block::{self, Block, Contents};
use crate::distribute::Pieces;
use crate::mesh::Welded;
use crate::strands::StrandThinning;
use glam::Vec3;
use raystrips_simplify::{CostCurve, Piece, StoredQuadric, Target, simplify};
use raystrips_strips::Mesh;

/// Most positions of a block.
const BLOCK_POSITIONS: usize = 1 << 16;

/// A simplified piece.
#[derive(Default)]
pub(crate) struct Simplified {
    /// Blocks, those of triangles with quadrics.
    pub bytes: Vec<u8>,
    /// Triangles, or windows of strands.
    pub triangles: u64,
}

impl Simplified {
    /// Adds the strands of a block that stay, which were thinned by `before`.
    pub fn add_strands(&mut self, block: &Block, thinning: StrandThinning, before: StrandThinning) {
        let selected = thinning.apply(block, before);
        if selected.windows() > 0 {
            self.bytes.extend(selected.block(block.geometry(), block.first_id()));
            self.triangles += selected.windows();
        }
    }
}

/// How the pieces of a level are read and which of their vertices stay.
pub(crate) struct Reading<'a> {
    pub locks: &'a Locks,
    pub preparation: Preparation,
}

impl Reading<'_> {
    /// Simplifies piece `number`, with the quadrics of its vertices if it was simplified before. Vertices that other
    /// pieces have too stay where they are.
    pub fn simplified(
        &self,
        mesh: Mesh,
        quadrics: Vec<StoredQuadric>,
        number: usize,
        target: Target,
    ) -> Simplified {
        let simplified = simplify(self.piece(mesh, quadrics, number), target).piece;
        Simplified { triangles: simplified.triangles.len() as u64, bytes: blocks(&simplified) }
    }

    /// How many triangles of piece `number` are left by the cost, down to so many.
    pub fn curve(&self, pieces: &Pieces, number: usize, triangles: usize) -> Result<CostCurve, ConvertError> {
        let Welded { mesh, quadrics, .. } = pieces.read(number)?;
        Ok(simplify(self.piece(mesh, quadrics, number), Target::triangles(triangles)).curve)
    }

    fn piece(&self, mesh: Mesh, quadrics: Vec<StoredQuadric>, number: usize) -> Piece {
        let mut piece = self.preparation.merge(Piece { quadrics, ..to_piece(mesh) });
        piece.locked = self.locks.locked(&piece.positions, &piece.triangles, number);
        self.preparation.thin(&mut piece);
        piece
    }
}

/// The triangles of a piece as blocks, one geometry after the other.
fn blocks(piece: &Piece) -> Vec<u8> {
    let mut order: Vec<u32> = (0..piece.triangles.len() as u32).collect();
    order.sort_by_key(|&triangle| piece.geometries[triangle as usize]);
    let mut writer = Writer {
        piece,
        quadrics: piece.quadrics.clone(),
        numbers: vec![(0, 0); piece.positions.len()],
        block: 1,
        positions: Vec::new(),
        own_quadrics: Vec::new(),
        triangles: Vec::new(),
        bytes: Vec::new(),
    };
    for run in order.chunk_by(|&a, &b| piece.geometries[a as usize] == piece.geometries[b as usize]) {
        let geometry = piece.geometries[run[0] as usize];
        for &triangle in run {
            if writer.positions.len() + 3 > BLOCK_POSITIONS {
                writer.end_block(geometry);
            }
            writer.add(piece.triangles[triangle as usize]);
        }
        writer.end_block(geometry);
    }
    writer.bytes
}

struct Writer<'a> {
    piece: &'a Piece,
    /// Those of vertices that are in no block yet: the quadrics of a vertex are going to be added up.
    quadrics: Vec<StoredQuadric>,
    /// For each vertex the block that had it last, and its place there.
    numbers: Vec<(u32, u32)>,
    block: u32,
    positions: Vec<Vec3>,
    own_quadrics: Vec<StoredQuadric>,
    triangles: Vec<[u32; 3]>,
    bytes: Vec<u8>,
}

impl Writer<'_> {
    fn add(&mut self, triangle: [u32; 3]) {
        let corners = triangle.map(|v| {
            let entry = &mut self.numbers[v as usize];
            if entry.0 != self.block {
                *entry = (self.block, self.positions.len() as u32);
                self.positions.push(self.piece.positions[v as usize]);
                self.own_quadrics.push(self.quadrics[v as usize].take());
            }
            entry.1
        });
        self.triangles.push(corners);
    }

    fn end_block(&mut self, geometry: u32) {
        self.bytes.extend(block::of_triangles(&Contents {
            geometry,
            positions: &self.positions,
            triangles: &self.triangles,
            quadrics: &self.own_quadrics,
            ..Contents::default()
        }));
        self.block += 1;
        self.positions.clear();
        self.own_quadrics.clear();
        self.triangles.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_have_every_triangle_and_every_quadric_once() {
        // Two rows of triangles of two geometries, more than a block holds.
        let columns = 50_000u32;
        let positions = (0..3 * columns).map(|i| Vec3::new((i / 3) as f32, (i % 3) as f32, 0.0)).collect();
        let row = |y: u32| (0..columns - 1).map(move |x| [3 * x + y, 3 * x + 3 + y, 3 * x + y + 1]);
        let welded = |bytes: &[u8]| {
            let mut welded = Welded::with_capacity(0);
            welded.add(bytes).unwrap();
            welded
        };
        let piece = Piece {
            positions,
            triangles: row(0).chain(row(1)).collect(),
            geometries: (0..2 * (columns - 1)).map(|i| i % 2).collect(),
            ..Piece::default()
        };
        let simplified = simplify(piece, Target::triangles(usize::MAX)).piece;
        let read = welded(&blocks(&simplified));
        let corners = |positions: &[Vec3], triangles: &[[u32; 3]]| {
            let mut corners: Vec<[[u32; 3]; 3]> = triangles
                .iter()
                .map(|t| t.map(|v| positions[v as usize].to_array().map(f32::to_bits)))
                .collect();
            corners.sort_unstable();
            corners
        };
        assert_eq!(
            corners(&read.mesh.positions, &read.mesh.triangles),
            corners(&simplified.positions, &simplified.triangles)
        );
        let weight = |quadrics: &[StoredQuadric]| quadrics.iter().map(|q| f64::from(q.weight())).sum::<f64>();
        let (before, after) = (weight(&simplified.quadrics), weight(&read.quadrics));
        assert!((before - after).abs() < 1e-5 * before && before > 0.0, "{before} {after}");
    }
}
