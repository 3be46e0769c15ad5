//! What is known before the first collapse: quadrics of triangles and borders, and where borders are.
//!
//! Each corner gets the plane of its triangle with a third of its area. Along an edge that is not between two triangles
//! of one geometry, planes through the edge and perpendicular to its triangles hold the border in place (Garland and
//! Heckbert 1997, section 6.1).

use crate::Quadric;
use crate::work_mesh::{Corner, NONE, WorkMesh};

/// Weight of a plane that holds a border, for a squared edge. Triangles beside the edge come to about a half each.
const BORDER_WEIGHT: f64 = 1.0;

/// Adds the planes of all triangles to the quadrics of their vertices.
pub fn add_triangles(mesh: &mut WorkMesh) {
    let WorkMesh { vertices, triangles, .. } = mesh;
    for triangle in triangles.iter().filter(|t| t.vertices[0] != NONE) {
        let quadric = Quadric::of_corner(triangle.vertices.map(|v| vertices[v as usize].position));
        triangle.vertices.into_iter().for_each(|v| vertices[v as usize].quadric += quadric);
    }
}

/// Adds the planes of borders that have none yet to the quadrics of their vertices.
pub fn add_borders(mesh: &mut WorkMesh) {
    for_each_edge(mesh, &mut add_border);
}

/// Gets the mesh, the ends of an edge, and for each of its triangles the greater end and the corner at the lesser.
type WithEdge<'a> = dyn FnMut(&mut WorkMesh, [u32; 2], &[(u32, Corner)]) + 'a;

/// Calls `with` for every edge once, with its ends, the lesser first, and a corner of each of its triangles. Edges
/// come in the order of their ends.
pub fn for_each_edge(mesh: &mut WorkMesh, with: &mut WithEdge) {
    let mut star = Vec::new();
    let mut spokes: Vec<(u32, Corner)> = Vec::new();
    for u in 0..mesh.vertices.len() as u32 {
        mesh.collect_star(u, &mut star);
        spokes.clear();
        for &corner in &star {
            let [_, a, b] = mesh.around(corner);
            spokes.extend([a, b].into_iter().filter(|&w| u < w).map(|w| (w, corner)));
        }
        spokes.sort_unstable();
        for spokes in spokes.chunk_by(|a, b| a.0 == b.0) {
            with(mesh, [u, spokes[0].0], spokes);
        }
    }
}

/// Adds the planes of an edge if it is a border.
fn add_border(mesh: &mut WorkMesh, ends: [u32; 2], spokes: &[(u32, Corner)]) {
    let geometry = |&(_, corner): &(u32, Corner)| mesh.triangles[corner as usize >> 2].geometry;
    let is_inside = spokes.len() == 2 && geometry(&spokes[0]) == geometry(&spokes[1]);
    let is_done = !ends.into_iter().all(|v| mesh.is_held(v));
    // Between locked vertices other triangles may be in other pieces. A later level will see.
    let is_unknown = ends.into_iter().all(|v| mesh.is_locked(v));
    if is_inside || is_done || is_unknown {
        return;
    }
    let [p, q] = ends.map(|v| mesh.vertex(v).position);
    for &(_, corner) in spokes {
        let [a, b, c] = mesh.around(corner).map(|v| mesh.vertex(v).position);
        let across = (q - p).cross((b - a).cross(c - a)).normalize_or_zero();
        let quadric = Quadric::of_border(p, across, (q - p).length_squared() * BORDER_WEIGHT);
        ends.into_iter().for_each(|v| mesh.vertices[v as usize].quadric += quadric);
    }
}
