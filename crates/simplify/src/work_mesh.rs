//! A mesh while edges are collapsed.
//!
//! Nearly all time goes into waiting for memory, because collapses jump about the mesh. So the corners of a vertex lie in
//! a row, and the triangles that they lead to are waited for together; a collapse writes the row of the vertex that is
//! left behind all others. Triangles that are gone leave a row when it is next read. Versions, which are asked for
//! most, are by themselves.

use crate::{Piece, Quadric, StoredQuadric};
use glam::{DVec3, Vec3};

/// No vertex.
pub const NONE: u32 = u32::MAX;

/// The vertex must stay as it is.
const LOCKED: u32 = 1;
/// The vertex is not where it was.
const MOVED: u32 = 2;
/// Borders between the vertex and others of the kind have no planes yet.
const HELD: u32 = 4;

/// A vertex.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct Vertex {
    /// Relative to the piece's origin.
    pub position: DVec3,
    pub quadric: Quadric,
    /// Where its corners begin.
    first_corner: u32,
    corner_count: u32,
    flags: u32,
}

/// A triangle; its first vertex is [`NONE`] when it is gone.
#[derive(Clone, Copy)]
#[repr(align(16))]
pub struct Triangle {
    pub vertices: [u32; 3],
    pub geometry: u32,
}

/// A triangle and which of its corners: `triangle << 2 | corner`.
pub type Corner = u32;

/// Corners of a vertex that are waited for: in longer rows the processor sees what is next.
const MOST_TOUCHED: u32 = 32;

/// Room for rows of corners, as a multiple of what they take in the beginning: when it is full, rows that are no longer
/// used go.
const ROWS_SPACE: usize = 3;

/// Most triangles of a piece.
const MAX_TRIANGLES: usize = 1 << 28;

pub struct WorkMesh {
    pub vertices: Vec<Vertex>,
    /// Changes whenever the vertex does.
    versions: Vec<u32>,
    pub triangles: Vec<Triangle>,
    /// Corners of each vertex, and rows that are no longer used.
    corners: Vec<Corner>,
    /// Triangles that are not gone.
    pub triangle_count: usize,
}

/// Triangles that are not gone, with their numbers.
fn there(triangles: &[Triangle]) -> impl Iterator<Item = (usize, &Triangle)> {
    triangles.iter().enumerate().filter(|(_, triangle)| triangle.vertices[0] != NONE)
}

impl WorkMesh {
    /// The mesh of `piece`, without triangles of equal corners.
    pub fn of(piece: &Piece) -> WorkMesh {
        assert!(piece.triangles.len() <= MAX_TRIANGLES, "a piece has at most 2^28 triangles");
        assert_eq!(piece.triangles.len(), piece.geometries.len(), "every triangle has a geometry");
        let vertex = |i: usize| {
            let position = piece.positions[i].as_dvec3() - piece.origin;
            let stored = piece.quadrics.get(i);
            let quadric = stored.map_or(Quadric::default(), |&stored| Quadric::from_stored(stored, position));
            let locked = if piece.locked.get(i) == Some(&true) { LOCKED } else { 0 };
            let held = if stored.is_none_or(StoredQuadric::is_held) { HELD } else { 0 };
            Vertex { position, quadric, first_corner: 0, corner_count: 0, flags: locked | held }
        };
        let triangles = piece.triangles.iter().zip(&piece.geometries);
        let triangles = triangles.map(|(&vertices, &geometry)| Triangle { vertices, geometry });
        let has_corners = |triangle: &Triangle| {
            let [a, b, c] = triangle.vertices;
            a != b && b != c && c != a
        };
        let triangles: Vec<Triangle> = triangles.filter(has_corners).collect();
        let mut mesh = WorkMesh {
            vertices: (0..piece.positions.len()).map(vertex).collect(),
            versions: vec![0; piece.positions.len()],
            triangle_count: triangles.len(),
            corners: Vec::with_capacity(ROWS_SPACE * 3 * triangles.len()),
            triangles,
        };
        mesh.corners.resize(3 * mesh.triangles.len(), 0);
        mesh.list_corners();
        mesh
    }

    /// Makes the rows of corners.
    fn list_corners(&mut self) {
        for v in there(&self.triangles).flat_map(|(_, triangle)| triangle.vertices) {
            self.vertices[v as usize].corner_count += 1;
        }
        let mut end = 0;
        for vertex in &mut self.vertices {
            vertex.first_corner = end;
            end += std::mem::take(&mut vertex.corner_count);
        }
        for (i, triangle) in there(&self.triangles) {
            for (k, v) in triangle.vertices.into_iter().enumerate() {
                let vertex = &mut self.vertices[v as usize];
                self.corners[(vertex.first_corner + vertex.corner_count) as usize] = (i << 2 | k) as Corner;
                vertex.corner_count += 1;
            }
        }
    }

    pub fn vertex(&self, v: u32) -> &Vertex {
        &self.vertices[v as usize]
    }

    pub fn is_locked(&self, v: u32) -> bool {
        self.vertex(v).flags & LOCKED != 0
    }

    /// True if borders between this vertex and others of the kind have no planes yet.
    pub fn is_held(&self, v: u32) -> bool {
        self.vertex(v).flags & HELD != 0
    }

