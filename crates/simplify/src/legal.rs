//! What a collapse would do to the mesh around it.
//!
//! Topology may change: where scans have thousands of tunnels, or parts have holes for screws, the link condition (Dey,
//! Edelsbrunner, Guha, Nekhayev 1999) keeps triangles there that are missing elsewhere, and the mean distance at 2 % is
//! half as large again. What stays is that an edge of two triangles never comes to have one, because a collapse maps
//! the surface and triangles that fall on one another back to back cancel out.

use crate::work_mesh::{Corner, WorkMesh};
use glam::DVec3;

/// Least cosine between the normals of a triangle before and after.
const MIN_COSINE: f64 = 0.2;

/// What a collapse would do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Something is left of the triangles around the edge.
    Moves,
    /// All triangles around the edge vanish.
    Vanishes,
}

/// Looks at collapses, with the memory for that.
pub struct Inspector {
    /// Corners of both ends of the edge that was looked at last.
    pub stars: [Vec<Corner>; 2],
    /// Triangles that the collapse of that edge removes.
    pub removed: usize,
    /// The epoch in which a vertex was last found to be a neighbor.
    marks: Vec<u32>,
    epoch: u32,
    /// Pairs of triangles, one of each star, that would fall on one another with their backs.
    pairs: Vec<[usize; 2]>,
}

impl Inspector {
    pub fn new(vertex_count: usize) -> Inspector {
        Inspector {
            stars: Default::default(),
            removed: 0,
            marks: vec![0; vertex_count],
            epoch: 0,
            pairs: Vec::new(),
        }
    }

    fn next_epoch(&mut self) -> u32 {
        if self.epoch == u32::MAX {
            self.marks.fill(0);
            self.epoch = 0;
        }
        self.epoch += 1;
        self.epoch
    }

    /// Calls `with` once for each neighbor of `v`.
    pub fn for_each_neighbor(&mut self, mesh: &mut WorkMesh, v: u32, with: &mut dyn FnMut(&WorkMesh, u32)) {
        let epoch = self.next_epoch();
        mesh.collect_star(v, &mut self.stars[0]);
        for &corner in &self.stars[0] {
            let [_, a, b] = mesh.around(corner);
            for w in [a, b] {
                if self.marks[w as usize] < epoch {
                    self.marks[w as usize] = epoch;
                    with(mesh, w);
                }
            }
        }
    }

    /// Gathers the triangles around the edge and tells what its collapse would do. `None` if there is no such edge.
    pub fn inspect(&mut self, mesh: &mut WorkMesh, [u, v]: [u32; 2]) -> Option<Effect> {
        mesh.collect_star(u, &mut self.stars[0]);
        mesh.collect_star(v, &mut self.stars[1]);
        let at_edge = self.stars[1].iter().filter(|&&corner| mesh.around(corner).contains(&u)).count();
        if at_edge == 0 {
            return None;
        }
        self.find_pairs(mesh, [u, v]);
        self.removed = at_edge + 2 * self.pairs.len();
        let is_all_gone = self.stars.iter().all(|star| star.len() == at_edge + self.pairs.len());
        Some(if is_all_gone { Effect::Vanishes } else { Effect::Moves })
    }

    /// Finds the triangles of `v` that would fall on triangles of `u` back to back.
    fn find_pairs(&mut self, mesh: &WorkMesh, [u, v]: [u32; 2]) {
        self.pairs.clear();
        let epoch = self.next_epoch();
        for &corner in &self.stars[0] {
            let [_, a, b] = mesh.around(corner);
            self.marks[a as usize] = epoch;
            self.marks[b as usize] = epoch;
        }
        for &of_v in &self.stars[1] {
            let [_, a, b] = mesh.around(of_v);
            let falls = a != u && b != u && [a, b].iter().all(|&w| self.marks[w as usize] == epoch);
            if !falls {
                continue;
            }
            let is_back = |&&of_u: &&Corner| {
                let [_, c, d] = mesh.around(of_u);
                [d, c] == [a, b] && c != v && d != v && !self.pairs.iter().any(|p| p[0] == of_u as usize >> 2)
            };
            if let Some(&of_u) = self.stars[0].iter().find(is_back) {
                self.pairs.push([of_u, of_v].map(|corner| corner as usize >> 2));
            }
        }
    }

    /// True if some triangle around the edge that was looked at last would turn over, were both ends at `position`.
    pub fn flips(&self, mesh: &WorkMesh, [u, v]: [u32; 2], position: DVec3) -> bool {
        let turns = |&corner: &Corner, other: u32| {
            let [w, a, b] = mesh.around(corner);
            a != other && b != other && turns_over([w, a, b].map(|v| mesh.vertex(v).position), position)
        };
        self.stars[0].iter().any(|corner| turns(corner, v))
            || self.stars[1].iter().any(|corner| turns(corner, u))
    }

    /// Collapses the edge that was looked at last to `position`. Triangles that fall on one another with their backs
    /// are both removed: so no edge that was between two triangles is left with one.
    pub fn collapse(&mut self, mesh: &mut WorkMesh, edge: [u32; 2], position: DVec3) {
        mesh.merge(edge, position, &self.stars);
        self.pairs.iter().flatten().for_each(|&triangle| mesh.remove_triangle(triangle));
    }

    /// Length of the longest edge around the edge that was looked at last, squared.
    pub fn extent_squared(&self, mesh: &WorkMesh) -> f64 {
        let longest = |&corner: &Corner| {
            let [w, a, b] = mesh.around(corner).map(|v| mesh.vertex(v).position);
            w.distance_squared(a).max(a.distance_squared(b)).max(b.distance_squared(w))
        };
        self.stars.iter().flatten().map(longest).fold(0.0, f64::max)
    }
}

/// True if the normal of a triangle turns by more than [`MIN_COSINE`] allows when its first corner goes to `position`.
/// A triangle that has no normal may turn as it likes.
fn turns_over([w, a, b]: [DVec3; 3], position: DVec3) -> bool {
    let edge = b - a;
    let before = edge.cross(w - a);
    let after = edge.cross(position - a);
    let cosine = before.dot(after);
    let lengths = before.length_squared() * after.length_squared();
    let turns = cosine <= 0.0 || cosine * cosine < MIN_COSINE * MIN_COSINE * lengths;
    turns && before != DVec3::ZERO
}
