//! Strips of a cluster, chosen for rays.
//!
//! Stripifiers for rasterizers make long strips, whose boxes are large. A ray pays for area, a file for
//! strips, so a path of triangles is rated by (area of its box + what a strip costs) a triangle. Every path
//! from neighbor to neighbor is a strip, since a turn is a bit and not a repeated vertex.
//!
//! Greedy: the free triangle with fewest free neighbors begins (as in STRIPE, Evans et al. 1996: it would be
//! left alone later), all paths of one window from it are tried, the best is taken; then further windows are
//! joined to its end while that is cheaper than a strip of their own.

use crate::split_tree::split_tree;
use glam::Vec3;
use raystrips_geom::Aabb;
use raystrips_geom::strip::{PlaneSplit, WINDOW_TRIANGLES, WINDOW_VERTICES, strip_triangle};
use smallvec::SmallVec;

/// What a strip costs besides the area of its box, in boxes of the mean triangle of the cluster: its bytes and
/// its test. `docs/RESULTS.md`, "Strip cost".
const STRIP_COST: f32 = 4.0;

/// A cluster's triangles over its own vertices.
#[derive(Clone, Debug)]
pub struct ClusterMesh {
    /// At most 256 vertices.
    pub positions: Vec<Vec3>,
    /// Corners.
    pub triangles: Vec<[u8; 3]>,
    /// Geometry of each triangle; a strip has one.
    pub geometries: Vec<u32>,
}

/// A triangle of the input in a strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source {
    /// Which triangle.
    pub triangle: u32,
    /// Which of its corners comes first in the strip's.
    pub first_corner: u8,
}

/// A few bytes of a strip. Most strips are a window, and need no memory beside themselves.
pub type Bytes = SmallVec<[u8; 16]>;

/// A strip with its tree.
#[derive(Clone, Debug)]
pub struct Strip {
    /// Vertices of the cluster: number of triangles + 2.
    pub refs: Bytes,
    /// Turn bits, a byte a window; none for a strand.
    pub turns: Bytes,
    /// Tree over the windows.
    pub splits: Vec<PlaneSplit>,
    /// Codes of the radii of the points, if it is a window of a strand, and not of triangles.
    pub radii: Bytes,
    /// Geometry of all its triangles.
    pub geometry: u32,
    /// Where its triangles come from.
    pub sources: SmallVec<[Source; WINDOW_TRIANGLES]>,
    /// Box around all.
    pub bounds: Aabb,
}

/// Makes strips of at most `max_windows` windows: each triangle is in exactly one, wound as it was.
pub fn stripify(mesh: &ClusterMesh, max_windows: usize) -> Vec<Strip> {
    let neighbors = Neighbors::of(mesh);
    let mut search = Search::new(mesh, &neighbors);
    let mut strips = Vec::new();
    while let Some(start) = search.next_start() {
        let paths = search.take_strip(start, max_windows);
        strips.push(make_strip(mesh, &paths));
    }
    strips
}

const NONE: u16 = u16::MAX;

/// For each triangle and edge *k* (from corner *k* to the next) the triangle on the other side: one that has
/// the same edge in the other direction and belongs to the same geometry.
struct Neighbors(Vec<[u16; 3]>);

impl Neighbors {
    fn of(mesh: &ClusterMesh) -> Neighbors {
        let edges = DirectedEdges::of(mesh);
        let across = |i: usize, k: usize| {
            let t = &mesh.triangles[i];
            let same_geometry = |&j: &u16| mesh.geometries[usize::from(j)] == mesh.geometries[i];
            edges.triangles(t[(k + 1) % 3], t[k]).find(same_geometry).unwrap_or(NONE)
        };
        Neighbors((0..mesh.triangles.len()).map(|i| [0, 1, 2].map(|k| across(i, k))).collect())
    }
}

/// All edges of a mesh by the vertex that they begin at.
struct DirectedEdges {
    /// Where the edges of each vertex begin in `edges`.
    first: [u16; 257],
    /// The vertex that an edge ends at and its triangle, in the order of triangles.
    edges: Vec<(u8, u16)>,
}

