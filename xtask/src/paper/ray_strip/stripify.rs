//! Triangle strips of a piece of mesh (paper, section 4.2), by meshoptimizer's stripifier in the place of STRIPE.

use super::super::mesh::Mesh;

/// Ends a strip in what the stripifier gives.
const RESTART: u32 = u32::MAX;

/// Makes strips of pieces of a mesh.
pub struct Stripifier<'m> {
    mesh: &'m Mesh,
    /// Number in the piece of each vertex of the mesh, where it has one.
    local: Vec<u32>,
}

impl<'m> Stripifier<'m> {
    /// For pieces of `mesh`.
    pub fn new(mesh: &'m Mesh) -> Stripifier<'m> {
        Stripifier { mesh, local: vec![u32::MAX; mesh.positions.len()] }
    }

    /// Strips, as vertices of the mesh, that together hold each of `triangles` once, and swaps between them.
    pub fn strips(&mut self, triangles: &[u32]) -> Vec<Vec<u32>> {
        let corners = triangles.iter().flat_map(|&i| self.mesh.triangles[i as usize]);
        // The stripifier's time and memory grow with the vertices that it is told of, so they are numbered anew.
        let mut vertices = Vec::new();
        let mut indices = Vec::with_capacity(triangles.len() * 3);
        for v in corners {
            let local = &mut self.local[v as usize];
            if *local == u32::MAX {
                *local = vertices.len() as u32;
                vertices.push(v);
            }
            indices.push(*local);
        }
        for &v in &vertices {
            self.local[v as usize] = u32::MAX;
        }
        meshopt::optimize_vertex_cache_strip_in_place(&mut indices, vertices.len());
        let strips = meshopt::stripify(&indices, vertices.len(), RESTART)
            .expect("the stripifier is given the room that it asks for");
        let strip = |strip: &[u32]| strip.iter().map(|&v| vertices[v as usize]).collect();
        strips.split(|&v| v == RESTART).map(strip).collect()
    }
}
