//! A mesh while edges are collapsed.
//!
//! Each vertex has the list of its corners, linked through the triangles, so that the lists of two vertices become one
//! by setting one link. Triangles that are gone are unlinked when a list is next walked. A vertex fills two cache lines
//! and a triangle half of one: nearly all time goes into waiting for them.

use crate::{Piece, Quadric, Simplified};
use glam::DVec3;

/// No corner, no vertex.
pub const NONE: u32 = u32::MAX;

/// The vertex must stay as it is.
pub const LOCKED: u32 = 1;
/// The vertex is not where it was.
const MOVED: u32 = 2;

/// A vertex.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct Vertex {
    /// Relative to the piece's origin.
    pub position: DVec3,
    pub quadric: Quadric,
    first_corner: u32,
    last_corner: u32,
    /// Changes whenever the vertex does.
    pub version: u32,
    pub flags: u32,
}

/// A triangle; its first vertex is [`NONE`] when it is gone.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub struct Triangle {
    pub vertices: [u32; 3],
    /// The next corner in the list of each vertex.
    next_corners: [u32; 3],
    pub geometry: u32,
}

/// Place of a triangle in its list, and which of its corners: `triangle << 2 | corner`.
pub type Corner = u32;

/// Most triangles of a piece.
const MAX_TRIANGLES: usize = 1 << 30;

pub struct WorkMesh {
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<Triangle>,
    /// Triangles that are not gone.
    pub triangle_count: usize,
}

impl WorkMesh {
    /// The mesh of `piece`, without triangles of equal corners.
    pub fn of(piece: &Piece) -> WorkMesh {
        assert!(piece.triangles.len() <= MAX_TRIANGLES, "a piece has at most 2^30 triangles");
        assert_eq!(piece.triangles.len(), piece.geometries.len(), "every triangle has a geometry");
        let vertex = |i: usize| Vertex {
            position: piece.positions[i].as_dvec3() - piece.origin,
            quadric: piece.quadrics.get(i).copied().unwrap_or_default(),
            first_corner: NONE,
            last_corner: NONE,
            version: 0,
            flags: if piece.locked.get(i) == Some(&true) { LOCKED } else { 0 },
        };
        let mut mesh = WorkMesh {
            vertices: (0..piece.positions.len()).map(vertex).collect(),
            triangles: Vec::with_capacity(piece.triangles.len()),
            triangle_count: 0,
        };
        for (&[a, b, c], &geometry) in piece.triangles.iter().zip(&piece.geometries) {
            if a != b && b != c && c != a {
                mesh.add_triangle([a, b, c], geometry);
            }
        }
        mesh
    }

    fn add_triangle(&mut self, vertices: [u32; 3], geometry: u32) {
        let triangle = self.triangles.len() as u32;
        self.triangles.push(Triangle { vertices, next_corners: [NONE; 3], geometry });
        for (k, v) in vertices.into_iter().enumerate() {
            let corner = triangle << 2 | k as u32;
            self.append(v, corner, corner);
        }
        self.triangle_count += 1;
    }

    /// Appends the list that begins with `first` and ends with `last` to that of `v`.
    fn append(&mut self, v: u32, first: Corner, last: Corner) {
        let vertex = &mut self.vertices[v as usize];
        let tail = std::mem::replace(&mut vertex.last_corner, last);
        match tail {
            NONE => vertex.first_corner = first,
            tail => *self.next_mut(tail) = first,
        }
    }

    fn next_mut(&mut self, corner: Corner) -> &mut Corner {
        &mut self.triangles[corner as usize >> 2].next_corners[corner as usize & 3]
    }

    pub fn vertex(&self, v: u32) -> &Vertex {
        &self.vertices[v as usize]
    }

    pub fn is_locked(&self, v: u32) -> bool {
        self.vertex(v).flags & LOCKED != 0
    }