impl DirectedEdges {
    fn of(mesh: &ClusterMesh) -> DirectedEdges {
        let mut first = [0; 257];
        for &v in mesh.triangles.iter().flatten() {
            first[usize::from(v) + 1] += 1;
        }
        (0..256).for_each(|v| first[v + 1] += first[v]);
        let mut next = first;
        let mut edges = vec![(0, 0); mesh.triangles.len() * 3];
        for (t, i) in mesh.triangles.iter().zip(0u16..) {
            for k in 0..3 {
                let place = &mut next[usize::from(t[k])];
                edges[usize::from(*place)] = (t[(k + 1) % 3], i);
                *place += 1;
            }
        }
        DirectedEdges { first, edges }
    }

    /// The triangles with an edge from `a` to `b`.
    fn triangles(&self, a: u8, b: u8) -> impl Iterator<Item = u16> {
        let range = usize::from(self.first[usize::from(a)])..usize::from(self.first[usize::from(a) + 1]);
        self.edges[range].iter().filter(move |(end, _)| *end == b).map(|&(_, triangle)| triangle)
    }
}

/// A window: a path of triangles from neighbor to neighbor.
#[derive(Clone, Copy)]
struct Path {
    triangles: [u16; WINDOW_TRIANGLES],
    len: usize,
    /// Vertices, `len + 2` of them.
    refs: [u8; WINDOW_VERTICES],
    turns: u8,
    /// Pivot of the last triangle.
    pivot: u8,
    bounds: Aabb,
}

impl Path {
    /// The path of `triangle` alone, whose corners are `refs`.
    fn begin(triangle: u16, refs: [u8; 3], bounds: Aabb) -> Path {
        let [a, b, c] = refs;
        Path {
            triangles: [triangle; WINDOW_TRIANGLES],
            len: 1,
            refs: [a, b, c, c, c, c, c, c],
            turns: 0,
            pivot: a,
            bounds,
        }
    }

    /// The last two vertices.
    fn tail(&self) -> [u8; 2] {
        [self.refs[self.len], self.refs[self.len + 1]]
    }

    fn last(&self) -> u16 {
        self.triangles[self.len - 1]
    }

    fn contains(&self, triangle: u16) -> bool {
        self.triangles[..self.len].contains(&triangle)
    }
}

struct Best {
    cost: f32,
    path: Path,
}

struct Search<'a> {
    mesh: &'a ClusterMesh,
    neighbors: &'a Neighbors,
    bounds: Vec<Aabb>,
    /// How many free neighbors a triangle has, or that it is taken: a byte each, so that the least is found quickly.
    free_neighbors: Vec<u8>,
    strip_cost: f32,
}

const TAKEN: u8 = u8::MAX;

