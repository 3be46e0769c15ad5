//! How triangles are spread over space: counts and boxes of the cells of a grid, and of finer cells where one holds
//! more than a piece may.
//!
//! Memory: some 60 bytes for each cell with triangles in it, of which a surface has at most some hundred thousand.

use crate::hash::FastMap;
use glam::Vec3;
use raystrips_geom::{Aabb, morton};

/// Bits a axis of the cells of each level. The first is fine enough for the surface area heuristic to see shapes
/// at the size of pieces in scans of 10^8 triangles; the last is as fine as the f32 of most scenes.
const LEVEL_BITS: [u32; 4] = [7, 11, 15, 19];

/// Triangles longer than this share of the scene are outsized: kept apart, so that the boxes of cells are as small as
/// what else is in them.
const OUTSIZED: f32 = 1.0 / 16.0;
/// Bit of the keys of outsized triangles, above those of Morton keys.
const OUTSIZED_BIT: u64 = 1 << 63;

/// Gives triangles their keys: where they are, to 21 bits a axis, and whether they are outsized.
#[derive(Clone, Copy)]
pub(crate) struct KeyGrid {
    min: Vec3,
    scale: f32,
    outsized_extent: f32,
}

impl KeyGrid {
    /// A grid of one cell.
    pub fn single() -> KeyGrid {
        KeyGrid { min: Vec3::ZERO, scale: 0.0, outsized_extent: f32::INFINITY }
    }

    pub fn new(bounds: Aabb) -> KeyGrid {
        let extent = bounds.extent().max_element();
        let scale = (1u32 << morton::AXIS_BITS) as f32 / extent;
        KeyGrid { min: bounds.min, scale, outsized_extent: extent * OUTSIZED }
    }

    /// The key of a triangle with this box.
    #[inline]
    pub fn key(&self, bounds: &Aabb) -> u64 {
        const LAST: u32 = (1 << morton::AXIS_BITS) - 1;
        let place = ((bounds.min + bounds.max) * 0.5 - self.min) * self.scale;
        let key = morton::encode([place.x, place.y, place.z].map(|x| (x as u32).min(LAST)));
        let outsized = bounds.extent().max_element() > self.outsized_extent;
        key | if outsized { OUTSIZED_BIT } else { 0 }
    }
}

/// What is in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tally {
    pub count: u64,
    pub bounds: Aabb,
}

impl Tally {
    pub const NONE: Tally = Tally { count: 0, bounds: Aabb::EMPTY };

    #[inline]
    pub fn add(&mut self, other: &Tally) {
        self.count += other.count;
        self.bounds = self.bounds.union(other.bounds);
    }
}

struct Cell {
    tally: Tally,
    /// Its place in [`Cells::leaves`], or none if it is divided.
    leaf: Option<u32>,
}

/// The cells of all levels.
pub(crate) struct Cells {
    levels: Vec<FastMap<u64, Cell>>,
}

/// A cell that is not divided.
pub(crate) struct LeafCell {
    pub tally: Tally,
    pub is_outsized: bool,
}

impl Cells {
    /// None yet.
    pub fn new() -> Cells {
        Cells { levels: Vec::new() }
    }

    /// The cell of the level to be counted next; `None` for triangles whose cell is not divided.
    #[inline]
    pub fn to_count(&self, key: u64) -> Option<u64> {
        let level = self.levels.len();
        let divided =
            |level: usize| self.levels[level].get(&cell_of(key, level)).is_some_and(|c| c.leaf.is_none());
        (0..level).all(divided).then(|| cell_of(key, level))
    }

    /// Adds a level that was counted. True if cells of it hold more than `most`: they are divided, and another level
    /// is to be counted.
    pub fn add_level(&mut self, tallies: FastMap<u64, Tally>, most: u64) -> bool {
        let is_last = self.levels.len() + 1 == LEVEL_BITS.len();
        let cell = |tally: Tally| {
            let leaf = if tally.count > most && !is_last { None } else { Some(0) };
            Cell { tally, leaf }
        };
        let level: FastMap<u64, Cell> = tallies.into_iter().map(|(at, tally)| (at, cell(tally))).collect();
        let divided = level.values().any(|cell| cell.leaf.is_none());
        self.levels.push(level);
        divided
    }

