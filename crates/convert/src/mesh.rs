//! Batches to one mesh: equal positions made one vertex, triangles without area left out.

use crate::positions::ToPack;
use glam::{DVec3, Vec3};
use raystrips_meshio::TriangleBatch;
use raystrips_strips::{Mesh, StripTree};
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// A mesh with where its triangles come from.
pub(crate) struct Welded {
    pub mesh: Mesh,
    /// Number in the input of each triangle.
    pub ids: Vec<u64>,
    /// Triangles left out for want of an area.
    pub degenerate: u64,
}

/// Welds `batches`, in their order.
pub(crate) fn weld(batches: Vec<TriangleBatch>, to_pack: &mut ToPack) -> Welded {
    let mut numbers: HashMap<[u32; 3], u32, BuildHasherDefault<PositionHasher>> = HashMap::default();
    let mut welded = Welded { mesh: Mesh::default(), ids: Vec::new(), degenerate: 0 };
    let Welded { mesh, ids, degenerate } = &mut welded;
    for batch in batches {
        let vertices: Vec<u32> = batch
            .positions
            .iter()
            .map(|&p| {
                let position = to_pack.place(p);
                *numbers.entry(position.to_array().map(f32::to_bits)).or_insert_with(|| {
                    mesh.positions.push(position);
                    (mesh.positions.len() - 1) as u32
                })
            })
            .collect();
        for (corners, id) in batch.triangles.iter().zip(batch.first_triangle_id..) {
            let triangle = corners.map(|v| vertices[v as usize]);
            if has_area(triangle.map(|v| mesh.positions[v as usize])) {
                mesh.triangles.push(triangle);
                mesh.geometries.push(batch.geometry);
                ids.push(id);
            } else {
                *degenerate += 1;
            }
        }
    }
    welded
}

/// False where two corners coincide or all three are on a line, as exactly as f64 can tell.
fn has_area([a, b, c]: [Vec3; 3]) -> bool {
    let (ab, ac) = (b.as_dvec3() - a.as_dvec3(), c.as_dvec3() - a.as_dvec3());
    ab.cross(ac) != DVec3::ZERO && b != c
}

/// Ids of the triangles in the order of the pack, as stored: four times the number in the input plus the input
/// corner that comes first in the pack; in 4 bytes each if they fit, else in 8. Gives the bytes of one, too.
pub(crate) fn encode_ids(built: &StripTree, ids: &[u64]) -> (Vec<u8>, u8) {
    let sources = built.clusters.iter().flat_map(|c| &c.strips).flat_map(|s| &s.sources);
    let stored = sources.map(|s| ids[s.triangle as usize] << 2 | u64::from(s.first_corner));
    let width = if ids.iter().all(|&id| id < 1 << 30) { 4 } else { 8 };
    (stored.flat_map(|id| id.to_le_bytes().into_iter().take(width)).collect(), width as u8)
}

/// Mixes the bits of positions: three words at a time, not made for hostile input, which can only slow it.
#[derive(Default)]
struct PositionHasher(u64);

impl Hasher for PositionHasher {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 29
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(4) {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u32(u32::from_le_bytes(word));
        }
    }

    fn write_u32(&mut self, word: u32) {
        self.0 = (self.0.rotate_left(23) ^ u64::from(word)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    fn write_usize(&mut self, _length: usize) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offset::Placement;
    use crate::positions::Positions;

    #[test]
    fn equal_positions_are_one_vertex_and_flat_triangles_go() {
        let batch = |first_triangle_id| TriangleBatch {
            geometry: 3,
            positions: vec![
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, -0.0],
                [2.0, 0.0, 0.0],
                [0.0, -0.0, 0.0],
            ],
            triangles: vec![[0, 1, 2], [0, 1, 3], [0, 4, 2], [1, 3, 2]],
            first_triangle_id,
        };
        let placement = Placement { offset: [0.0; 3], size: 2.0 };
        let mut to_pack = ToPack::new(&placement, Positions::Exact);
        let welded = weld(vec![batch(0), batch(4)], &mut to_pack);
        assert_eq!(welded.mesh.positions.len(), 4);
        assert_eq!(welded.mesh.triangles, [[0, 1, 2], [1, 3, 2], [0, 1, 2], [1, 3, 2]]);
        assert_eq!(welded.mesh.geometries, [3; 4]);
        assert_eq!(welded.ids, [0, 3, 4, 7]);
        assert_eq!(welded.degenerate, 4);
    }
}
