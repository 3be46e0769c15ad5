//! Makes a large mesh of a small one: triangles are split, and the points in between are curved and displaced.
//!
//! Every edge of the small mesh has its own number of segments, by its length, and every point on it depends on its
//! two ends alone. So triangles that share an edge meet without cracks, however each of them is split. Surfaces are
//! curved by Phong tessellation (Boubekeur, Alexa 2008) and displaced by a [`Relief`] along the normals.
//!
//! Triangles of the small mesh are split one after the other, each vertex being made where it is first used. What is
//! held is of the size of the small mesh; vertices and triangles that belong together are near to each other in what
//! is made.

mod base;
mod order;
mod patch;
mod split;

pub use base::BaseMesh;

use super::relief::Relief;
use super::sink::MeshSink;
use anyhow::Result;
use glam::{DMat3, DVec3};
use patch::{Corner, surface};
use split::{Split, segments};

/// Number of a vertex that is not made yet.
const NOT_MADE: u32 = u32::MAX;

/// Where a mesh stands.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    turn: DMat3,
    origin: DVec3,
}

impl Placement {
    /// Where it was made.
    pub const IDENTITY: Placement = Placement { turn: DMat3::IDENTITY, origin: DVec3::ZERO };

    /// Turned about the y axis, then moved.
    pub fn new(angle: f64, origin: DVec3) -> Placement {
        let (sin, cos) = libm::sincos(angle);
        let turn = DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos));
        Placement { turn, origin }
    }
}

/// How a mesh is refined.
#[derive(Clone, Copy, Debug)]
pub struct Refinement<'a> {
    /// Length of the edges to be made.
    pub edge: f64,
    /// How far surfaces bulge between vertices: 0 not at all, 1 as their normals tell.
    pub roundness: f64,
    /// What is added along the normals.
    pub relief: &'a Relief,
}

/// Triangles of `base` with edges of the length `edge`.
pub fn count(base: &BaseMesh, edge: f64) -> u64 {
    let segments = edge_segments(base, edge);
    base.face_edges.iter().map(|edges| Split::new(edges.map(|e| segments[e as usize])).triangles()).sum()
}

/// Puts the refined mesh into `sink`.
pub fn refine(
    base: &BaseMesh,
    placement: &Placement,
    refinement: &Refinement,
    sink: &mut impl MeshSink,
) -> Result<()> {
    let mut refiner = Refiner {
        base,
        placement,
        refinement,
        segments: edge_segments(base, refinement.edge),
        corners: vec![NOT_MADE; base.positions.len()],
        edges: vec![NOT_MADE; base.edges.len()],
        outline: Default::default(),
        triangles: Vec::new(),
    };
    (0..base.triangles.len()).try_for_each(|face| refiner.face(face, sink))
}

fn edge_segments(base: &BaseMesh, edge: f64) -> Vec<u32> {
    base.edge_lengths.iter().enumerate().map(|(number, length)| segments(length / edge, number)).collect()
}

struct Refiner<'a> {
    base: &'a BaseMesh,
    placement: &'a Placement,
    refinement: &'a Refinement<'a>,
    /// Segments of each edge.
    segments: Vec<u32>,
    /// The vertex made for each one of the base.
    corners: Vec<u32>,
    /// The first vertex made on each edge; the others follow.
    edges: Vec<u32>,
    /// Vertices around the triangle, from each corner up to the next.
    outline: [Vec<u32>; 3],
    triangles: Vec<[u32; 3]>,
}

impl Refiner<'_> {
    fn face(&mut self, face: usize, sink: &mut impl MeshSink) -> Result<()> {
        let corners = self.base.triangles[face];
        for corner in corners {
            if self.corners[corner as usize] == NOT_MADE {
                self.corners[corner as usize] = self.vertex(&[(corner, 1.0)], sink)?;
            }
        }
        for (side, edge) in self.base.face_edges[face].into_iter().enumerate() {
            self.side(side, edge, [corners[side], corners[(side + 1) % 3]], sink)?;
        }
        let split = Split::new([0, 1, 2].map(|side| self.outline[side].len() as u32 - 1));
        let mut first = NOT_MADE;
        for [a, b, c] in split.inner_weights() {
            let made = self.vertex(&[(corners[0], a), (corners[1], b), (corners[2], c)], sink)?;
            first = first.min(made);
        }
        self.triangles.clear();
        split.triangulate(&self.outline, first, &mut self.triangles);
        self.triangles.iter().try_for_each(|&triangle| sink.triangle(triangle))
    }

    /// Finds the vertices along a side, and makes them if no other triangle has.
    fn side(&mut self, side: usize, edge: u32, ends: [u32; 2], sink: &mut impl MeshSink) -> Result<()> {
        let count = self.segments[edge as usize];
        let [low, high] = self.base.edges[edge as usize];
        if count > 1 && self.edges[edge as usize] == NOT_MADE {
            for i in 1..count {
                let along = f64::from(i) / f64::from(count);
                let made = self.vertex(&[(low, 1.0 - along), (high, along)], sink)?;
                self.edges[edge as usize] = self.edges[edge as usize].min(made);
            }
        }
        let first = self.edges[edge as usize];
        let outline = &mut self.outline[side];
        outline.clear();
        outline.push(self.corners[ends[0] as usize]);
        if ends[0] == low {
            outline.extend((1..count).map(|i| first + i - 1));
        } else {
            outline.extend((1..count).map(|i| first + count - 1 - i));
        }
        outline.push(self.corners[ends[1] as usize]);
        Ok(())
    }

    /// Makes the vertex between corners of the base.
    fn vertex(&self, weights: &[(u32, f64)], sink: &mut impl MeshSink) -> Result<u32> {
        let mut corners = [(Corner::default(), 0.0); 3];
        for (corner, &(vertex, weight)) in corners.iter_mut().zip(weights) {
            let position = self.base.positions[vertex as usize];
            let normal = self.base.normals[vertex as usize];
            *corner = (Corner { position, normal }, weight);
        }
        let point = surface(&corners[..weights.len()], self.refinement.roundness);
        let position = self.placement.turn * point.position + self.placement.origin;
        let normal = self.placement.turn * point.normal;
        let height = self.refinement.relief.height(position, self.refinement.edge);
        sink.vertex((position + normal * height).as_vec3().to_array())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::sink::{Counter, Kept};
    use crate::scene::testing::open_edges;

    /// A tetrahedron with sides of different lengths.
    fn tetrahedron() -> BaseMesh {
        let positions = vec![DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 0.4, DVec3::Z];
        BaseMesh::new(positions, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    }

    #[test]
    fn closed_meshes_stay_closed_and_counts_are_right() {
        let base = tetrahedron();
        let relief = Relief::stone(7, 0.4, 0.02);
        for edge in [9.0, 1.0, 0.4, 0.21, 0.1, 0.033] {
            let mut mesh = Kept::default();
            let refinement = Refinement { edge, roundness: 0.7, relief: &relief };
            refine(&base, &Placement::new(0.3, DVec3::ONE), &refinement, &mut mesh).unwrap();
            assert_eq!(open_edges(&mesh), 0, "{edge}");
            assert_eq!(mesh.triangles.len() as u64, count(&base, edge));
        }
    }

    #[test]
    fn fewer_than_the_base_is_the_base() {
        let mut counter = Counter::default();
        let relief = Relief::NONE;
        let refinement = Refinement { edge: 100.0, roundness: 0.0, relief: &relief };
        refine(&tetrahedron(), &Placement::IDENTITY, &refinement, &mut counter).unwrap();
        assert_eq!(counter.triangles, 4);
    }
}
