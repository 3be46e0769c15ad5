//! Meshes of files, to be refined in place of the statue.

use crate::scene::refine::BaseMesh;
use anyhow::{Context, Result};
use glam::DVec3;
use raystrips_meshio::{ImportOptions, TriangleBatch, TriangleSink, import};
use std::collections::HashMap;
use std::path::Path;

/// Reads all triangles; vertices at the same position are one.
pub fn read(path: &Path) -> Result<BaseMesh> {
    let mut gathered = Gathered::default();
    import(&[path.to_owned()], &ImportOptions::default(), &mut gathered)?;
    let mesh = BaseMesh::new(gathered.positions, gathered.triangles);
    (!mesh.triangles.is_empty())
        .then_some(mesh)
        .with_context(|| format!("{}: has no triangles; name a file that has some", path.display()))
}

#[derive(Default)]
struct Gathered {
    numbers: HashMap<[u64; 3], u32>,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Gathered {
    fn number_of(&mut self, position: [f64; 3]) -> u32 {
        // Adding 0 makes the two zeros one.
        let key = position.map(|x| (x + 0.0).to_bits());
        *self.numbers.entry(key).or_insert_with(|| {
            self.positions.push(DVec3::from_array(position));
            self.positions.len() as u32 - 1
        })
    }
}

impl TriangleSink for Gathered {
    fn batch(&mut self, batch: TriangleBatch) -> std::io::Result<()> {
        let numbers: Vec<u32> = batch.positions.iter().map(|&position| self.number_of(position)).collect();
        self.triangles.extend(batch.triangles.iter().map(|t| t.map(|v| numbers[v as usize])));
        Ok(())
    }
}
