//! What a collapse would do to the mesh around it.
//!
//! The link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999, "Topology preserving edge contraction"): the topology
//! stays if the neighbors that both ends have are just the third corners of the triangles at the edge.

use crate::work_mesh::{BORDER, Corner, WorkMesh};
use glam::DVec3;

/// Least cosine between the normals of a triangle before and after.
const MIN_COSINE: f64 = 0.2;

/// What a collapse would do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Topology stays.
    Clean,
    /// All triangles around the edge vanish, leaving nothing behind.
    Vanishes,
    /// Something is pinched, or two triangles fall on one another.
    Pinches,
}

/// Looks at collapses, with the memory for that.
pub struct Inspector {
    /// Corners of both ends of the edge that was looked at last.
    pub stars: [Vec<Corner>; 2],
    /// What is known of each vertex, as a number from `epoch` on; less than that is nothing.
    marks: Vec<u32>,
    epoch: u32,
    /// Pairs of triangles, one of each star, that would fall on one another with their backs.
    pairs: Vec<[usize; 2]>,
}

/// Marks above the epoch: neighbor of the first end, of both, third corner of a triangle at the edge.
const OF_FIRST: u32 = 0;
const OF_BOTH: u32 = 1;
const THIRD: u32 = 2;
const MARKS: u32 = 3;

impl Inspector {
    pub fn new(vertex_count: usize) -> Inspector {
        Inspector { stars: Default::default(), marks: vec![0; vertex_count], epoch: MARKS, pairs: Vec::new() }
    }

    fn next_epoch(&mut self) -> u32 {
        if self.epoch > u32::MAX - 2 * MARKS {
            self.marks.fill(0);
            self.epoch = 0;
        }
        self.epoch += MARKS;
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
        let epoch = self.next_epoch();
        let (at_edge, thirds, both) = self.mark(mesh, [u, v], epoch);
        if at_edge == 0 {
            return None;
        }
        self.pairs.clear();
        let coincides = both > 1 && self.find_pairs(mesh, [u, v], epoch);
        let is_all_gone = self.stars.iter().all(|star| star.len() == at_edge + self.pairs.len());
        if is_all_gone {
            return Some(Effect::Vanishes);
        }
        let joins_borders = at_edge == 2 && [u, v].into_iter().all(|v| mesh.vertex(v).flags & BORDER != 0);
        let is_clean = both == thirds && !coincides && !joins_borders;
        Some(if is_clean { Effect::Clean } else { Effect::Pinches })
    }

    /// Marks the neighbors of both ends, and counts triangles at the edge, their third corners, and neighbors that both
    /// ends have.
    fn mark(&mut self, mesh: &WorkMesh, [u, v]: [u32; 2], epoch: u32) -> (usize, usize, usize) {
        let marks = &mut self.marks;
        for &corner in &self.stars[0] {
            let [_, a, b] = mesh.around(corner);
            marks[a as usize] = epoch + OF_FIRST;
            marks[b as usize] = epoch + OF_FIRST;
        }
        let (mut at_edge, mut thirds, mut both) = (0, 0, 0);
        for &corner in &self.stars[1] {
            let [_, a, b] = mesh.around(corner);
            let is_at_edge = a == u || b == u;
            at_edge += usize::from(is_at_edge);
            for w in [a, b].into_iter().filter(|&w| w != u && w != v) {
                let mark = &mut marks[w as usize];
                if *mark == epoch + OF_FIRST {
                    *mark = epoch + OF_BOTH;
                    both += 1;
                }
                if is_at_edge && *mark == epoch + OF_BOTH {
                    *mark = epoch + THIRD;
                    thirds += 1;
                }
            }
        }
        (at_edge, thirds, both)
    }

    /// Finds the triangles of `v` that would fall on triangles of `u`: true if there are any, and `pairs` gets those
    /// that would meet back to back.
    fn find_pairs(&mut self, mesh: &WorkMesh, [u, v]: [u32; 2], epoch: u32) -> bool {
        let mut coincides = false;
        for &of_v in &self.stars[1] {
            let [_, a, b] = mesh.around(of_v);
            let is_candidate = a != u && b != u && [a, b].iter().all(|&w| self.marks[w as usize] > epoch);
            if !is_candidate {
                continue;
            }
            for &of_u in &self.stars[0] {
                let [_, c, d] = mesh.around(of_u);
                coincides |= [c, d] == [a, b] || [d, c] == [a, b];
                let pair = [of_u as usize >> 2, of_v as usize >> 2];
                if [d, c] == [a, b] && c != v && d != v && !self.pairs.iter().any(|p| p[0] == pair[0]) {
                    self.pairs.push(pair);
                    break;
                }
            }
        }
        coincides
    }

    /// True if some triangle around the edge that was looked at last would turn over, were both ends at `position`.
    pub fn flips(&self, mesh: &WorkMesh, [u, v]: [u32; 2], position: DVec3) -> bool {
        let turns = |&corner: &Corner, other: u32| {
            let [w, a, b] = mesh.around(corner);
            a != other && b != other && turns_over([w, a, b].map(|v| mesh.vertex(v).position), position)
        };
        self.stars[0].iter().any(|corner| turns(corner, v)) || self.stars[1].iter().any(|corner| turns(corner, u))
    }

    /// Collapses the edge that was looked at last to `position`. Triangles that fall on one another with their backs
    /// are both removed: so no edge that was between two triangles is left with one.
    pub fn collapse(&mut self, mesh: &mut WorkMesh, [u, v]: [u32; 2], position: DVec3) {
        mesh.merge(u, v, position, &self.stars[1]);
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
