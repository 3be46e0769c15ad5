//! One in-core piece of hair to a hierarchy over windows of strands.
//!
//! Strands come cut into windows of a few segments, which are to strands what strips are to triangles: the leaves of the
//! hierarchy, in clusters that share at most 256 vertices. Windows of a strand that follow each other in a cluster
//! share the point between them, so the hierarchy down to clusters is over pairs of such windows.

use crate::cluster::{Cluster, Grouped, MAX_VERTICES};
use crate::stripify::{Bytes, Source, Strip};
use crate::{Bvh, GROUP_STRIPS, StripTree, bvh, tree_of_clusters};
use glam::Vec3;
use rayon::prelude::*;
use raystrips_geom::strand::ball_bounds;
use raystrips_geom::{Aabb, RadiusCode};
use std::ops::Range;

/// A piece of hair.
#[derive(Clone, Debug, Default)]
pub struct Strands {
    /// Points, strand by strand.
    pub positions: Vec<Vec3>,
    /// Codes of the radii there.
    pub radii: Vec<u8>,
    /// What the strands are cut into, in their order.
    pub windows: Vec<StrandWindow>,
}

/// A few segments of a strand.
#[derive(Clone, Copy, Debug)]
pub struct StrandWindow {
    /// The first of its points; the others follow. Of the next window of the strand that is the last point of this one.
    pub first: u32,
    /// Segments, at most [`raystrips_geom::strand::WINDOW_SEGMENTS`].
    pub segments: u8,
    /// Geometry.
    pub geometry: u32,
}

impl StrandWindow {
    fn points(&self) -> Range<usize> {
        self.first as usize..self.end() as usize + 1
    }

    /// Its last point.
    fn end(&self) -> u32 {
        self.first + u32::from(self.segments)
    }
}

impl Strands {
    fn bounds(&self, window: &StrandWindow, code: RadiusCode) -> Aabb {
        let ball = |point: usize| ball_bounds(self.positions[point], code.decode(self.radii[point]));
        window.points().fold(Aabb::EMPTY, |all, point| all.union(ball(point)))
    }

    /// For each of `windows`, which ascend, the place of its first point among those of all, and how many these are.
    fn places(&self, windows: &[u32]) -> (Vec<usize>, usize) {
        let (mut next, mut last) = (0, None);
        let place = |&i: &u32| {
            let window = &self.windows[i as usize];
            let first = if last == Some(window.first) { next - 1 } else { next };
            next = first + window.points().len();
            last = Some(window.end());
            first
        };
        (windows.iter().map(place).collect(), next)
    }

    /// Pairs of windows of a strand that follow each other, and windows that have no other.
    fn pairs(&self) -> Vec<Range<u32>> {
        let mut pairs: Vec<Range<u32>> = Vec::with_capacity(self.windows.len() / 2);
        for (i, window) in (0..).zip(&self.windows) {
            match pairs.last_mut() {
                Some(last) if last.len() == 1 && self.windows[last.start as usize].end() == window.first => {
                    last.end += 1;
                }
                _ => pairs.push(i..i + 1),
            }
        }
        pairs
    }

    fn fit_cluster(&self, windows: &[u32]) -> bool {
        windows.len() < MAX_VERTICES && self.places(windows).1 <= MAX_VERTICES
    }

    /// `windows` as a cluster. Of all windows there are the numbers of their first segments and their boxes.
    fn cluster(&self, windows: &[u32], first_segments: &[u32], bounds: &[Aabb]) -> (Cluster, Bvh) {
        let (places, count) = self.places(windows);
        let mut vertices = vec![Vec3::ZERO; count];
        let mut strips = Vec::with_capacity(windows.len());
        for (&i, &place) in windows.iter().zip(&places) {
            let window = &self.windows[i as usize];
            let points = window.points();
            vertices[place..place + points.len()].copy_from_slice(&self.positions[points.clone()]);
            let first = first_segments[i as usize];
            let source = |segment| Source { triangle: first + u32::from(segment), first_corner: 0 };
            strips.push(Strip {
                refs: (place..place + points.len()).map(|vertex| vertex as u8).collect(),
                turns: Bytes::new(),
                splits: Vec::new(),
                radii: Bytes::from_slice(&self.radii[points]),
                geometry: window.geometry,
                sources: (0..window.segments).map(source).collect(),
                bounds: bounds[i as usize],
            });
        }
        let Grouped { strips, groups, tree } = Grouped::new(strips, GROUP_STRIPS);
        (Cluster { vertices, strips, groups }, tree)
    }
}

