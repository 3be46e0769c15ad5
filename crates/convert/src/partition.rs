//! Which triangle or window of a strand goes to which piece: the top of the hierarchy, by the surface area heuristic over
//! cells of space in which these are counted.
//!
//! Pieces do not depend on threads or memory, so neither does the pack. To sort triangles along a space-filling curve
//! and cut the order into pieces would need no counting, but boxes of such pieces overlap more.

use crate::block::Block;
use crate::blocks::Blocks;
use crate::cells::{Cells, KeyGrid, LeafCell, Tally};
use crate::hash::FastMap;
use crate::positions::ToPack;
use crate::{ConvertError, Observer, Stage};
use glam::Vec3;
use raystrips_geom::Aabb;
use raystrips_pack::GeometryBounds;
use raystrips_strips::{Bvh, bvh};
use serde::{Deserialize, Serialize};

/// Most triangles, or windows of strands, of a piece, as long as space can tell them apart: what a thread builds at a time.
pub(crate) const PIECE_TRIANGLES: u64 = 1 << 18;
/// Fewer triangles make a piece only where the heuristic finds no other way: every piece ends a page.
const LEAST_TRIANGLES: u64 = PIECE_TRIANGLES / 16;

/// How space is divided.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Division {
    /// By the surface area heuristic: pieces are the top of the hierarchy.
    SurfaceArea,
    /// So that this `part` of the triangles is on one side of every plane: other parts move all planes. Pieces have `most`
    /// triangles at most.
    Quantiles { part: f64, most: u64 },
}

/// What a look at all triangles tells.
pub(crate) struct Partition {
    pub grid: KeyGrid,
    cells: Cells,
    /// Leaf of `tree` for each cell.
    leaf_of_cell: Vec<u32>,
    /// Leaves are numbered from 0.
    pub tree: Bvh,
    /// What the counting told beside that.
    pub census: Census,
}

/// What a look at all triangles tells, wherever they are.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Census {
    /// Triangles left out for want of an area.
    pub degenerate: u64,
    /// Most by which a coordinate is moved.
    pub position_error: f64,
    /// Least and greatest corner of each geometry, as far as there are triangles.
    bounds: Vec<([f32; 3], [f32; 3])>,
}

impl Census {
    /// Takes in what another look has told.
    pub fn merge(&mut self, other: &Census) {
        self.degenerate += other.degenerate;
        self.position_error = self.position_error.max(other.position_error);
        for (geometry, &(min, max)) in other.bounds.iter().enumerate() {
            let bounds = Aabb { min: Vec3::from_array(min), max: Vec3::from_array(max) };
            self.grow(geometry, bounds);
        }
    }

    fn grow(&mut self, geometry: usize, bounds: Aabb) {
        let empty = (Aabb::EMPTY.min.to_array(), Aabb::EMPTY.max.to_array());
        self.bounds.resize(self.bounds.len().max(geometry + 1), empty);
        let (min, max) = &mut self.bounds[geometry];
        let all = Aabb { min: Vec3::from_array(*min), max: Vec3::from_array(*max) }.union(bounds);
        (*min, *max) = (all.min.to_array(), all.max.to_array());
    }

    /// Box of each of so many geometries.
    pub fn geometry_bounds(&self, geometries: usize) -> Vec<GeometryBounds> {
        let empty = (Aabb::EMPTY.min.to_array(), Aabb::EMPTY.max.to_array());
        let bounds = self.bounds.iter().copied().chain(std::iter::repeat(empty)).take(geometries);
        bounds.map(|(min, max)| GeometryBounds { min, max }).collect()
    }

    fn add(&mut self, counted: &Counted) {
        self.degenerate += counted.degenerate;
        self.position_error = self.position_error.max(counted.position_error);
        self.grow(counted.geometry as usize, counted.bounds);
    }
}

impl Partition {
    /// The leaf that a triangle with this box belongs to.
    #[inline]
    pub fn leaf(&self, bounds: &Aabb) -> u32 {
        self.leaf_of_cell[self.cells.leaf(self.grid.key(bounds)) as usize]
    }
}

