//! Triangles that share vertices: what all structures are built from.

use glam::Vec3;
use raystrips_geom::Aabb;
use raystrips_tracer::Scene;
use std::collections::HashMap;

/// A mesh with a global list of vertices.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Corners as vertices.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The triangles of a pack in its order, so that every structure gets the same good order to begin with.
    /// Positions of the same bits are one vertex.
    pub fn of_scene(scene: &Scene) -> Mesh {
        let mut mesh = Mesh::default();
        let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
        for (_, corners) in scene.triangles() {
            let corners = corners.map(|p| {
                *numbers.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                    mesh.positions.push(p);
                    (mesh.positions.len() - 1) as u32
                })
            });
            mesh.triangles.push(corners);
        }
        mesh
    }

    /// Corners of triangle `i`.
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        self.triangles[i].map(|v| self.positions[v as usize])
    }

    /// Box around each triangle.
    pub fn boxes(&self) -> Vec<Aabb> {
        (0..self.triangles.len()).map(|i| Aabb::of_points(self.corners(i))).collect()
    }
}
