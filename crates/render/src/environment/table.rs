//! A distribution of directions that is constant over the cells of a grid: first a row is picked, then a cell of it
//! (after section 14.2.4 of "Physically Based Rendering", 3rd edition).
//!
//! Rows are cut by the angle from above, as those of the picture, but a place within a cell is even over solid angle: a row
//! is cut by the cosine. Densities over solid angle are then those of cells, without a sine that vanishes at the poles.
//!
//! A part is looked for from where a guide of as many entries says, which takes two steps in the mean (Chen and Asau 1974).
//!
//! Sums are multiples of 2^-24, as random numbers are, so each cell is found exactly as often as its density says. What has
//! less than half of that of its row is never found, and left to rays that find it by chance.

use crate::color::luminance;
use glam::Vec3;
use std::f64::consts::{PI, TAU};

/// Most cells of a row, and rows: at a sixth of a degree, a third of the sun.
const MOST_COLUMNS: usize = 2048;
const MOST_ROWS: usize = 1024;

/// Units of sums in 1.
const ONE: u32 = 1 << 24;

/// The cells.
#[derive(Clone)]
pub(super) struct Table {
    columns: usize,
    rows: usize,
    /// Cosines of the angle from above between rows.
    cosines: Vec<f64>,
    /// Of rows.
    row_shares: Shares,
    /// Of the cells of each row.
    cell_shares: Shares,
    /// Integral of luminance over solid angle.
    total: f64,
}

/// Lists of as many parts each, that all are shares of 1.
#[derive(Clone)]
struct Shares {
    /// Those of a list up to and including each.
    sums: Vec<u32>,
    /// For as many even steps to 1 as there are parts, the first part that ends behind it.
    guide: Vec<u16>,
}

/// A place found.
pub(super) struct Found {
    /// From the left, 0 to 1.
    pub u: f32,
    /// Of the angle from above.
    pub cosine: f32,
    pub sine: f32,
    /// Density over solid angle.
    pub pdf: f32,
}

impl Table {
    pub fn new(width: usize, height: usize, texels: &[[f32; 3]]) -> Table {
        let (columns, rows) = size(width, height);
        let cosine = |share: f64| libm::cos(PI * share);
        let mut table = Table {
            columns,
            rows,
            cosines: (0..=rows).map(|row| cosine(row as f64 / rows as f64)).collect(),
            row_shares: Shares::with_capacity(rows),
            cell_shares: Shares::with_capacity(columns * rows),
            total: 0.0,
        };
        let mut lines = Lines { width, height, texels };
        let mut row_masses = Vec::with_capacity(rows);
        for row in 0..rows {
            let mut cells = vec![0.0; columns];
            for (y, from, to) in overlaps(row, rows, height) {
                let angle = cosine(from) - cosine(to);
                lines.add_to(y, angle * TAU, &mut cells);
            }
            row_masses.push(cells.iter().sum());
            table.cell_shares.push(&cells);
        }
        table.total = row_masses.iter().sum();
        table.row_shares.push(&row_masses);
        table
    }

    /// Bytes of the table of a picture of this size.
    pub fn bytes_of(width: usize, height: usize) -> u64 {
        let (columns, rows) = size(width, height);
        (columns * rows * (size_of::<u32>() + size_of::<u16>())) as u64
    }

    pub fn total(&self) -> f64 {
        self.total
    }

    /// A place for two random numbers; `None` if all is dark.
    pub fn sample(&self, [u, v]: [f32; 2]) -> Option<Found> {
        let (row, down) = self.row_shares.pick(0, self.rows, v)?;
        let (column, along) = self.cell_shares.pick(row, self.columns, u)?;
        let [top, bottom] = [self.cosines[row], self.cosines[row + 1]];
        let cosine = top + (bottom - top) * down;
        Some(Found {
            u: ((column as f64 + along) / self.columns as f64) as f32,
            cosine: cosine as f32,
            sine: (1.0 - cosine * cosine).max(0.0).sqrt() as f32,
            pdf: self.cell_pdf(row, column),
        })
    }

    /// Density over solid angle at a place of the picture.
    pub fn pdf(&self, [u, v]: [f32; 2]) -> f32 {
        let cell = |share: f32, count: usize| ((share * count as f32) as usize).min(count - 1);
        self.cell_pdf(cell(v, self.rows), cell(u, self.columns))
    }

    fn cell_pdf(&self, row: usize, column: usize) -> f32 {
        let share = |[begin, end]: [u32; 2]| f64::from(end - begin) / f64::from(ONE);
        let of_row = share(self.row_shares.part(0, self.rows, row));
        let probability = of_row * share(self.cell_shares.part(row, self.columns, column));
        let solid_angle = (self.cosines[row] - self.cosines[row + 1]) * TAU / self.columns as f64;
        (probability / solid_angle) as f32
    }
}

/// Columns and rows of the table of a picture.
fn size(width: usize, height: usize) -> (usize, usize) {
    (width.min(MOST_COLUMNS), height.min(MOST_ROWS))
}

impl Shares {
    fn with_capacity(parts: usize) -> Shares {
        Shares { sums: Vec::with_capacity(parts), guide: Vec::with_capacity(parts) }
    }

