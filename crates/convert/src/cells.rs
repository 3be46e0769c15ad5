//! How triangles are spread over space: counts and boxes of the cells of a grid, and of finer cells where one holds
//! more than a piece may.
//!
//! Memory: 32 bytes a cell, of at most one for every 64 triangles at the first level, and for every 64 triangles in
//! divided cells at the others; little of that is touched where triangles make up surfaces.

use crate::hash::FastMap;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use raystrips_geom::{Aabb, morton};

/// Bits a axis of the cells of the first level: as few as give a cell for every 512 triangles, so that a surface, which is
/// in few of the cells, still has many in each piece.
const FIRST_BITS: std::ops::RangeInclusive<u32> = 3..=7;
const TRIANGLES_PER_CELL: u64 = 512;
/// Bits that every further level adds, and the bits where that ends: as fine as the f32 of most scenes.
const MORE_BITS: u32 = 4;
const MOST_BITS: u32 = 19;

/// Triangles longer than this share of the scene are outsized: kept apart, so that the boxes of cells are as small as
/// what else is in them.
const OUTSIZED: f32 = 1.0 / 16.0;
/// Bit of the keys of outsized triangles, above those of Morton keys.
const OUTSIZED_BIT: u64 = 1 << (3 * morton::AXIS_BITS);

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

    /// A grid that keeps no triangles apart.
    pub fn for_all(bounds: Aabb) -> KeyGrid {
        KeyGrid { outsized_extent: f32::INFINITY, ..KeyGrid::new(bounds) }
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

/// A cell as it is kept: zeros mean that nothing is in it, so that memory is taken for those that are used.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Cell {
    /// Triangles; in the end the number of the leaf, see [`Cells::number`].
    count: u64,
    min: [f32; 3],
    max: [f32; 3],
}

impl Cell {
    fn tally(&self) -> Tally {
        let bounds = Aabb { min: Vec3::from_array(self.min), max: Vec3::from_array(self.max) };
        Tally { count: self.count, bounds: if self.count == 0 { Aabb::EMPTY } else { bounds } }
    }
}

/// Cells of one size.
struct Level {
    bits: u32,
    /// For each divided cell of the level before the place of its first cell here.
    first: FastMap<u64, usize>,
    cells: Vec<Cell>,
}

impl Level {
    /// The place of the cell with this key.
    #[inline]
    fn place(&self, key: u64) -> Option<usize> {
        let cell = key >> shift(self.bits);
        if self.first.is_empty() {
            return Some(cell as usize);
        }
        let first = self.first.get(&(cell >> (3 * MORE_BITS)))?;
        Some(first + (cell as usize & ((1 << (3 * MORE_BITS)) - 1)))
    }
}

/// The cells of all levels.
pub(crate) struct Cells {
    levels: Vec<Level>,
    /// Triangles from which on a cell is divided.
    most: u64,
}

/// What is in the cells of a level while it is counted.
pub(crate) struct Tallies(Vec<Cell>);

impl Tallies {
    /// Adds to the cell at `place`.
    pub fn add(&mut self, place: usize, tally: &Tally) {
        let mut sum = self.0[place].tally();
        sum.add(tally);
        let Aabb { min, max } = sum.bounds;
        self.0[place] = Cell { count: sum.count, min: min.to_array(), max: max.to_array() };
    }
}

/// A cell that is not divided.
pub(crate) struct LeafCell {
    pub tally: Tally,
    pub is_outsized: bool,
}

/// Marks divided cells in the end.
const DIVIDED: u64 = u64::MAX;

impl Cells {
    /// Empty cells for so many triangles. Those with more than `most` in them are to be divided.
    pub fn new(triangles: u64, most: u64) -> Cells {
        let bits = first_bits(triangles);
        // The second half is for outsized triangles.
        let cells = bytemuck::allocation::zeroed_vec(2 << (3 * bits));
        Cells { levels: vec![Level { bits, first: FastMap::default(), cells }], most }
    }

    /// Most bytes of the first level and of what is made of it for so many triangles.
    pub fn most_bytes(triangles: u64) -> u64 {
        const BYTES: usize = size_of::<Cell>() + size_of::<LeafCell>() + 3 * size_of::<Aabb>();
        (BYTES as u64) << (3 * first_bits(triangles))
    }

    /// The place of the cell of the last level that this key belongs to; `None` for triangles that are in cells of earlier
    /// levels.
    #[inline]
    pub fn to_count(&self, key: u64) -> Option<usize> {
        self.levels.last().expect("there is a level").place(key)
    }

