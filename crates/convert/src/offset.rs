//! The scene offset: what is subtracted from every position, in f64, before it becomes f32.
//!
//! Geographic models lie millions of units from the origin, where an f32 has steps of half a unit. Moved to
//! the origin they keep their detail. Scenes that are not far out against their size are left alone, so that
//! f32 input stays what it was, bit for bit.

use glam::{DAffine3, DVec3};
use raystrips_geom::affine::bounds_of;
use raystrips_geom::grid::floor_log2;
use serde::{Deserialize, Serialize};

/// A scene is moved when its center is farther out than this many times its size: three bits of precision.
const FAR: f64 = 8.0;

/// The box of a scene as it was read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WorldBounds {
    min: [f64; 3],
    max: [f64; 3],
}

impl Default for WorldBounds {
    fn default() -> WorldBounds {
        WorldBounds::EMPTY
    }
}

impl WorldBounds {
    pub const EMPTY: WorldBounds = WorldBounds { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    pub fn grow(&mut self, positions: &[[f64; 3]]) {
        for &position in positions {
            let position = DVec3::from_array(position);
            self.min = DVec3::from_array(self.min).min(position).to_array();
            self.max = DVec3::from_array(self.max).max(position).to_array();
        }
    }

    /// Least and greatest corner.
    pub fn corners(&self) -> [[f64; 3]; 2] {
        [self.min, self.max]
    }

    /// Grows to hold `other`, transformed.
    pub fn grow_around(&mut self, other: &WorldBounds, transformation: &DAffine3) {
        if other.min[0] <= other.max[0] {
            let corners = other.corners().map(DVec3::from_array);
            self.grow(&bounds_of(corners, transformation).map(|corner| corner.to_array()));
        }
    }
}

/// Where a scene is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    /// What to subtract from every position.
    pub offset: [f64; 3],
    /// Longest side of the scene's box.
    pub size: f64,
}

/// The placement of a scene. The offset is on each axis zero, or a multiple of a power of two near the scene's
/// size, so that subtracting it from an f32 is exact more often than not.
pub(crate) fn placement(WorldBounds { min, max }: &WorldBounds) -> Placement {
    let size = (0..3).map(|axis| max[axis] - min[axis]).fold(0.0, f64::max);
    let offset = [0, 1, 2].map(|axis| {
        let center = (min[axis] + max[axis]) / 2.0;
        if size > 0.0 && center.abs() > FAR * size {
            let step = 2f64.powi(floor_log2(size) + 1);
            (center / step).round() * step
        } else {
            0.0
        }
    });
    Placement { offset, size }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offset_of(positions: &[[f64; 3]]) -> [f64; 3] {
        let mut bounds = WorldBounds::EMPTY;
        bounds.grow(positions);
        placement(&bounds).offset
    }

    #[test]
    fn only_far_scenes_move() {
        assert_eq!(offset_of(&[[-1.0, 0.0, 3.0], [2.0, 1.0, 4.0]]), [0.0; 3]);
        let [x, y, z] = offset_of(&[[5e6, 4e5, 0.0], [5e6 + 100.0, 4e5 + 90.0, 20.0]]);
        assert!((x - 5e6).abs() <= 128.0 && (y - 4e5).abs() <= 128.0 && z == 0.0, "{x} {y} {z}");
        assert_eq!(x % 128.0, 0.0);
        assert_eq!(offset_of(&[[7.0; 3]]), [0.0; 3]);
    }
}
