//! Clusters: groups of triangles that share at most 256 vertices, so that a byte names one.

use crate::bvh::Bvh;
use crate::groups::group;
use crate::stripify::{ClusterMesh, Strip, stripify};
use crate::{Mesh, StripParams};
use glam::Vec3;
use raystrips_geom::Aabb;
use std::ops::Range;

/// Most vertices of a cluster.
pub const MAX_VERTICES: usize = 256;
/// Most triangles: a closed surface of 256 vertices has 508, and even triangles that share nothing but corners
/// must keep the strips of a cluster within what a page can number.
pub const MAX_TRIANGLES: usize = 640;

/// A finished cluster.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// Vertices, by first use in the strips.
    pub vertices: Vec<Vec3>,
    /// Strips, group by group, in a group by geometry.
    pub strips: Vec<Strip>,
    /// Strips that are the children of one node.
    pub groups: Vec<Range<usize>>,
}

/// True where `triangles` can be one cluster.
pub fn fits(mesh: &Mesh, triangles: &[u32]) -> bool {
    triangles.len() <= MAX_TRIANGLES && {
        let vertices = triangles.iter().flat_map(|&t| mesh.triangles[t as usize]);
        let geometries = triangles.iter().map(|&t| mesh.geometries[t as usize]);
        let first = mesh.geometries[triangles[0] as usize];
        are_few(vertices) && (geometries.clone().all(|g| g == first) || are_few(geometries))
    }
}

/// True if there are at most [`MAX_VERTICES`] different values.
fn are_few(mut values: impl Iterator<Item = u32>) -> bool {
    let mut seen = SmallMap::default();
    values.all(|value| usize::from(seen.number(value)) < MAX_VERTICES)
}

impl Cluster {
    /// Makes strips of `triangles`, groups of at most `width` strips, and a hierarchy whose leaves are single
    /// groups.
    pub fn build(mesh: &Mesh, triangles: &[u32], params: &StripParams, width: usize) -> (Cluster, Bvh) {
        let local = localize(mesh, triangles);
        let strips = stripify(&local, params.max_windows);
        let Grouped { mut strips, groups, tree } = Grouped::new(strips, width);
        for source in strips.iter_mut().flat_map(|s| &mut s.sources) {
            source.triangle = triangles[source.triangle as usize];
        }
        let vertices = renumber_by_first_use(&mut strips, &local.positions);
        (Cluster { vertices, strips, groups }, tree)
    }
}

/// Strips in groups that fill nodes, in a group by geometry, and a hierarchy whose leaves are single groups.
pub(crate) struct Grouped {
    pub strips: Vec<Strip>,
    pub groups: Vec<Range<usize>>,
    pub tree: Bvh,
}

impl Grouped {
    /// Groups of at most `width` strips.
    pub fn new(strips: Vec<Strip>, width: usize) -> Grouped {
        let bounds: Vec<Aabb> = strips.iter().map(|s| s.bounds).collect();
        let grouped = group(&bounds, width);
        let groups = grouped.tree.leaves();
        let mut strips = in_order(strips, &grouped.order);
        for group in &groups {
            strips[group.clone()].sort_by_key(|strip| strip.geometry);
        }
        Grouped { strips, groups, tree: grouped.tree.number_leaves() }
    }
}

fn in_order(strips: Vec<Strip>, order: &[u32]) -> Vec<Strip> {
    let mut slots: Vec<Option<Strip>> = strips.into_iter().map(Some).collect();
    let take = |&i: &u32| slots[i as usize].take().expect("an order names each strip once");
    order.iter().map(take).collect()
}

/// Numbers vertices by first use in the strips, so that neighbors in a strip are neighbors in memory.
fn renumber_by_first_use(strips: &mut [Strip], positions: &[Vec3]) -> Vec<Vec3> {
    let mut number: Vec<Option<u8>> = vec![None; positions.len()];
    let mut vertices = Vec::with_capacity(positions.len());
    for r in strips.iter_mut().flat_map(|s| &mut s.refs) {
        let old = usize::from(*r);
        *r = *number[old].get_or_insert_with(|| {
            vertices.push(positions[old]);
            (vertices.len() - 1) as u8
        });
    }
    vertices
}

/// The triangles of a cluster over its own vertices.
fn localize(mesh: &Mesh, triangles: &[u32]) -> ClusterMesh {
    let mut numbers = SmallMap::default();
    let mut positions = Vec::with_capacity(MAX_VERTICES);
    let mut local = |v: u32| {
        let number = numbers.number(v);
        if usize::from(number) == positions.len() {
            positions.push(mesh.positions[v as usize]);
        }
        number as u8
    };
    let local_triangles = triangles.iter().map(|&t| mesh.triangles[t as usize].map(&mut local)).collect();
    let geometries = triangles.iter().map(|&t| mesh.geometries[t as usize]).collect();
    ClusterMesh { positions, triangles: local_triangles, geometries }
}

/// Numbers up to [`MAX_VERTICES`] + 1 values from 0 on: open addressing in a fixed table, for a test that runs for every
/// group of triangles near the size of a cluster.
struct SmallMap {
    values: [u32; Self::SLOTS],
    numbers: [u16; Self::SLOTS],
    len: u16,
}

impl SmallMap {
    const SLOTS: usize = 1024;
    /// No mesh piece has so many vertices.
    const FREE: u32 = u32::MAX;

    /// The number of `value`, which is the next one if it was not there before.
    #[inline]
    fn number(&mut self, value: u32) -> u16 {
        let mut slot = (value.wrapping_mul(0x9E37_79B1) >> 22) as usize;
        while self.values[slot] != value {
            if self.values[slot] == Self::FREE {
                self.values[slot] = value;
                self.numbers[slot] = self.len;
                self.len += 1;
                break;
            }
            slot = (slot + 1) % Self::SLOTS;
        }
        self.numbers[slot]
    }
}

impl Default for SmallMap {
    fn default() -> SmallMap {
        SmallMap { values: [Self::FREE; Self::SLOTS], numbers: [0; Self::SLOTS], len: 0 }
    }
}