/// The windows of some pairs, ascending.
fn windows_of(pairs: &[Range<u32>], chosen: &[u32]) -> Vec<u32> {
    let mut windows: Vec<u32> = chosen.iter().flat_map(|&pair| pairs[pair as usize].clone()).collect();
    windows.sort_unstable();
    windows
}

/// Builds the hierarchy of a piece of hair. The result does not depend on the number of threads. `finished` is told from
/// any thread how many more segments are done.
///
/// # Panics
/// If there are no windows.
pub fn build_strands(strands: &Strands, code: RadiusCode, finished: &(dyn Fn(usize) + Sync)) -> StripTree {
    let pairs = strands.pairs();
    let bounds: Vec<Aabb> = strands.windows.iter().map(|window| strands.bounds(window, code)).collect();
    let of_pair = |pair: &Range<u32>| {
        bounds[pair.start as usize..pair.end as usize].iter().fold(Aabb::EMPTY, |all, b| all.union(*b))
    };
    let pair_bounds: Vec<Aabb> = pairs.iter().map(of_pair).collect();
    let built = bvh::build(&pair_bounds, &|chosen| {
        chosen.len() < MAX_VERTICES && strands.fit_cluster(&windows_of(&pairs, chosen))
    });
    let before = |sum: &mut u32, window: &StrandWindow| {
        let first = *sum;
        *sum += u32::from(window.segments);
        Some(first)
    };
    let first_segments: Vec<u32> = strands.windows.iter().scan(0, before).collect();
    let cluster = |range: &Range<usize>| {
        let windows = windows_of(&pairs, &built.order[range.clone()]);
        finished(windows.iter().map(|&i| usize::from(strands.windows[i as usize].segments)).sum());
        strands.cluster(&windows, &first_segments, &bounds)
    };
    let clusters = built.tree.leaves().par_iter().map(cluster).unzip();
    tree_of_clusters(built.tree, clusters)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `count` strands of two windows of 4 segments each, side by side.
    fn comb(count: u32) -> (Strands, RadiusCode) {
        let mut strands = Strands::default();
        for i in 0..count {
            let first = strands.positions.len() as u32;
            for k in 0..9 {
                strands.positions.push(Vec3::new(i as f32, k as f32, 0.0));
                strands.radii.push(k);
            }
            for first in [first, first + 4] {
                strands.windows.push(StrandWindow { first, segments: 4, geometry: 0 });
            }
        }
        (strands, RadiusCode::covering(0.01, 0.02))
    }

    #[test]
    fn every_segment_is_in_one_strip_with_its_points_and_radii() {
        let (strands, code) = comb(500);
        let built = build_strands(&strands, code, &|_| ());
        let mut seen = vec![false; 4000];
        for cluster in &built.clusters {
            assert!(cluster.vertices.len() <= MAX_VERTICES);
            for strip in &cluster.strips {
                for (k, source) in strip.sources.iter().enumerate() {
                    let segment = source.triangle as usize;
                    assert!(!std::mem::replace(&mut seen[segment], true));
                    let point = segment / 8 * 9 + segment % 8;
                    let vertex = |k: usize| cluster.vertices[usize::from(strip.refs[k])];
                    assert_eq!(vertex(k), strands.positions[point]);
                    assert_eq!(vertex(k + 1), strands.positions[point + 1]);
                    assert_eq!(strip.radii[k..k + 2], strands.radii[point..point + 2]);
                    assert!([k, k + 1].iter().all(|&k| strip.bounds.contains(&ball_bounds(vertex(k), 0.01))));
                }
            }
        }
        assert!(seen.iter().all(|&seen| seen));
        // Points between windows of a strand are not stored twice.
        let stored: usize = built.clusters.iter().map(|cluster| cluster.vertices.len()).sum();
        assert!(stored < 4700, "{stored} of 4500 points");
    }
}
