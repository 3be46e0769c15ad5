//! Scenes of many refined parts: a file for each material, and as many triangles in all as are asked for.

use super::ply::PlyWriter;
use super::refine::{BaseMesh, Placement, Refinement, count, refine};
use super::relief::Relief;
use anyhow::Result;
use std::path::Path;

/// Tries to meet the number of triangles; each halves what the length of edges may be off.
const TRIES: u32 = 50;

/// A small mesh, what becomes of it, and the places where it stands.
pub struct Part {
    /// Number of its material.
    pub material: usize,
    /// The small mesh.
    pub base: BaseMesh,
    /// How round it is between its vertices; see [`Refinement`].
    pub roundness: f64,
    /// Its surface.
    pub relief: Relief,
    /// Length of its edges, in those of the scene.
    pub coarseness: f64,
    /// Where it stands.
    pub placements: Vec<Placement>,
}

impl Part {
    fn triangles(&self, edge: f64) -> u64 {
        count(&self.base, edge * self.coarseness) * self.placements.len() as u64
    }

    fn write(&self, edge: f64, writer: &mut PlyWriter) -> Result<()> {
        let edge = edge * self.coarseness;
        let refinement = Refinement { edge, roundness: self.roundness, relief: &self.relief };
        self.placements.iter().try_for_each(|placement| refine(&self.base, placement, &refinement, writer))
    }
}

/// Triangles of all parts, with edges of that length.
pub fn triangles(parts: &[Part], edge: f64) -> u64 {
    parts.iter().map(|part| part.triangles(edge)).sum()
}

/// The length of edges that makes about `wanted` triangles.
pub fn edge_for(parts: &[Part], wanted: u64) -> f64 {
    let [mut fine, mut coarse] = [1e-6f64, 1e3];
    for _ in 0..TRIES {
        let middle = (fine * coarse).sqrt();
        let side = if triangles(parts, middle) > wanted { &mut fine } else { &mut coarse };
        *side = middle;
    }
    coarse
}

/// Writes all parts, each to the file of its material. Tells the number of triangles.
pub fn write(parts: &[Part], edge: f64, folder: &Path, materials: &[&str]) -> Result<u64> {
    let mut made = 0;
    for (number, name) in materials.iter().enumerate() {
        let mut writer = PlyWriter::create(&folder.join(format!("{name}.ply")))?;
        let of_material = parts.iter().filter(|part| part.material == number);
        of_material.into_iter().try_for_each(|part| part.write(edge, &mut writer))?;
        made += writer.triangles();
        writer.finish()?;
    }
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn counts_are_met() {
        let base = BaseMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
        let placements = vec![Placement::IDENTITY; 500];
        let part =
            Part { material: 0, base, roundness: 0.0, relief: Relief::NONE, coarseness: 0.5, placements };
        for wanted in [1000, 100_000, 30_000_000] {
            let parts = std::slice::from_ref(&part);
            let made = triangles(parts, edge_for(parts, wanted));
            assert!(made <= wanted && made as f64 > 0.3 * wanted as f64, "{made} of {wanted}");
        }
    }
}
