//! Meshes as files: how the programs that are compared hand them over.

use anyhow::{Context, Result};
use glam::{DVec3, Vec3};
use raystrips_geom::scene::{Geometry, Material, SceneDesc};
use raystrips_meshio::{
    ExportFormat, ExportMesh, ImportOptions, TriangleBatch, TriangleSink, export, import,
};
use raystrips_simplify::{Piece, weld};
use std::collections::HashMap;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Triangles that share vertices.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub geometries: Vec<u32>,
}

impl Mesh {
    /// Reads a model and makes positions that are equal one vertex.
    pub fn read(path: &Path) -> Result<Mesh> {
        let mut sink = Sink::default();
        import(&[PathBuf::from(path)], &ImportOptions::default(), &mut sink)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let Piece { positions, triangles, geometries, .. } = weld(&sink.0);
        Ok(Mesh { positions, triangles, geometries })
    }

    /// Writes it as PLY.
    pub fn write(&self, path: &Path) -> Result<()> {
        let scene = SceneDesc {
            geometries: vec![Geometry::default()],
            materials: vec![Material::default()],
            ..SceneDesc::default()
        };
        let mesh = ExportMesh {
            positions: &self.positions,
            triangles: &self.triangles,
            geometries: &vec![0; self.triangles.len()],
            strands: &[],
            offset: [0.0; 3],
            scene: &scene,
        };
        let mut out = BufWriter::new(std::fs::File::create(path)?);
        export(&mesh, ExportFormat::Ply, &mut out)?;
        Ok(out.flush()?)
    }

    /// What distances are measured between.
    pub fn surface(&self) -> (&[Vec3], &[[u32; 3]]) {
        (&self.positions, &self.triangles)
    }

    /// Edges that have an odd number of triangles: none if the mesh is closed.
    pub fn open_edges(&self) -> usize {
        let mut counts: HashMap<[u32; 2], u32> = HashMap::new();
        for &[a, b, c] in &self.triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                *counts.entry([p.min(q), p.max(q)]).or_default() += 1;
            }
        }
        counts.values().filter(|&&count| count % 2 == 1).count()
    }
}

/// Takes in the batches of a model.
#[derive(Default)]
struct Sink(Piece);

impl TriangleSink for Sink {
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()> {
        let first = self.0.positions.len() as u32;
        self.0.positions.extend(batch.positions.iter().map(|p| DVec3::from_array(*p).as_vec3()));
        self.0.geometries.extend(batch.triangles.iter().map(|_| batch.geometry));
        self.0.triangles.extend(batch.triangles.iter().map(|t| t.map(|v| first + v)));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            geometries: vec![0; 4],
        };
        assert_eq!(mesh.open_edges(), 0);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        mesh.write(&path).unwrap();
        let mut read = Mesh::read(&path).unwrap();
        assert_eq!((read.positions.len(), read.triangles.len(), read.open_edges()), (4, 4, 0));
        read.triangles.pop();
        assert_eq!(read.open_edges(), 3);
    }
}
