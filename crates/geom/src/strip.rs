//! The one rule that turns position *i* of a strip into a triangle.
//!
//! A strip of *n* triangles is a list of *n* + 2 vertices and one turn bit a triangle. Triangle *i* is made of
//! vertices *i* + 1 and *i* + 2 of the list and a third, its *pivot*:
//!
//! - without a turn the pivot is vertex *i*: the zig-zag of a plain triangle strip;
//! - with a turn it is the pivot of triangle *i* - 1: a fan around it, which a plain strip can only express by
//!   repeating a vertex (a degenerate "swap" triangle; Lauterbach et al. 2007 pay 15 to 27 % of their slots
//!   for those).
//!
//! So every path through the mesh from neighbor to neighbor is a strip.
//! Winding flips with each zig and stays with each turn; triangle 0 is wound as listed.

/// Triangles tested together: a *window* of a strip holds at most this many over [`WINDOW_VERTICES`] vertices,
/// which fill one SIMD register of eight lanes.
pub const WINDOW_TRIANGLES: usize = 6;

/// Vertices of a full window.
pub const WINDOW_VERTICES: usize = WINDOW_TRIANGLES + 2;

/// A split of a strip in scene units; a pack stores it on the grid of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneSplit {
    /// 0 to 2.
    pub axis: u8,
    /// True where the right part of the strip is the lower one along the axis.
    pub reversed: bool,
    /// Greatest coordinate of the lower part.
    pub lower_max: f32,
    /// Least coordinate of the upper part.
    pub upper_min: f32,
}

/// Windows of a strip of `triangle_count` triangles.
#[inline]
pub fn window_count(triangle_count: usize) -> usize {
    triangle_count.div_ceil(WINDOW_TRIANGLES)
}

/// Where triangle `i` of a strip finds its corners, wound as in the mesh, as positions in the strip's vertices.
///
/// `turns[w]` holds the turn bits of window `w`: bit *k* is triangle `6 w + k`. Bit 0 is always clear, so that
/// a window never reaches back over its first vertex.
///
/// # Panics
/// If `turns` has no entry for the window of triangle `i`.
pub fn strip_triangle(turns: &[u8], i: usize) -> [usize; 3] {
    let (window, k) = (i / WINDOW_TRIANGLES, i % WINDOW_TRIANGLES);
    let base = window * WINDOW_TRIANGLES;
    let pivot = base + ((!turns[window] & up_to(k)) | 1).ilog2() as usize;
    if strip_is_reversed(turns, i) {
        [pivot, base + k + 2, base + k + 1]
    } else {
        [pivot, base + k + 1, base + k + 2]
    }
}

/// Whether triangle `i` of a strip is wound from its pivot to vertex *i* + 2 to vertex *i* + 1.
///
/// # Panics
/// If `turns` has no entry for the window of triangle `i`.
#[inline]
pub fn strip_is_reversed(turns: &[u8], i: usize) -> bool {
    let (window, k) = (i / WINDOW_TRIANGLES, i % WINDOW_TRIANGLES);
    let turned_before: u32 = turns[..window].iter().map(|bits| bits.count_ones()).sum();
    let turned = turned_before + (turns[window] & up_to(k)).count_ones();
    (i as u32 - turned) & 1 == 1
}

/// Bits 0 to `k`.
fn up_to(k: usize) -> u8 {
    (2u8 << k) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zig_zag_alternates_winding() {
        let turns = [0, 0];
        assert_eq!(strip_triangle(&turns, 0), [0, 1, 2]);
        assert_eq!(strip_triangle(&turns, 1), [1, 3, 2]);
        assert_eq!(strip_triangle(&turns, 2), [2, 3, 4]);
        assert_eq!(strip_triangle(&turns, 7), [7, 9, 8]);
    }

    #[test]
    fn turns_fan_around_the_pivot_and_keep_winding() {
        let fan = [0b11110];
        for i in 0..5 {
            assert_eq!(strip_triangle(&fan, i), [0, i + 1, i + 2]);
        }
        // Zig at 1, turn at 2, zig at 3.
        let mixed = [0b00100];
        assert_eq!(strip_triangle(&mixed, 1), [1, 3, 2]);
        assert_eq!(strip_triangle(&mixed, 2), [1, 4, 3]);
        assert_eq!(strip_triangle(&mixed, 3), [3, 4, 5]);
    }

    #[test]
    fn neighbors_share_an_edge_in_opposite_directions() {
        for bits in 0..64u8 {
            let turns = [bits & !1, bits.reverse_bits() >> 2 & !1];
            for i in 0..11 {
                let edges = |t: [usize; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
                let (a, b) = (strip_triangle(&turns, i), strip_triangle(&turns, i + 1));
                let shared = edges(a).iter().filter(|e| edges(b).contains(&[e[1], e[0]])).count();
                assert_eq!(shared, 1, "turns {turns:?}, triangles {i}: {a:?} {b:?}");
            }
        }
    }
}
