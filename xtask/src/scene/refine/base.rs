//! The small mesh of which a large one is made.

use super::order;
use glam::DVec3;
use std::collections::HashMap;

/// Positions nearer than this are the same when patches are joined, in units of the mesh.
const WELD: f64 = 1e-6;

/// A mesh with all that refining it asks for.
#[derive(Clone, Debug, Default)]
pub struct BaseMesh {
    /// Corners of triangles.
    pub positions: Vec<DVec3>,
    /// Unit normals at the corners: the mean of the triangles around them.
    pub normals: Vec<DVec3>,
    /// Triangles, neighbors one after the other where that can be.
    pub triangles: Vec<[u32; 3]>,
    /// Ends of the edges, the lower number first.
    pub edges: Vec<[u32; 2]>,
    /// Their lengths.
    pub edge_lengths: Vec<f64>,
    /// The edges from each corner of a triangle to the next.
    pub face_edges: Vec<[u32; 3]>,
}

impl BaseMesh {
    /// Takes a mesh that shares its vertices. Triangles that name one twice are left out.
    pub fn new(positions: Vec<DVec3>, mut triangles: Vec<[u32; 3]>) -> BaseMesh {
        triangles.retain(|&[a, b, c]| a != b && b != c && c != a);
        order::sort(&positions, &mut triangles);
        let normals = normals(&positions, &triangles);
        let (edges, face_edges) = edges(&triangles);
        let length = |&[a, b]: &[u32; 2]| positions[a as usize].distance(positions[b as usize]);
        let edge_lengths = edges.iter().map(length).collect();
        BaseMesh { positions, normals, triangles, edges, edge_lengths, face_edges }
    }

    /// Takes patches whose vertices are shared where their positions are the same.
    pub fn welded(positions: &[DVec3], triangles: &[[u32; 3]]) -> BaseMesh {
        let mut numbers = HashMap::new();
        let mut kept = Vec::new();
        let number_of = |position: &DVec3| {
            let key = (*position / WELD).to_array().map(|x| x.round() as i64);
            *numbers.entry(key).or_insert_with(|| {
                kept.push(*position);
                kept.len() as u32 - 1
            })
        };
        let numbers: Vec<u32> = positions.iter().map(number_of).collect();
        let triangles = triangles.iter().map(|t| t.map(|v| numbers[v as usize])).collect();
        BaseMesh::new(kept, triangles)
    }

    /// Each from a corner along two directions; fronts look to their cross product.
    pub fn parallelograms(all: &[(DVec3, [DVec3; 2])]) -> BaseMesh {
        let corners =
            |&(corner, [u, v]): &(DVec3, [DVec3; 2])| [corner, corner + u, corner + u + v, corner + v];
        let positions: Vec<DVec3> = all.iter().flat_map(corners).collect();
        let firsts = (0..all.len() as u32).map(|i| 4 * i);
        let triangles: Vec<[u32; 3]> = firsts.flat_map(|a| [[a, a + 1, a + 2], [a, a + 2, a + 3]]).collect();
        BaseMesh::welded(&positions, &triangles)
    }

    /// The box around the triangles.
    pub fn bounds(&self) -> [DVec3; 2] {
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let corners = self.triangles.iter().flatten().map(|&v| self.positions[v as usize]);
        corners.fold(empty, |[low, high], p| [low.min(p), high.max(p)])
    }
}

/// Weighted by area. Where that leaves none, as on a sheet folded flat, any will do.
pub fn normals(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| positions[v as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|&v| normals[v as usize] += normal);
    }
    normals.iter().map(|normal| normal.try_normalize().unwrap_or(DVec3::Y)).collect()
}

/// All edges, and which of them are those of each triangle.
fn edges(triangles: &[[u32; 3]]) -> (Vec<[u32; 2]>, Vec<[u32; 3]>) {
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]);
    let mut edges: Vec<[u32; 2]> = triangles.iter().flat_map(sides).collect();
    edges.sort_unstable();
    edges.dedup();
    let number =
        |side: [u32; 2]| edges.binary_search(&side).expect("sides of triangles were put there") as u32;
    let face_edges = triangles.iter().map(|triangle| sides(triangle).map(number)).collect();
    (edges, face_edges)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_are_joined_where_they_meet() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X, DVec3::ONE, DVec3::Y];
        let mesh = BaseMesh::welded(&positions, &[[0, 1, 2], [3, 4, 5], [3, 3, 5]]);
        assert_eq!((mesh.positions.len(), mesh.triangles.len(), mesh.edges.len()), (4, 2, 5));
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12));
        assert_eq!(mesh.bounds(), [DVec3::ZERO, DVec3::ONE]);
    }
}
