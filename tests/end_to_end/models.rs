//! Small models, written in each format by hand.

use serde_json::{Value, json};
use std::collections::HashMap;
use std::fmt::Write;

/// The file `paints.mtl` of [`Mesh::obj`].
pub const PAINTS: &str = "newmtl red\nKd 0.9 0.1 0.1\nnewmtl green\nKd 0.1 0.9 0.1\n";

/// Triangles with corners in f64, which all formats but GLB can hold.
#[derive(Clone, Default)]
pub struct Mesh {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// A closed box from the origin to `size`, 12 triangles wound counterclockwise seen from outside.
    pub fn cuboid(size: [f64; 3]) -> Mesh {
        let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { size[axis] } else { 0.0 });
        let triangles = [
            [0, 4, 6],
            [0, 6, 2],
            [1, 3, 7],
            [1, 7, 5],
            [0, 1, 5],
            [0, 5, 4],
            [2, 6, 7],
            [2, 7, 3],
            [0, 2, 3],
            [0, 3, 1],
            [4, 5, 7],
            [4, 7, 6],
        ];
        Mesh { vertices: (0..8).map(corner).collect(), triangles: triangles.into() }
    }

    /// A height field over `side` x `side` squares: vertex (i, j) is at `place(i, j)`. Each square is cut from
    /// (i + 1, j) to (i, j + 1).
    pub fn height_field(side: u32, place: impl Fn(u32, u32) -> [f64; 3]) -> Mesh {
        let row = side + 1;
        let vertices = (0..row * row).map(|k| place(k % row, k / row)).collect();
        let square = |k: u32| {
            let corner = k / side * row + k % side;
            [[corner, corner + 1, corner + row], [corner + 1, corner + row + 1, corner + row]]
        };
        Mesh { vertices, triangles: (0..side * side).flat_map(square).collect() }
    }

    /// A hilly height field over the unit square per unit of `side`.
    pub fn hills(side: u32) -> Mesh {
        let height = |x: f64, y: f64| 2.0 * (x * 0.37).sin() * (y * 0.23).cos() + (x * 1.7 + y).sin() * 0.3;
        Mesh::height_field(side, |i, j| {
            let (x, y) = (f64::from(i), f64::from(j));
            // What the f32 of a file can hold.
            [x, y, height(x, y)].map(|c| f64::from(c as f32))
        })
    }

    /// A closed, bumpy ring of `side` x `side` squares.
    pub fn ring(side: u32) -> Mesh {
        let place = |k: u32| {
            let angle = |i: u32| f64::from(i) / f64::from(side) * std::f64::consts::TAU;
            let (a, b) = (angle(k % side), angle(k / side));
            let thick = 0.4 + 0.02 * (9.0 * a).sin() * (7.0 * b).sin();
            let out = 1.0 + thick * b.cos();
            [out * a.cos(), out * a.sin(), thick * b.sin()].map(|c| f64::from(c as f32))
        };
        let vertex = |i: u32, j: u32| j % side * side + i % side;
        let square = |k: u32| {
            let (i, j) = (k % side, k / side);
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        Mesh {
            vertices: (0..side * side).map(place).collect(),
            triangles: (0..side * side).flat_map(square).collect(),
        }
    }

    /// The triangles of an OBJ as the program writes it. Equal places are one vertex.
    pub fn of_obj(text: &str) -> Mesh {
        let mut numbers = HashMap::new();
        let mut mesh = Mesh::default();
        let mut vertices = Vec::new();
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                ["v", x, y, z] => {
                    let next = mesh.vertices.len() as u32;
                    let number = *numbers.entry([x, y, z]).or_insert(next);
                    if number == next {
                        mesh.vertices.push([x, y, z].map(|c| c.parse().unwrap()));
                    }
                    vertices.push(number);
                }
                ["f", a, b, c] => {
                    mesh.triangles.push([a, b, c].map(|v| vertices[v.parse::<usize>().unwrap() - 1]));
                }
                _ => {}
            }
        }
        mesh
    }

    /// Edges of one triangle.
    pub fn open_edges(&self) -> usize {
        let mut counts = HashMap::new();
        for [a, b, c] in &self.triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                *counts.entry([p.min(q), p.max(q)]).or_insert(0) += 1;
            }
        }
        counts.values().filter(|count| **count == 1).count()
    }

    /// Area of all triangles.
    pub fn area(&self) -> f64 {
        let area = |i: usize| {
            let [a, b, c] = self.corners(i);
            let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
            let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            0.5 * cross.iter().map(|c| c * c).sum::<f64>().sqrt()
        };
        (0..self.triangles.len()).map(area).sum()
    }

    /// Small triangles anywhere in a cube, which share nothing.
    pub fn soup(count: u32) -> Mesh {
        let number = |i: u32| {
            let hash = i.wrapping_mul(0x9e37_79b9);
            let hash = (hash ^ hash >> 15).wrapping_mul(0x85eb_ca6b);
            f64::from((hash ^ hash >> 13) >> 8) / f64::from(1 << 24)
        };
        let corner =
            |i: u32| [3 * i, 3 * i + 1, 3 * i + 2].map(|k| number(k / 9 * 9 + k % 3) + 0.01 * number(k));
        let vertices = (0..3 * count).map(|i| corner(i).map(|c| f64::from(c as f32))).collect();
        Mesh { vertices, triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect() }
    }

    /// As Wavefront OBJ. `materials` cuts the triangles into runs: number of the first triangle, and a name in
    /// `paints.mtl`.
    pub fn obj(&self, materials: &[(usize, &str)]) -> String {
        let mut text = if materials.is_empty() { String::new() } else { "mtllib paints.mtl\n".to_owned() };
        for [x, y, z] in &self.vertices {
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
        for (i, triangle) in self.triangles.iter().enumerate() {
            for (_, name) in materials.iter().filter(|(first, _)| *first == i) {
                writeln!(text, "usemtl {name}").unwrap();
            }
            let [a, b, c] = triangle.map(|v| v + 1);
            writeln!(text, "f {a} {b} {c}").unwrap();
        }
        text
    }

    /// As binary little-endian PLY with f32 positions.
    pub fn ply(&self) -> Vec<u8> {
        self.ply_with("float", |c| (c as f32).to_le_bytes().to_vec())
    }

    /// As binary little-endian PLY with f64 positions.
    pub fn ply_f64(&self) -> Vec<u8> {
        self.ply_with("double", |c| c.to_le_bytes().to_vec())
    }

    fn ply_with(&self, number: &str, encode: impl Fn(f64) -> Vec<u8>) -> Vec<u8> {
        let mut header = "ply\nformat binary_little_endian 1.0\n".to_owned();
        writeln!(header, "element vertex {}", self.vertices.len()).unwrap();
        ["x", "y", "z"].iter().for_each(|axis| writeln!(header, "property {number} {axis}").unwrap());
        writeln!(header, "element face {}", self.triangles.len()).unwrap();
        writeln!(header, "property list uchar int vertex_indices\nend_header").unwrap();
        let mut bytes = header.into_bytes();
        bytes.extend(self.vertices.iter().flatten().flat_map(|&c| encode(c)));
        for triangle in &self.triangles {
            bytes.push(3);
            bytes.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
        }
        bytes
    }

    /// As binary glTF. The triangles are one mesh of one node, which `node` may add keys to; `extra` are keys of
    /// the document, like cameras, and nodes after the first one.
    pub fn glb(&self, node: Value, more_nodes: &[Value], extra: Value) -> Vec<u8> {
        let mut binary: Vec<u8> =
            self.vertices.iter().flatten().flat_map(|&c| (c as f32).to_le_bytes()).collect();
        let positions = binary.len();
        binary.extend(self.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()));
        let bound = |pick: fn(f64, f64) -> f64| {
            [0, 1, 2].map(|axis| self.vertices.iter().map(|v| v[axis]).reduce(pick).unwrap())
        };
        let mut nodes = vec![merged(json!({"mesh": 0}), node)];
        nodes.extend_from_slice(more_nodes);
        let document = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
            "nodes": nodes,
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": self.vertices.len(), "type": "VEC3",
                 "min": bound(f64::min), "max": bound(f64::max)},
                {"bufferView": 1, "componentType": 5125, "count": 3 * self.triangles.len(), "type": "SCALAR"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": positions},
                {"buffer": 0, "byteOffset": positions, "byteLength": binary.len() - positions},
            ],
            "buffers": [{"byteLength": binary.len()}],
        });
        let mut json = merged(document, extra).to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let chunk = |kind: &[u8; 4], bytes: &[u8]| {
            [&(bytes.len() as u32).to_le_bytes(), kind.as_slice(), bytes].concat()
        };
        let body = [chunk(b"JSON", &json), chunk(b"BIN\0", &binary)].concat();
        [b"glTF".as_slice(), &2u32.to_le_bytes(), &(12 + body.len() as u32).to_le_bytes(), &body].concat()
    }
}

fn merged(mut object: Value, more: Value) -> Value {
    if let (Value::Object(object), Value::Object(more)) = (&mut object, more) {
        object.extend(more);
    }
    object
}