/// Counts all triangles of `blocks`, which lie in `bounds`, and divides them. `None` if none has an area.
pub(crate) fn partition(
    blocks: &Blocks,
    bounds: Aabb,
    to_pack: &ToPack,
    division: Division,
    observer: &dyn Observer,
) -> Result<Option<Partition>, ConvertError> {
    let most = match division {
        Division::SurfaceArea => PIECE_TRIANGLES,
        Division::Quantiles { most, .. } => most,
    };
    let grid = match division {
        _ if blocks.triangles <= most => KeyGrid::single(),
        Division::SurfaceArea => KeyGrid::new(bounds),
        Division::Quantiles { .. } => KeyGrid::for_all(bounds),
    };
    let mut cells = Cells::new(blocks.triangles, most);
    let census = loop {
        let mut tallies = cells.tallies();
        let mut census = Census::default();
        let count = |block: Block| count(&block, &grid, &cells, to_pack, blocks.keeps_flat);
        blocks.for_each(Stage::Partition, observer, count, |counted| {
            census.add(&counted);
            counted.cells.iter().for_each(|(&cell, tally)| tallies.add(cell as usize, tally));
            Ok(())
        })?;
        if !cells.divide(tallies) {
            break census;
        }
    };
    let leaf_cells = cells.number();
    if leaf_cells.is_empty() {
        return Ok(None);
    }
    let (tree, leaf_of_cell) = match division {
        Division::SurfaceArea => by_surface_area(&leaf_cells),
        Division::Quantiles { part, most } => by_quantiles(&leaf_cells, part, most),
    };
    Ok(Some(Partition { grid, cells, leaf_of_cell, tree, census }))
}

/// What one block adds.
struct Counted {
    /// By the places of their cells.
    cells: FastMap<u64, Tally>,
    degenerate: u64,
    position_error: f64,
    geometry: u32,
    bounds: Aabb,
}

fn count(block: &Block, grid: &KeyGrid, cells: &Cells, to_pack: &ToPack, keeps_flat: bool) -> Counted {
    let mut counted = Counted {
        cells: FastMap::default(),
        degenerate: 0,
        position_error: 0.0,
        geometry: block.geometry(),
        bounds: Aabb::EMPTY,
    };
    let mut positions = Vec::new();
    for position in block.positions() {
        let placed = to_pack.place(position);
        counted.position_error = counted.position_error.max(to_pack.error(position, placed));
        positions.push(placed);
    }
    // Neighbors in the file are mostly in the same cell.
    let mut last = (None, Tally::NONE);
    block.for_each_box(&positions, to_pack, keeps_flat, |_, bounds| {
        let Some(bounds) = bounds else {
            counted.degenerate += 1;
            return;
        };
        counted.bounds = counted.bounds.union(bounds);
        let cell = cells.to_count(grid.key(&bounds));
        if cell != last.0 {
            counted.add(&last);
            last = (cell, Tally::NONE);
        }
        last.1.add(&Tally { count: 1, bounds });
    });
    counted.add(&last);
    counted
}

impl Counted {
    fn add(&mut self, (cell, tally): &(Option<usize>, Tally)) {
        if let Some(cell) = cell {
            self.cells.entry(*cell as u64).or_insert(Tally::NONE).add(tally);
        }
    }
}