    /// Appends a list of parts with these masses.
    fn push(&mut self, masses: &[f64]) {
        let (begin, count) = (self.sums.len(), masses.len());
        let total: f64 = masses.iter().sum();
        let scale = if total > 0.0 { f64::from(ONE) / total } else { 0.0 };
        let mut sum = 0.0;
        self.sums.extend(masses.iter().map(|mass| {
            sum += mass;
            // What rounding leaves of the sum is less than half of a unit.
            (sum * scale).round() as u32
        }));
        let sums = &self.sums[begin..];
        let mut part = 0;
        self.guide.extend((0..count).map(|step| {
            let from = (step as u64 * u64::from(ONE)).div_ceil(count as u64);
            part += sums[part..].iter().take_while(|&&sum| u64::from(sum) <= from).count();
            part as u16
        }));
    }

    /// Where part `i` of a list of `count` begins and ends.
    fn part(&self, list: usize, count: usize, i: usize) -> [u32; 2] {
        let at = list * count + i;
        [if i == 0 { 0 } else { self.sums[at - 1] }, self.sums[at]]
    }

    /// Which part of a list a random number falls on, and where in it, in (0, 1). `None` in a list without mass.
    fn pick(&self, list: usize, count: usize, u: f32) -> Option<(usize, f64)> {
        let target = (u * ONE as f32) as u32;
        let step = (u64::from(target) * count as u64 / u64::from(ONE)) as usize;
        let first = usize::from(self.guide[list * count + step]);
        let sums = &self.sums[list * count..][..count];
        let i = first + sums[first..].iter().position(|&sum| sum > target)?;
        let [begin, end] = self.part(list, count, i);
        Some((i, (f64::from(target - begin) + 0.5) / f64::from(end - begin)))
    }
}

/// The parts out of `parts` that part `i` of `count` overlaps: which, and from where to where, as shares of the whole.
fn overlaps(i: usize, count: usize, parts: usize) -> impl Iterator<Item = (usize, f64, f64)> {
    let (first, end) = (i * parts / count, ((i + 1) * parts).div_ceil(count));
    let share = |i: usize, count: usize| i as f64 / count as f64;
    (first..end).map(move |part| {
        let from = share(i, count).max(share(part, parts));
        let to = share(i + 1, count).min(share(part + 1, parts));
        (part, from, to.max(from))
    })
}

/// The luminance of a picture as interpolation spreads it: the mean over a texel of the bilinear interpolation between
/// centers has an eighth of each neighbor.
struct Lines<'a> {
    width: usize,
    height: usize,
    texels: &'a [[f32; 3]],
}

impl Lines<'_> {
    /// Adds row `y` times `weight` to the cells that it is cut into.
    fn add_to(&mut self, y: usize, weight: f64, cells: &mut [f64]) {
        let rows = [y.saturating_sub(1), y, (y + 1).min(self.height - 1)];
        let line = |y: usize| &self.texels[y * self.width..][..self.width];
        let [above, at, below] = rows.map(line);
        let column = |x: usize| {
            let [above, at, below] = [above, at, below].map(|line| f64::from(luminance(Vec3::from(line[x]))));
            0.125 * (above + below) + 0.75 * at
        };
        let (mut left, mut middle) = (column(self.width - 1), column(0));
        let first = middle;
        for x in 0..self.width {
            let right = if x + 1 < self.width { column(x + 1) } else { first };
            let value = weight * (0.125 * (left + right) + 0.75 * middle);
            for (cell, from, to) in overlaps(x, self.width, cells.len()) {
                cells[cell] += value * (to - from);
            }
            (left, middle) = (middle, right);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_has_even_density() {
        for (width, height) in [(1, 1), (7, 3), (5000, 11), (4, 1500)] {
            let table = Table::new(width, height, &vec![[2.0; 3]; width * height]);
            assert!((table.total() / (8.0 * PI) - 1.0).abs() < 1e-6);
            for place in [[0.0, 0.0], [0.5, 0.5], [0.99, 0.2], [1.0, 1.0]] {
                // The rows at the poles are small, and their shares are rounded.
                let even = table.pdf(place) * (4.0 * PI) as f32;
                assert!((even - 1.0).abs() < 0.03, "{width} x {height}, {place:?}: {even}");
            }
        }
    }

    #[test]
    fn parts_overlap_without_gaps() {
        for (count, parts) in [(1, 1), (3, 7), (7, 3), (2048, 5000), (5, 5)] {
            let all: Vec<_> = (0..count).flat_map(|i| overlaps(i, count, parts)).collect();
            let covered: f64 = all.iter().map(|(_, from, to)| to - from).sum();
            assert!((covered - 1.0).abs() < 1e-9);
            assert!(all.windows(2).all(|pair| (pair[0].2 - pair[1].1).abs() < 1e-12));
        }
    }

    #[test]
    fn every_random_number_finds_what_is_bright() {
        let mut texels = vec![[0.0; 3]; 64 * 32];
        texels[20 * 64 + 9] = [1e6; 3];
        texels[0] = [1e-20; 3];
        let table = Table::new(64, 32, &texels);
        for u in [0.0, 0.3, 1.0f32.next_down()] {
            let found = table.sample([u, u]).unwrap();
            let row = libm::acosf(found.cosine) / std::f32::consts::PI * 32.0;
            // With its neighbors, over which interpolation spreads it.
            assert!((8.0..=11.0).contains(&(found.u * 64.0)) && (18.99..=22.01).contains(&row), "{row}");
            assert!(found.pdf > 0.0);
        }
    }
}
