//! How a triangle is split whose sides have given numbers of segments.
//!
//! Inside is a regular grid of smaller triangles, and between it and each side a strip that joins unlike numbers of
//! segments, as tessellators of graphics hardware have it.

use crate::scene::random::unit_of;

/// Segments of the edge of that number whose length is `wanted` segments. Rounded up or down at random, with the
/// fraction as the probability: so counts grow steadily with finer edges even where all lengths are the same.
pub fn segments(wanted: f64, number: usize) -> u32 {
    ((wanted + unit_of(&[number as u64])) as u32).max(1)
}

/// Segments of the sides, and of the sides of the grid inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    sides: [u32; 3],
    /// `None` if the triangle stays whole.
    inner: Option<u32>,
}

impl Split {
    /// For sides of so many segments.
    pub fn new(sides: [u32; 3]) -> Split {
        let [a, b, c] = sides;
        let mean = (a + b + c + 1) / 3;
        Split { sides, inner: (sides != [1; 3]).then(|| mean.saturating_sub(3)) }
    }

    /// Triangles that it will be.
    pub fn triangles(&self) -> u64 {
        let Some(inner) = self.inner.map(u64::from) else { return 1 };
        inner * inner + 3 * inner + self.sides.iter().map(|&side| u64::from(side)).sum::<u64>()
    }

    /// Weights of the corners for each point of the grid, row by row from the first side.
    pub fn inner_weights(&self) -> impl Iterator<Item = [f64; 3]> {
        let rows = self.inner.map_or(0, |inner| inner + 1);
        (0..rows).flat_map(move |row| {
            (0..rows - row).map(move |column| {
                let weights = [rows - row - column, column + 1, row + 1].map(f64::from);
                weights.map(|weight| weight / f64::from(rows + 2))
            })
        })
    }

    /// Adds the triangles. `outline` has the vertices along each side with both ends; those of the grid are numbered
    /// from `first`.
    pub fn triangulate(&self, outline: &[Vec<u32>; 3], first: u32, out: &mut Vec<[u32; 3]>) {
        let Some(inner) = self.inner else {
            out.push([0, 1, 2].map(|side| outline[side][0]));
            return;
        };
        let point =
            |row: u32, column: u32| first + row * (inner + 1) - row * row.saturating_sub(1) / 2 + column;
        join(&outline[0], inner, |i| point(0, i), out);
        for row in 0..inner {
            for column in 0..inner - row {
                let [a, b, c] = [point(row, column), point(row, column + 1), point(row + 1, column)];
                out.push([a, b, c]);
                if column + 1 < inner - row {
                    out.push([b, point(row + 1, column + 1), c]);
                }
            }
        }
        join(&outline[1], inner, |i| point(i, inner - i), out);
        join(&outline[2], inner, |i| point(inner - i, 0), out);
    }
}

/// The strip between a side and the grid: always the step whose middle comes first.
fn join(side: &[u32], inner: u32, point: impl Fn(u32) -> u32, out: &mut Vec<[u32; 3]>) {
    let outer = side.len() as u32 - 1;
    let (mut i, mut j) = (0, 0);
    while i < outer || j < inner {
        // The grid begins 1.5 segments after the side and ends as much before.
        let outer_first = (2 * i + 1) * (inner + 3) <= (2 * j + 4) * outer;
        if j == inner || i < outer && outer_first {
            out.push([side[i as usize], side[i as usize + 1], point(j)]);
            i += 1;
        } else {
            out.push([side[i as usize], point(j + 1), point(j)]);
            j += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// The three sides are used once, all other edges once in each direction.
    #[test]
    fn all_of_the_triangle_is_covered_once() {
        for sides in (0..7 * 7 * 7).map(|i| [1 + i % 7, 1 + i / 7 % 7, 1 + i / 49]).chain([[40, 1, 33]]) {
            let split = Split::new(sides);
            let [a, b, c] = sides;
            let ends = [0, a, a + b, a + b + c];
            let outline =
                [0, 1, 2].map(|s| (ends[s]..=ends[s + 1]).map(|v| v % (a + b + c)).collect::<Vec<u32>>());
            let mut triangles = Vec::new();
            split.triangulate(&outline, a + b + c, &mut triangles);
            assert_eq!(triangles.len() as u64, split.triangles());
            let mut uses: HashMap<[u32; 2], i32> = HashMap::new();
            for &[a, b, c] in &triangles {
                for edge in [[a, b], [b, c], [c, a]] {
                    assert!(uses.insert(edge, 1).is_none(), "{sides:?}");
                }
            }
            let open = uses.keys().filter(|[a, b]| !uses.contains_key(&[*b, *a])).count() as u32;
            assert_eq!(open, a + b + c, "{sides:?}");
            let points = triangles.iter().flatten().max().unwrap() + 1;
            assert_eq!(points, a + b + c + split.inner_weights().count() as u32);
        }
    }

    #[test]
    fn weights_are_shares() {
        for [a, b, c] in Split::new([9, 8, 7]).inner_weights() {
            assert!(a > 0.0 && b > 0.0 && c > 0.0 && (a + b + c - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn segments_grow_steadily() {
        let mean = |wanted: f64| (0..10_000).map(|i| f64::from(segments(wanted, i))).sum::<f64>() / 1e4;
        assert!((mean(3.25) - 3.25).abs() < 0.02);
        assert_eq!(mean(0.0), 1.0);
    }
}
