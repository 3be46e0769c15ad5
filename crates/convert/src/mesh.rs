//! Blocks of a piece to one mesh: equal positions made one vertex.

use crate::attributes::CornerAttributes;
use crate::block::Block;
use crate::hash::FastMap;
use glam::{DVec3, Vec3};
use raystrips_simplify::StoredQuadric;
use raystrips_strips::{Mesh, StripTree};
use std::io;

/// A mesh with where its triangles come from.
#[derive(Default)]
pub(crate) struct Welded {
    pub mesh: Mesh,
    /// Number in the input of each triangle; empty if ids are not kept.
    pub ids: Vec<u64>,
    /// Quadric of each vertex: the sum of those that it comes with; empty if the mesh is as it was imported.
    pub quadrics: Vec<StoredQuadric>,
    /// Of the corners of the triangles.
    pub attributes: CornerAttributes,
    numbers: FastMap<[u32; 3], u32>,
}

impl Welded {
    /// Nothing yet, with room for so many triangles.
    pub fn with_capacity(triangles: usize) -> Welded {
        let mut welded = Welded::default();
        // A closed mesh has half as many vertices as triangles.
        welded.numbers.reserve(triangles / 2);
        welded.mesh.positions.reserve(triangles / 2);
        welded.mesh.triangles.reserve_exact(triangles);
        welded.mesh.geometries.reserve_exact(triangles);
        welded
    }

    /// Adds all blocks in `bytes`.
    pub fn add(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut vertices = Vec::new();
        for block in Block::all(bytes) {
            let block = block?;
            self.attributes.add(&block, self.mesh.triangles.len());
            vertices.clear();
            vertices.extend(block.points().map(|point| self.vertex(point)));
            self.mesh
                .triangles
                .extend(block.triangles().map(|corners| corners.map(|v| vertices[v as usize])));
            self.mesh.geometries.resize(self.mesh.triangles.len(), block.geometry());
            self.ids.extend(block.ids());
            if block.is_simplified() {
                self.quadrics.resize(self.mesh.positions.len(), StoredQuadric::default());
                for (&vertex, quadric) in vertices.iter().zip(block.quadrics()) {
                    self.quadrics[vertex as usize] += quadric;
                }
            }
        }
        Ok(())
    }

    fn vertex(&mut self, position: Vec3) -> u32 {
        *self.numbers.entry(position.to_array().map(f32::to_bits)).or_insert_with(|| {
            self.mesh.positions.push(position);
            (self.mesh.positions.len() - 1) as u32
        })
    }

    /// Frees what only welding needed.
    pub fn finish(mut self) -> Welded {
        self.numbers = FastMap::default();
        self
    }
}

/// False where two corners coincide or all three are on a line, as exactly as f64 can tell.
pub(crate) fn has_area([a, b, c]: [Vec3; 3]) -> bool {
    let (ab, ac) = (b.as_dvec3() - a.as_dvec3(), c.as_dvec3() - a.as_dvec3());
    ab.cross(ac) != DVec3::ZERO && b != c
}

/// Bytes of a stored id: 4 if that is enough for all below `end`, else 8.
pub(crate) fn id_bytes(end: u64) -> u8 {
    if end <= 1 << 30 { 4 } else { 8 }
}

/// Ids of the triangles in the order of the pack, as stored: four times the number in the input plus the input
/// corner that comes first in the pack; in `width` bytes each.
pub(crate) fn encode_ids(built: &StripTree, ids: &[u64], width: u8) -> Vec<u8> {
    let sources = built.clusters.iter().flat_map(|c| &c.strips).flat_map(|s| &s.sources);
    let stored = sources.map(|s| ids[s.triangle as usize] << 2 | u64::from(s.first_corner));
    stored.flat_map(|id| id.to_le_bytes().into_iter().take(width.into())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{self, Contents};

    #[test]
    fn equal_positions_are_one_vertex_across_blocks() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let mut bytes = block::of_triangles(&Contents {
            geometry: 3,
            first_id: 10,
            positions: &corners,
            triangles: &[[0, 1, 2], [3, 2, 1]],
            places: &[4, 6],
            ..Contents::default()
        });
        bytes.extend(block::of_triangles(&Contents {
            geometry: 5,
            first_id: 90,
            positions: &[Vec3::Y, Vec3::X, Vec3::ONE],
            triangles: &[[0, 1, 2]],
            places: &[0],
            ..Contents::default()
        }));
        let mut welded = Welded::with_capacity(3);
        welded.add(&bytes).unwrap();
        let Welded { mesh, ids, .. } = welded.finish();
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 2, 1], [2, 1, 4]]);
        assert_eq!((mesh.geometries, ids), (vec![3, 3, 5], vec![14, 16, 90]));
    }

    #[test]
    fn flat_triangles_have_no_area() {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        assert!(has_area([at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1e-30)]));
        assert!(!has_area([at(0.0, 0.0), at(1.0, 0.0), at(2.0, 0.0)]));
        assert!(!has_area([at(0.0, 0.0), at(1.0, 1.0), at(1.0, 1.0)]));
    }
}
