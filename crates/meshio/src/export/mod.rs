//! Writes a mesh as PLY, OBJ or GLB.

mod glb;
mod obj;
mod ply;

use crate::import::ending;
use glam::{DVec3, Vec3};
use raystrips_geom::scene::SceneDesc;
use std::io::{self, Write};
use std::path::Path;

/// A mesh to write.
#[derive(Clone, Copy, Debug)]
pub struct ExportMesh<'a> {
    /// Vertices, less [`ExportMesh::offset`].
    pub positions: &'a [Vec3],
    /// Corners as vertices.
    pub triangles: &'a [[u32; 3]],
    /// Geometry of each triangle.
    pub geometries: &'a [u32],
    /// What to add to all positions.
    pub offset: [f64; 3],
    /// Names and materials of the geometries.
    pub scene: &'a SceneDesc,
}

/// A format to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// Binary, little-endian; positions are f64 if there is an offset. All geometries in one.
    Ply,
    /// With the names of materials, but no library of them.
    Obj,
    /// With a primitive and a material for each geometry.
    Glb,
}

impl ExportFormat {
    /// The format that the ending of a file's name tells.
    pub fn of(path: &Path) -> Option<ExportFormat> {
        match ending(path).as_str() {
            "ply" => Some(ExportFormat::Ply),
            "obj" => Some(ExportFormat::Obj),
            "glb" => Some(ExportFormat::Glb),
            _ => None,
        }
    }
}

/// Writes `mesh` to `out`, which should be buffered.
pub fn export(mesh: &ExportMesh, format: ExportFormat, out: &mut dyn Write) -> io::Result<()> {
    match format {
        ExportFormat::Ply => ply::write(mesh, out),
        ExportFormat::Obj => obj::write(mesh, out),
        ExportFormat::Glb => glb::write(mesh, out),
    }
}

impl ExportMesh<'_> {
    /// Positions with the offset added.
    fn world_positions(&self) -> impl Iterator<Item = DVec3> {
        let offset = DVec3::from_array(self.offset);
        self.positions.iter().map(move |p| p.as_dvec3() + offset)
    }

    /// Runs of triangles of one geometry, by geometry, in the order of the scene; empty ones are left out.
    fn by_geometry(&self) -> Vec<(usize, Vec<[u32; 3]>)> {
        let mut triangles: Vec<Vec<[u32; 3]>> = vec![Vec::new(); self.scene.geometries.len()];
        for (triangle, &geometry) in self.triangles.iter().zip(self.geometries) {
            triangles[geometry as usize].push(*triangle);
        }
        triangles.into_iter().enumerate().filter(|(_, triangles)| !triangles.is_empty()).collect()
    }

    /// Name of the material of a geometry.
    fn material_name(&self, geometry: usize) -> &str {
        &self.scene.materials[self.scene.geometries[geometry].material as usize].name
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Collect;
    use crate::{ImportOptions, import};
    use raystrips_geom::scene::{Geometry, Material};

    #[test]
    fn what_is_written_is_read_again() {
        let material =
            |name: &str, base_color| Material { name: name.into(), base_color, ..Material::default() };
        let scene = SceneDesc {
            geometries: vec![
                Geometry { name: "a".into(), material: 1 },
                Geometry { name: "unused".into(), material: 0 },
                Geometry { name: "b".into(), material: 0 },
            ],
            materials: vec![material("red", [1.0, 0.0, 0.25]), material("green \"1\"", [0.0, 1.0, 0.0])],
            ..SceneDesc::default()
        };
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.1, 0.2, 1e-7)];
        let (triangles, geometries) = ([[0, 1, 2], [0, 3, 1], [1, 3, 2]], [2, 0, 2]);
        let folder = tempfile::tempdir().unwrap();
        for offset in [[0.0; 3], [5e6, 0.0, -4e5]] {
            let mesh = ExportMesh {
                positions: &positions,
                triangles: &triangles,
                geometries: &geometries,
                offset,
                scene: &scene,
            };
            let world = |v: u32| (positions[v as usize].as_dvec3() + DVec3::from_array(offset)).to_array();
            for name in ["a.ply", "a.obj", "a.glb"] {
                let path = folder.path().join(name);
                let mut bytes = Vec::new();
                export(&mesh, ExportFormat::of(&path).unwrap(), &mut bytes).unwrap();
                std::fs::write(&path, bytes).unwrap();
                let mut sink = Collect::default();
                let import = import(&[path], &ImportOptions::default(), &mut sink).unwrap();
                let mut found: Vec<[[f64; 3]; 3]> =
                    sink.triangles().into_iter().map(|(_, corners)| corners).collect();
                let mut expected: Vec<[[f64; 3]; 3]> = triangles.iter().map(|t| t.map(world)).collect();
                let key = |t: &[[f64; 3]; 3]| t.map(|p| p.map(f64::to_bits));
                found.sort_by_key(key);
                expected.sort_by_key(key);
                assert_eq!(found, expected, "{name}");
                if name != "a.ply" {
                    let names: Vec<&str> = import.scene.materials.iter().map(|m| m.name.as_str()).collect();
                    assert!(names.contains(&"red") && names.contains(&"green \"1\""), "{name}: {names:?}");
                }
            }
        }
    }
}
