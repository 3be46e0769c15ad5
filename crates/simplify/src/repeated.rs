//! Triangles that are there more than once.
//!
//! Copies bring nothing but work, but not all can go: where one of two equal triangles closes what would be open without
//! it, as in folds that some scanners' software makes, both stay. What goes together are copies that hang together, and
//! they go if no edge is left with more triangles on one side than on the other that had as many before.

use crate::Parts;
use crate::work_mesh::{Corner, WorkMesh};
use std::collections::HashMap;

/// Removes triangles that are there with the same order of corners and of the same geometry, as far as edges allow it.
pub fn remove_repeated(mesh: &mut WorkMesh) {
    let copies = copies(mesh);
    let triangles: Vec<[u32; 3]> = copies.iter().map(|&copy| mesh.triangles[copy].vertices).collect();
    if copies.is_empty() {
        return;
    }
    let parts = Parts::of(mesh.vertices.len(), &triangles);
    let mut balances: HashMap<(u32, [u32; 2]), i32> = HashMap::new();
    for (triangle, &part) in triangles.iter().zip(&parts.of_triangle) {
        for (edge, sign) in sides(*triangle) {
            *balances.entry((part, edge)).or_default() += sign;
        }
    }
    let mut is_needed = vec![false; parts.sizes.len()];
    let mut star = Vec::new();
    for (&(part, edge), _) in balances.iter().filter(|(_, balance)| **balance != 0) {
        if balance(mesh, edge, &mut star) == 0 {
            is_needed[part as usize] = true;
        }
    }
    for (&copy, &part) in copies.iter().zip(&parts.of_triangle) {
        if !is_needed[part as usize] {
            mesh.remove_triangle(copy);
        }
    }
}

/// All but the first of equal triangles.
fn copies(mesh: &mut WorkMesh) -> Vec<usize> {
    let mut copies = Vec::new();
    let mut star = Vec::new();
    let mut keys: Vec<([u32; 2], u32, Corner)> = Vec::new();
    for v in 0..mesh.vertices.len() as u32 {
        mesh.collect_star(v, &mut star);
        keys.clear();
        for &corner in &star {
            let [_, a, b] = mesh.around(corner);
            if v < a && v < b {
                keys.push(([a, b], mesh.triangles[corner as usize >> 2].geometry, corner));
            }
        }
        keys.sort_unstable();
        let again = keys.windows(2).filter(|w| (w[0].0, w[0].1) == (w[1].0, w[1].1));
        copies.extend(again.map(|w| w[1].2 as usize >> 2));
    }
    copies
}

/// The edges of a triangle, the lesser end first, and whether it goes along them that way.
fn sides([a, b, c]: [u32; 3]) -> [([u32; 2], i32); 3] {
    [[a, b], [b, c], [c, a]].map(|[p, q]| ([p.min(q), p.max(q)], if p < q { 1 } else { -1 }))
}

/// By how many more triangles go along the edge one way than the other.
fn balance(mesh: &mut WorkMesh, edge: [u32; 2], star: &mut Vec<Corner>) -> i32 {
    mesh.collect_star(edge[0], star);
    let triangles = star.iter().map(|&corner| mesh.triangles[corner as usize >> 2].vertices);
    triangles.flat_map(sides).filter(|(side, _)| *side == edge).map(|(_, sign)| sign).sum()
}