    /// What is in the cells of the last level: to be added to, and given to [`Cells::divide`].
    pub fn tallies(&mut self) -> Tallies {
        Tallies(std::mem::take(&mut self.levels.last_mut().expect("there is a level").cells))
    }

    /// Ends the counting of the last level. True if cells of it are to be divided and counted again.
    pub fn divide(&mut self, tallies: Tallies) -> bool {
        self.levels.last_mut().expect("there is a level").cells = tallies.0;
        let level = self.levels.last().expect("there is a level");
        if level.bits + MORE_BITS > MOST_BITS {
            return false;
        }
        let mut next = Level { bits: level.bits + MORE_BITS, first: FastMap::default(), cells: Vec::new() };
        let crowded = level.keys().filter(|&(place, _)| level.cells[place].count > self.most);
        for (i, (_, cell)) in crowded.enumerate() {
            next.first.insert(cell, i << (3 * MORE_BITS));
        }
        next.cells = bytemuck::allocation::zeroed_vec(next.first.len() << (3 * MORE_BITS));
        let any = !next.first.is_empty();
        if any {
            self.levels.push(next);
        }
        any
    }

    /// Ends all counting and numbers the cells that are neither empty nor divided, in an order that depends on them
    /// alone.
    pub fn number(&mut self) -> Vec<LeafCell> {
        let mut leaves = Vec::new();
        for i in 0..self.levels.len() {
            let (level, finer) = self.levels[i..].split_first_mut().expect("there is a level");
            let mut used: Vec<(usize, u64)> =
                level.keys().filter(|&(place, _)| level.cells[place].count > 0).collect();
            used.sort_unstable_by_key(|&(_, cell)| cell);
            for (place, cell) in used {
                let contents = &mut level.cells[place];
                if finer.first().is_some_and(|finer| finer.first.contains_key(&cell)) {
                    contents.count = DIVIDED;
                } else {
                    let is_outsized = cell & OUTSIZED_BIT >> shift(level.bits) != 0;
                    leaves.push(LeafCell { tally: contents.tally(), is_outsized });
                    contents.count = leaves.len() as u64 - 1;
                }
            }
        }
        leaves
    }

    /// Number of the cell that holds a triangle with this key, which must have been counted.
    #[inline]
    pub fn leaf(&self, key: u64) -> u32 {
        let in_level =
            |level: &Level| Some(level.cells[level.place(key)?].count).filter(|&leaf| leaf != DIVIDED);
        self.levels.iter().find_map(in_level).expect("the triangle was counted") as u32
    }
}

impl Level {
    /// Place and number of every cell.
    fn keys(&self) -> impl Iterator<Item = (usize, u64)> {
        let whole = self.first.is_empty().then(|| (0..self.cells.len()).map(|place| (place, place as u64)));
        let parts = self.first.iter().flat_map(|(&parent, &first)| {
            (0..1 << (3 * MORE_BITS)).map(move |i| (first + i, parent << (3 * MORE_BITS) | i as u64))
        });
        whole.into_iter().flatten().chain(parts)
    }
}

/// Bits a axis of the first level for so many triangles.
fn first_bits(triangles: u64) -> u32 {
    let enough = |bits: &u32| 1 << (3 * bits) >= triangles / TRIANGLES_PER_CELL;
    FIRST_BITS.into_iter().find(enough).unwrap_or(*FIRST_BITS.end())
}

fn shift(bits: u32) -> u32 {
    3 * (morton::AXIS_BITS - bits)
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
        let mut cells = Cells::new(23, 11);
        let mut passes = 0;
        loop {
            passes += 1;
            let mut tallies = cells.tallies();
            for (bounds, count) in &triangles {
                if let Some(cell) = cells.to_count(grid.key(bounds)) {
                    tallies.add(cell, &tally(*count, bounds.min));
                }
            }
            if !cells.divide(tallies) {
                break;
            }
        }
        assert_eq!(passes, 5);
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
        let mut cells = Cells::new(2, 1);
        let mut tallies = cells.tallies();
        for side in [1.0, 90.0] {
            let bounds = Aabb { min: Vec3::splat(50.0 - side / 2.0), max: Vec3::splat(50.0 + side / 2.0) };
            let cell = cells.to_count(grid.key(&bounds)).unwrap();
            tallies.add(cell, &Tally { count: 1, bounds });
        }
        assert!(!cells.divide(tallies));
        assert_eq!(cells.number().iter().map(|l| l.is_outsized).collect::<Vec<_>>(), [false, true]);
    }
}
