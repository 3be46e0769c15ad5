//! Brings triangles that are near in space near in the file: along the curve of Morton (1966).

use glam::DVec3;

/// Cells of the curve along each axis.
const CELLS: f64 = 1024.0;

/// Sorts triangles by the places of their middles.
pub fn sort(positions: &[DVec3], triangles: &mut [[u32; 3]]) {
    let middle = |t: &[u32; 3]| t.map(|v| positions[v as usize]).into_iter().sum::<DVec3>() / 3.0;
    let bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [low, high] = triangles.iter().map(middle).fold(bounds, |[low, high], p| [low.min(p), high.max(p)]);
    let scale = CELLS / (high - low).max_element().max(f64::MIN_POSITIVE);
    // The sort is stable: triangles of the same cell stay in their order.
    triangles.sort_by_cached_key(|t| code(((middle(t) - low) * scale).to_array()));
}

/// The bits of three coordinates, one of each in turn.
fn code(place: [f64; 3]) -> u32 {
    let spread = |x: f64| {
        let cell = x.clamp(0.0, CELLS - 1.0) as u32;
        (0..10).fold(0, |code, bit| code | (cell >> bit & 1) << (3 * bit))
    };
    let [x, y, z] = place.map(spread);
    x | y << 1 | z << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_take_turns() {
        assert_eq!(code([1.0, 0.0, 0.0]), 1);
        assert_eq!(code([3.0, 1.0, 2.0]), 0b101_011);
        assert_eq!(code([1e9; 3]), (1 << 30) - 1);
    }
}