impl<'a> Search<'a> {
    fn new(mesh: &'a ClusterMesh, neighbors: &'a Neighbors) -> Search<'a> {
        let corners = |t: &[u8; 3]| t.map(|v| mesh.positions[usize::from(v)]);
        let bounds: Vec<Aabb> = mesh.triangles.iter().map(|t| Aabb::of_points(corners(t))).collect();
        let mean_area = bounds.iter().map(Aabb::half_area).sum::<f32>() / bounds.len() as f32;
        let count = |n: &[u16; 3]| n.iter().filter(|&&j| j != NONE).count() as u8;
        Search {
            mesh,
            neighbors,
            free_neighbors: neighbors.0.iter().map(count).collect(),
            strip_cost: mean_area * STRIP_COST,
            bounds,
        }
    }

    /// The free triangle with fewest free neighbors, the first of them.
    fn next_start(&self) -> Option<u16> {
        let fewest = self.free_neighbors.iter().copied().min().filter(|&count| count != TAKEN)?;
        self.free_neighbors.iter().position(|&count| count == fewest).map(|i| i as u16)
    }

    /// The windows of the best strip from `start`; their triangles are not free any more.
    fn take_strip(&mut self, start: u16, max_windows: usize) -> Vec<Path> {
        let first = self.best_first_window(start);
        self.take(&first);
        let mut windows = vec![first];
        while let Some(last) =
            windows.last().filter(|w| w.len == WINDOW_TRIANGLES && windows.len() < max_windows)
        {
            let Some(next) = self.best_next_window(last) else { break };
            self.take(&next);
            windows.push(next);
        }
        windows
    }

    fn best_first_window(&self, start: u16) -> Path {
        let t = self.mesh.triangles[usize::from(start)];
        let begin = |k: usize| {
            let refs = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            Path::begin(start, refs, self.bounds[usize::from(start)])
        };
        let mut best = Best { cost: f32::INFINITY, path: begin(0) };
        for k in 0..3 {
            // To begin with another corner says the same as a turn at the second triangle.
            self.search(&begin(k), false, &mut best);
        }
        best.path
    }

    /// The best window that can follow `last` in a strip: across the edge of its last two vertices, so that it
    /// need not reach back.
    fn best_next_window(&self, last: &Path) -> Option<Path> {
        let [a, b] = last.tail();
        let next = self.free_across(last.last(), a, b)?;
        let begin = Path::begin(next, [a, b, self.third(next, a, b)], self.bounds[usize::from(next)]);
        let mut best = Best { cost: f32::INFINITY, path: begin };
        self.search(&begin, true, &mut best);
        Some(best.path)
    }

    /// Tries every continuation of `path` and keeps the best.
    fn search(&self, path: &Path, may_turn: bool, best: &mut Best) {
        let cost = (path.bounds.half_area() + self.strip_cost) / path.len as f32;
        if cost < best.cost {
            *best = Best { cost, path: *path };
        }
        if path.len == WINDOW_TRIANGLES {
            return;
        }
        let [a, b] = path.tail();
        for (turn, pivot) in [(false, a), (true, path.pivot)] {
            if turn && !may_turn {
                continue;
            }
            let Some(next) = self.free_across(path.last(), pivot, b).filter(|&n| !path.contains(n)) else {
                continue;
            };
            let mut longer = *path;
            longer.triangles[path.len] = next;
            longer.refs[path.len + 2] = self.third(next, pivot, b);
            longer.turns |= u8::from(turn) << path.len;
            longer.pivot = pivot;
            longer.bounds = path.bounds.union(self.bounds[usize::from(next)]);
            longer.len += 1;
            self.search(&longer, true, best);
        }
    }

    /// The free neighbor of `triangle` across its edge between vertices `a` and `b`.
    fn free_across(&self, triangle: u16, a: u8, b: u8) -> Option<u16> {
        let t = &self.mesh.triangles[usize::from(triangle)];
        let k = (0..3).find(|&k| t[k] != a && t[k] != b)?;
        let next = self.neighbors.0[usize::from(triangle)][(k + 1) % 3];
        (next != NONE && self.free_neighbors[usize::from(next)] != TAKEN).then_some(next)
    }

    /// The corner of `triangle` that is neither `a` nor `b`.
    fn third(&self, triangle: u16, a: u8, b: u8) -> u8 {
        let t = self.mesh.triangles[usize::from(triangle)];
        t.into_iter().find(|&v| v != a && v != b).expect("no two corners of a triangle are the same")
    }

    fn take(&mut self, path: &Path) {
        for &t in &path.triangles[..path.len] {
            self.free_neighbors[usize::from(t)] = TAKEN;
            for n in self.neighbors.0[usize::from(t)].into_iter().filter(|&n| n != NONE) {
                let count = &mut self.free_neighbors[usize::from(n)];
                if *count != TAKEN {
                    *count = count.saturating_sub(1);
                }
            }
        }
    }
}