    /// Sum of the versions of both ends of an edge.
    pub fn stamp(&self, [u, v]: [u32; 2]) -> u32 {
        self.vertex(u).version.wrapping_add(self.vertex(v).version)
    }

    /// The vertex at a corner and the two after it around the triangle.
    pub fn around(&self, corner: Corner) -> [u32; 3] {
        let [a, b, c] = self.triangles[corner as usize >> 2].vertices;
        match corner & 3 {
            0 => [a, b, c],
            1 => [b, c, a],
            _ => [c, a, b],
        }
    }

    /// Puts the corners of `v` into `star`.
    pub fn collect_star(&mut self, v: u32, star: &mut Vec<Corner>) {
        star.clear();
        let mut corner = self.vertex(v).first_corner;
        let mut kept = NONE;
        while corner != NONE {
            let triangle = &self.triangles[corner as usize >> 2];
            let next = triangle.next_corners[corner as usize & 3];
            if triangle.vertices[0] != NONE {
                star.push(corner);
                kept = corner;
            } else if kept == NONE {
                self.vertices[v as usize].first_corner = next;
            } else {
                *self.next_mut(kept) = next;
            }
            corner = next;
        }
        self.vertices[v as usize].last_corner = kept;
    }

    pub fn remove_triangle(&mut self, triangle: usize) {
        let first = &mut self.triangles[triangle].vertices[0];
        if *first != NONE {
            *first = NONE;
            self.triangle_count -= 1;
        }
    }

    /// Moves `u` to `position` and makes it stand for `v` as well, whose corners `star` has. Triangles with both are
    /// removed.
    pub fn merge(&mut self, u: u32, v: u32, position: DVec3, star: &[Corner]) {
        for &corner in star {
            let triangle = corner as usize >> 2;
            if self.triangles[triangle].vertices.contains(&u) {
                self.remove_triangle(triangle);
            } else {
                self.triangles[triangle].vertices[corner as usize & 3] = u;
            }
        }
        let gone = self.vertices[v as usize];
        if gone.first_corner != NONE {
            self.append(u, gone.first_corner, gone.last_corner);
        }
        let vertex = &mut self.vertices[u as usize];
        vertex.quadric += gone.quadric;
        if vertex.position != position {
            vertex.position = position;
            vertex.flags |= MOVED;
        }
        vertex.version += 1;
        let gone = &mut self.vertices[v as usize];
        gone.version += 1;
        gone.first_corner = NONE;
        gone.last_corner = NONE;
    }

    /// The mesh as a piece again; `piece` is what it was made of.
    pub fn finish(self, piece: Piece, error: f64) -> Simplified {
        let mut used: Vec<bool> = self.vertices.iter().map(|v| v.flags & LOCKED != 0).collect();
        let left = || self.triangles.iter().filter(|triangle| triangle.vertices[0] != NONE);
        for v in left().flat_map(|triangle| triangle.vertices) {
            used[v as usize] = true;
        }
        let sources: Vec<u32> = (0..used.len() as u32).filter(|&v| used[v as usize]).collect();
        let mut numbers = vec![NONE; used.len()];
        for (number, &source) in sources.iter().enumerate() {
            numbers[source as usize] = number as u32;
        }
        let position = |&v: &u32| match self.vertex(v).flags & MOVED {
            0 => piece.positions[v as usize],
            _ => (self.vertex(v).position + piece.origin).as_vec3(),
        };
        let locked = |&v: &u32| self.is_locked(v);
        let is_any_locked = piece.locked.iter().any(|&locked| locked);
        let simplified = Piece {
            positions: sources.iter().map(position).collect(),
            triangles: left().map(|t| t.vertices.map(|v| numbers[v as usize])).collect(),
            geometries: left().map(|t| t.geometry).collect(),
            locked: if is_any_locked { sources.iter().map(locked).collect() } else { Vec::new() },
            quadrics: sources.iter().map(|&v| self.vertex(v).quadric).collect(),
            origin: piece.origin,
        };
        Simplified { piece: simplified, sources, error }
    }
}
