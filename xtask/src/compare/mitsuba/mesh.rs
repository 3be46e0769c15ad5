//! Meshes of the scenes, and the OBJ files that both renderers read.

use crate::output::write_whole;
use anyhow::Result;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write;
use std::path::Path;

/// A corner of triangles.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vertex {
    pub position: DVec3,
    pub normal: DVec3,
    /// Right and up in the texture.
    pub uv: DVec2,
}

/// Triangles, counterclockwise as seen from the front.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<[u32; 3]>,
    /// Normals of vertices count.
    pub is_smooth: bool,
}

impl Mesh {
    /// A surface over the unit square, in `columns` x `rows` cells.
    fn over_square(columns: u32, rows: u32, vertex: impl Fn(f64, f64) -> Vertex) -> Mesh {
        let mut mesh = Mesh { is_smooth: true, ..Mesh::default() };
        for row in 0..=rows {
            let v = f64::from(row) / f64::from(rows);
            let places = (0..=columns).map(|column| f64::from(column) / f64::from(columns));
            mesh.vertices.extend(places.map(|u| vertex(u, v)));
        }
        for row in 0..rows {
            for column in 0..columns {
                let [a, b] = [0, 1].map(|up| (row + up) * (columns + 1) + column);
                mesh.add_triangle([a, a + 1, b + 1]);
                mesh.add_triangle([a, b + 1, b]);
            }
        }
        mesh
    }

    /// Leaves out what has no area, as at the poles of a sphere.
    fn add_triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|corner| self.vertices[corner as usize].position);
        if (b - a).cross(c - a).length() > 1e-12 {
            self.triangles.push(corners);
        }
    }

    /// A flat square with its normal up, whose texture is repeated so often along each side.
    pub fn floor(side: f64, repeats: f64) -> Mesh {
        let axes = [DVec3::X * side, DVec3::NEG_Z * side];
        Mesh::parallelogram((axes[0] + axes[1]) * -0.5, axes, repeats)
    }

    /// A parallelogram from a corner along two sides, to the right and up in the texture.
    pub fn parallelogram(corner: DVec3, [right, up]: [DVec3; 2], repeats: f64) -> Mesh {
        let normal = right.cross(up).normalize();
        let vertex =
            |u, v| Vertex { position: corner + right * u + up * v, normal, uv: DVec2::new(u, v) * repeats };
        Mesh { is_smooth: false, ..Mesh::over_square(1, 1, vertex) }
    }

    /// A square lamp that shines down.
    pub fn lamp(middle: DVec3, side: f64) -> Mesh {
        let axes = [DVec3::X * side, DVec3::Z * side];
        Mesh::parallelogram(middle - (axes[0] + axes[1]) * 0.5, axes, 1.0)
    }

    /// A smooth sphere, its texture around its vertical axis.
    pub fn sphere(middle: DVec3, radius: f64) -> Mesh {
        Mesh::over_square(128, 64, |u, v| {
            let (sin, cos) = libm::sincos(TAU * u);
            let (height, width) = libm::sincos(PI * v - FRAC_PI_2);
            let normal = DVec3::new(width * sin, height, width * cos);
            Vertex { position: middle + normal * radius, normal, uv: DVec2::new(u, v) }
        })
    }

    /// A smooth ring around a vertical axis.
    pub fn torus(middle: DVec3, [radius, thickness]: [f64; 2], [around, across]: [f64; 2]) -> Mesh {
        Mesh::over_square(128, 64, |u, v| {
            let (sin, cos) = libm::sincos(TAU * u);
            let (height, width) = libm::sincos(TAU * v);
            let normal = DVec3::new(width * sin, height, width * cos);
            let position = middle + DVec3::new(sin, 0.0, cos) * radius + normal * thickness;
            Vertex { position, normal, uv: DVec2::new(u * around, v * across) }
        })
    }

    /// Adds all of another mesh of the same kind.
    pub fn append(&mut self, other: &Mesh) {
        let base = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|corner| base + corner)));
    }

    /// Writes an OBJ file whose triangles have the material `name` of `name.mtl`.
    pub fn write(&self, folder: &Path, name: &str) -> Result<()> {
        let mut text = format!("mtllib {name}.mtl\nusemtl {name}\n");
        let single = |v: DVec3| v.as_vec3();
        for vertex in &self.vertices {
            let (p, n) = (single(vertex.position), single(vertex.normal));
            writeln!(text, "v {} {} {}\nvt {} {}", p.x, p.y, p.z, vertex.uv.x as f32, vertex.uv.y as f32)?;
            if self.is_smooth {
                writeln!(text, "vn {} {} {}", n.x, n.y, n.z)?;
            }
        }
        for corners in &self.triangles {
            let corner = |corner: u32| match (corner + 1, self.is_smooth) {
                (n, true) => format!("{n}/{n}/{n}"),
                (n, false) => format!("{n}/{n}"),
            };
            let [a, b, c] = corners.map(corner);
            writeln!(text, "f {a} {b} {c}")?;
        }
        write_whole(&folder.join(format!("{name}.obj")), text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fronts_are_where_normals_point() {
        let meshes = [
            Mesh::floor(2.0, 1.0),
            Mesh::lamp(DVec3::Y, 0.5),
            Mesh::sphere(DVec3::X, 0.7),
            Mesh::torus(DVec3::Y, [1.0, 0.3], [4.0, 2.0]),
        ];
        for mesh in meshes {
            for corners in &mesh.triangles {
                let [a, b, c] = corners.map(|corner| mesh.vertices[corner as usize]);
                let normal = (b.position - a.position).cross(c.position - a.position).normalize();
                assert!(normal.dot(a.normal) > 0.9, "{a:?}");
            }
        }
        assert!(Mesh::lamp(DVec3::Y, 0.5).vertices.iter().all(|vertex| vertex.normal.y < -0.99));
    }
}