/// Writes the windows of a strip down as vertices, turn bits and a tree.
fn make_strip(mesh: &ClusterMesh, windows: &[Path]) -> Strip {
    let turns: Bytes = windows.iter().map(|w| w.turns).collect();
    let triangles: Vec<u16> = windows.iter().flat_map(|w| &w.triangles[..w.len]).copied().collect();
    let mut refs = Bytes::from_slice(&windows[0].refs[..2]);
    refs.extend(windows.iter().flat_map(|w| w.refs[2..w.len + 2].iter().copied()));
    let source = |(i, &t): (usize, &u16)| {
        let first = refs[strip_triangle(&turns, i)[0]];
        let corner = mesh.triangles[usize::from(t)].iter().position(|&v| v == first);
        Source {
            triangle: u32::from(t),
            first_corner: corner.expect("a strip has the corners of its triangles") as u8,
        }
    };
    let bounds: Vec<Aabb> = windows.iter().map(|w| w.bounds).collect();
    Strip {
        sources: triangles.iter().enumerate().map(source).collect(),
        splits: split_tree(&bounds),
        geometry: mesh.geometries[usize::from(triangles[0])],
        bounds: bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(*b)),
        refs,
        turns,
        radii: Bytes::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every triangle once, wound as it was, one geometry a strip, boxes that enclose.
    fn check(mesh: &ClusterMesh, max_windows: usize) -> Vec<Strip> {
        let strips = stripify(mesh, max_windows);
        let mut seen = vec![false; mesh.triangles.len()];
        for strip in &strips {
            assert_eq!(strip.refs.len(), strip.sources.len() + 2);
            assert!(strip.turns.len() <= max_windows && strip.splits.len() == strip.turns.len() - 1);
            for (i, source) in strip.sources.iter().enumerate() {
                let t = source.triangle as usize;
                let first = usize::from(source.first_corner);
                let expected = [0, 1, 2].map(|k| mesh.triangles[t][(k + first) % 3]);
                assert_eq!(strip_triangle(&strip.turns, i).map(|k| strip.refs[k]), expected);
                assert!(!std::mem::replace(&mut seen[t], true));
                assert_eq!(mesh.geometries[t], strip.geometry);
                assert!(expected.iter().all(|&v| {
                    let p = mesh.positions[usize::from(v)];
                    strip.bounds.contains(&Aabb::EMPTY.grow(p))
                }));
            }
        }
        assert!(seen.into_iter().all(|s| s));
        strips
    }

    fn grid_mesh(side: u8) -> ClusterMesh {
        let at = |x: u8, y: u8| y * side + x;
        let mut triangles = Vec::new();
        for (x, y) in (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| (x, y))) {
            triangles.push([at(x, y), at(x + 1, y), at(x, y + 1)]);
            triangles.push([at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
        }
        let positions =
            (0..side).flat_map(|y| (0..side).map(move |x| Vec3::new(f32::from(x), f32::from(y), 0.0)));
        let geometries = vec![0; triangles.len()];
        ClusterMesh { positions: positions.collect(), triangles, geometries }
    }

    #[test]
    fn a_grid_fills_its_windows() {
        let mesh = grid_mesh(13);
        let strips = check(&mesh, 1);
        let filled = mesh.triangles.len() as f32 / strips.len() as f32;
        assert!(filled > 5.0, "{filled} triangles a strip");
        assert!(check(&mesh, 2).len() < strips.len());
        check(&mesh, 8);
    }

    proptest! {
        #[test]
        fn any_soup_comes_through(
            corners in prop::collection::vec((0u8..24, 1u8..12, 1u8..12, 0u32..2), 1..200), windows in 1usize..4
        ) {
            let triangles: Vec<[u8; 3]> = corners.iter().map(|&(a, b, c, _)| [a, (a + b) % 24, (a + b + c) % 24]).collect();
            let positions = (0..24).map(|i| Vec3::new((i % 5) as f32, (i % 7) as f32, i as f32)).collect();
            let distinct: Vec<usize> = (0..triangles.len()).filter(|&i| triangles[i][0] != triangles[i][2]).collect();
            prop_assume!(!distinct.is_empty());
            let mesh = ClusterMesh {
                positions,
                triangles: distinct.iter().map(|&i| triangles[i]).collect(),
                geometries: distinct.iter().map(|&i| corners[i].3).collect(),
            };
            check(&mesh, windows);
        }
    }
}