    /// Sum of the versions of both ends of an edge.
    pub fn stamp(&self, [u, v]: [u32; 2]) -> u32 {
        self.versions[u as usize].wrapping_add(self.versions[v as usize])
    }

    /// Corners of both ends of an edge, and perhaps more that are gone.
    pub fn corner_count(&self, [u, v]: [u32; 2]) -> usize {
        self.vertex(u).corner_count as usize + self.vertex(v).corner_count as usize
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
        let Vertex { first_corner, corner_count, .. } = self.vertices[v as usize];
        let row = first_corner as usize..(first_corner + corner_count) as usize;
        let is_there = |corner: &Corner| self.triangles[*corner as usize >> 2].vertices[0] != NONE;
        star.clear();
        star.extend(self.corners[row.clone()].iter().copied().filter(is_there));
        if star.len() < row.len() {
            self.corners[row.start..row.start + star.len()].copy_from_slice(star);
            self.vertices[v as usize].corner_count = star.len() as u32;
        }
    }

    /// Reads what collapses of `edges` are going to need, for all of them at a time, so that memory is waited for a few
    /// times and not a few times for each. What it returns has no meaning, but must not be optimized away.
    pub fn touch(&self, edges: impl Iterator<Item = [u32; 2]> + Clone) -> u32 {
        let ends = edges.flatten().map(|v| self.vertex(v));
        let row = |v: &Vertex| {
            let count = v.corner_count.min(MOST_TOUCHED) as usize;
            &self.corners[v.first_corner as usize..][..count]
        };
        let corners = ends.clone().flat_map(row);
        let triangles = corners.map(|&corner| &self.triangles[corner as usize >> 2]);
        let neighbors = triangles.clone().filter(|t| t.vertices[0] != NONE).flat_map(|t| t.vertices);
        // Both cache lines of a vertex.
        let read = |v: &Vertex| v.position.x.to_bits() as u32 ^ v.corner_count;
        let first = ends.clone().map(read).fold(0, u32::wrapping_add);
        let second = ends.map(|v| row(v).first().map_or(0, |&corner| corner)).fold(first, u32::wrapping_add);
        let third = triangles.map(|t| t.vertices[0]).fold(second, u32::wrapping_add);
        neighbors.map(|v| read(self.vertex(v))).fold(third, u32::wrapping_add)
    }

    pub fn remove_triangle(&mut self, triangle: usize) {
        let first = &mut self.triangles[triangle].vertices[0];
        if *first != NONE {
            *first = NONE;
            self.triangle_count -= 1;
        }
    }

    /// Moves `u` to `position` and makes it stand for `v` as well; `stars` has the corners of both. Triangles with both
    /// are removed.
    pub fn merge(&mut self, [u, v]: [u32; 2], position: DVec3, stars: &[Vec<Corner>; 2]) {
        for &corner in &stars[1] {
            let triangle = corner as usize >> 2;
            if self.triangles[triangle].vertices.contains(&u) {
                self.remove_triangle(triangle);
            } else {
                self.triangles[triangle].vertices[corner as usize & 3] = u;
            }
        }
        let gone = self.vertices[v as usize];
        let (first_corner, corner_count) = self.add_row(stars);
        let vertex = &mut self.vertices[u as usize];
        vertex.quadric += gone.quadric;
        vertex.first_corner = first_corner;
        vertex.corner_count = corner_count;
        if vertex.position != position {
            vertex.position = position;
            vertex.flags |= MOVED;
        }
        self.vertices[v as usize].corner_count = 0;
        self.versions[u as usize] += 1;
        self.versions[v as usize] += 1;
    }

    /// Writes what is left of both stars as a row, and tells its place and length.
    fn add_row(&mut self, stars: &[Vec<Corner>; 2]) -> (u32, u32) {
        if self.corners.len() + stars[0].len() + stars[1].len() > self.corners.capacity() {
            self.remove_unused_rows();
        }
        let WorkMesh { corners, triangles, .. } = self;
        let first = corners.len();
        let is_there = |corner: &Corner| triangles[*corner as usize >> 2].vertices[0] != NONE;
        corners.extend(stars.iter().flatten().copied().filter(is_there));
        (first as u32, (corners.len() - first) as u32)
    }

    /// Writes all rows anew.
    fn remove_unused_rows(&mut self) {
        self.corners.clear();
        self.corners.resize(3 * self.triangle_count, 0);
        self.vertices.iter_mut().for_each(|vertex| vertex.corner_count = 0);
        self.list_corners();
    }

    /// The mesh as a piece again, and for each vertex the one of `piece`, of which it was made.
    pub fn finish(self, piece: Piece) -> (Piece, Vec<u32>) {
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
        let positions: Vec<Vec3> = sources.iter().map(position).collect();
        let quadrics = sources.iter().zip(&positions).map(|(&v, position)| {
            let stored = self.vertex(v).quadric.stored_at(position.as_dvec3() - piece.origin);
            stored.hold(self.is_locked(v))
        });
        let is_any_locked = piece.locked.iter().any(|&locked| locked);
        let simplified = Piece {
            quadrics: quadrics.collect(),
            triangles: left().map(|t| t.vertices.map(|v| numbers[v as usize])).collect(),
            geometries: left().map(|t| t.geometry).collect(),
            locked: if is_any_locked { sources.iter().map(locked).collect() } else { Vec::new() },
            positions,
            origin: piece.origin,
        };
        (simplified, sources)
    }
}