    /// Ends all counting and numbers the cells that are not divided, in an order that depends on them alone.
    pub fn number(&mut self) -> Vec<LeafCell> {
        let mut leaves: Vec<(u64, usize, &mut Cell)> = Vec::new();
        for (level, cells) in self.levels.iter_mut().enumerate() {
            let undivided = cells.iter_mut().filter(|(_, cell)| cell.leaf.is_some());
            leaves.extend(undivided.map(|(&cell, contents)| (cell, level, contents)));
        }
        leaves.sort_unstable_by_key(|&(cell, level, _)| (level, cell));
        let number = |(i, (cell, level, contents)): (usize, (u64, usize, &mut Cell))| {
            contents.leaf = Some(i as u32);
            let is_outsized = cell & OUTSIZED_BIT >> shift(level) != 0;
            LeafCell { tally: contents.tally, is_outsized }
        };
        leaves.into_iter().enumerate().map(number).collect()
    }

    /// Number of the cell that holds a triangle with this key, which must have been counted.
    #[inline]
    pub fn leaf(&self, key: u64) -> u32 {
        let leaf = |level: usize| self.levels[level].get(&cell_of(key, level)).and_then(|cell| cell.leaf);
        (0..self.levels.len()).find_map(leaf).expect("the triangle was counted")
    }
}

fn shift(level: usize) -> u32 {
    3 * (morton::AXIS_BITS - LEVEL_BITS[level])
}

fn cell_of(key: u64, level: usize) -> u64 {
    key >> shift(level)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tally(count: u64, at: Vec3) -> Tally {
        Tally { count, bounds: Aabb::EMPTY.grow(at) }
    }

    #[test]
    fn crowded_cells_are_divided_until_they_are_not() {
        let grid = KeyGrid::new(Aabb { min: Vec3::ZERO, max: Vec3::ONE });
        let near = |d: f32| Aabb::EMPTY.grow(Vec3::splat(0.9 + d));
        let triangles = [(near(0.0), 5), (near(1e-5), 7), (near(-0.5), 11)];
        let mut cells = Cells::new();
        let mut passes = 0;
        loop {
            passes += 1;
            let mut level = FastMap::default();
            for (bounds, count) in &triangles {
                if let Some(cell) = cells.to_count(grid.key(bounds)) {
                    level.entry(cell).or_insert(Tally::NONE).add(&tally(*count, bounds.min));
                }
            }
            if !cells.add_level(level, 11) {
                break;
            }
        }
        assert_eq!(passes, 4);
        let leaves = cells.number();
        assert_eq!(leaves.iter().map(|l| l.tally.count).collect::<Vec<_>>(), [11, 5, 7]);
        for (bounds, count) in &triangles {
            let leaf = &leaves[cells.leaf(grid.key(bounds)) as usize];
            assert!(leaf.tally.count == *count && leaf.tally.bounds == *bounds && !leaf.is_outsized);
        }
    }

    #[test]
    fn long_triangles_are_apart() {
        let grid = KeyGrid::new(Aabb { min: Vec3::ZERO, max: Vec3::splat(100.0) });
        let mut cells = Cells::new();
        let mut level = FastMap::default();
        for side in [1.0, 90.0] {
            let bounds = Aabb { min: Vec3::splat(50.0 - side / 2.0), max: Vec3::splat(50.0 + side / 2.0) };
            let cell = cells.to_count(grid.key(&bounds)).unwrap();
            level.insert(cell, Tally { count: 1, bounds });
        }
        assert!(!cells.add_level(level, 1));
        assert_eq!(cells.number().iter().map(|l| l.is_outsized).collect::<Vec<_>>(), [false, true]);
    }
}