/// A hierarchy over cells with numbered leaves, each at most a piece or a single cell, and the leaf of each cell.
fn by_surface_area(cells: &[LeafCell]) -> (Bvh, Vec<u32>) {
    let mut leaf_of_cell = vec![0; cells.len()];
    let mut next = 0;
    let mut trees = [false, true].into_iter().filter_map(|outsized| {
        let members: Vec<u32> =
            (0..cells.len() as u32).filter(|&i| cells[i as usize].is_outsized == outsized).collect();
        let tally = |i: u32| &cells[members[i as usize] as usize].tally;
        let bounds: Vec<Aabb> = (0..members.len() as u32).map(|i| tally(i).bounds).collect();
        if bounds.is_empty() {
            return None;
        }
        let weight = |i| tally(i).count;
        let is_leaf = |group: &[u32]| group.iter().map(|&i| weight(i)).sum::<u64>() <= PIECE_TRIANGLES;
        let built = bvh::build_weighted(&bounds, &weight, LEAST_TRIANGLES, &is_leaf);
        for leaf in built.tree.leaves() {
            for &i in &built.order[leaf] {
                leaf_of_cell[members[i as usize] as usize] = next;
            }
            next += 1;
        }
        Some(built.tree)
    });
    let tree = match (trees.next(), trees.next()) {
        (Some(a), Some(b)) => Bvh::join(a, b),
        (a, b) => a.or(b).expect("there are cells"),
    };
    drop(trees);
    (tree.number_leaves(), leaf_of_cell)
}

/// The same for pieces that are not in the hierarchy of a pack.
fn by_quantiles(cells: &[LeafCell], part: f64, most: u64) -> (Bvh, Vec<u32>) {
    let mut leaf_of_cell = vec![0; cells.len()];
    let mut members: Vec<u32> = (0..cells.len() as u32).collect();
    let mut next = 0;
    let mut leaf = |leaf: &[u32]| {
        leaf.iter().for_each(|&cell| leaf_of_cell[cell as usize] = next);
        next += 1;
    };
    let tree = quantiles(cells, part, most, &mut members, &mut leaf);
    (tree.number_leaves(), leaf_of_cell)
}

/// Divides `members` of `cells` along the longest axis of their centers, again and again.
fn quantiles(
    cells: &[LeafCell],
    part: f64,
    most: u64,
    members: &mut [u32],
    leaf: &mut dyn FnMut(&[u32]),
) -> Bvh {
    let tally = |i: u32| &cells[i as usize].tally;
    let total: u64 = members.iter().map(|&i| tally(i).count).sum();
    if total <= most || members.len() == 1 {
        leaf(members);
        let bounds = members.iter().fold(Aabb::EMPTY, |all, &i| all.union(tally(i).bounds));
        return Bvh::Leaf { bounds, items: 0..1 };
    }
    let center = |i: u32| tally(i).bounds.center();
    let extent = Aabb::of_points(members.iter().map(|&i| center(i))).extent();
    let axis = (0..3).fold(0, |a, b| if extent[b] > extent[a] { b } else { a });
    members.sort_unstable_by(|&a, &b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b)));
    let mut before = 0;
    let is_first = |&i: &u32| {
        before += tally(i).count;
        before as f64 <= part * total as f64
    };
    let count = members.iter().copied().take_while(is_first).count().clamp(1, members.len() - 1);
    let (first, second) = members.split_at_mut(count);
    let [a, b] = [first, second].map(|members| quantiles(cells, part, most, members, leaf));
    Bvh::join(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_neither_too_large_nor_too_small() {
        // A plate of cells with few triangles each, and one long triangle across all.
        let cell = |x: u32, y: u32| {
            let min = Vec3::new(x as f32, y as f32, 0.0);
            let bounds = Aabb { min, max: min + Vec3::new(1.0, 1.0, 0.1) };
            LeafCell { tally: Tally { count: u64::from(500 + x * 10), bounds }, is_outsized: false }
        };
        let mut cells: Vec<LeafCell> = (0..64).flat_map(|x| (0..64).map(move |y| cell(x, y))).collect();
        let all = cells.iter().fold(Aabb::EMPTY, |all, c| all.union(c.tally.bounds));
        cells.push(LeafCell { tally: Tally { count: 1, bounds: all }, is_outsized: true });
        let (tree, leaf_of_cell) = by_surface_area(&cells);
        let leaves = tree.leaves().len();
        let mut counts = vec![0; leaves];
        for (cell, &leaf) in cells.iter().zip(&leaf_of_cell) {
            counts[leaf as usize] += cell.tally.count;
        }
        assert_eq!(counts.pop(), Some(1));
        assert!(counts.len() > 10 && counts.iter().all(|c| (LEAST_TRIANGLES..=PIECE_TRIANGLES).contains(c)));
    }
}
