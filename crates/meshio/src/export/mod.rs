//! Writes a mesh as PLY, OBJ or GLB, and strands as OBJ or hair.

mod glb;
mod hair;
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
    /// Geometry of each strand, and its points with their radii.
    pub strands: &'a [(u32, Vec<(Vec3, f32)>)],
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
    /// With the names of materials, but no library of them; strands are lines without a width.
    Obj,
    /// With a primitive and a material for each geometry.
    Glb,
    /// Strands alone, with the color of the first one.
    Hair,
}

impl ExportFormat {
    /// Whether strands can be written.
    pub fn has_strands(self) -> bool {
        matches!(self, ExportFormat::Obj | ExportFormat::Hair)
    }

    /// Whether triangles can be written.
    pub fn has_triangles(self) -> bool {
        self != ExportFormat::Hair
    }

    /// The format that the ending of a file's name tells.
    pub fn of(path: &Path) -> Option<ExportFormat> {
        match ending(path).as_str() {
            "ply" => Some(ExportFormat::Ply),
            "obj" => Some(ExportFormat::Obj),
            "glb" => Some(ExportFormat::Glb),
            "hair" => Some(ExportFormat::Hair),
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
        ExportFormat::Hair => hair::write(mesh, out),
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
                Geometry { name: "a".into(), material: 1, has_triangles: true },
                Geometry { name: "unused".into(), material: 0, has_triangles: true },
                Geometry { name: "b".into(), material: 0, has_triangles: true },
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
                strands: &[],
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

    #[test]
    fn strands_are_read_again() {
        let scene = SceneDesc {
            geometries: vec![Geometry::default()],
            materials: vec![Material { base_color: [0.5, 0.25, 1.0], alpha: 0.5, ..Material::default() }],
            ..SceneDesc::default()
        };
        let strand = |count: u32| (0..count).map(|i| (Vec3::splat(i as f32), 0.5)).collect::<Vec<_>>();
        let strands = [(0, strand(3)), (0, strand(70_000)), (0, strand(2))];
        let mesh = ExportMesh {
            positions: &[],
            triangles: &[],
            geometries: &[],
            strands: &strands,
            offset: [1.0, 2.0, 3.0],
            scene: &scene,
        };
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.hair", "a.obj"] {
            let path = folder.path().join(name);
            let mut bytes = Vec::new();
            export(&mesh, ExportFormat::of(&path).unwrap(), &mut bytes).unwrap();
            std::fs::write(&path, bytes).unwrap();
            let mut sink = Collect::default();
            let options = ImportOptions { strand_width: Some(1.0), ..ImportOptions::default() };
            let done = import(&[path], &options, &mut sink).unwrap();
            assert_eq!(done.report.segments, 2 + 69_999 + 1, "{name}");
            assert_eq!(sink.1[0].positions[..3], [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [3.0, 4.0, 5.0]]);
            assert_eq!(sink.1[0].radii[0], 0.5);
            if name == "a.hair" {
                let material = &done.scene.materials[0];
                assert_eq!((material.base_color, material.alpha), ([0.5, 0.25, 1.0], 0.5));
            }
        }
    }
}
