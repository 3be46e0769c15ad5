//! Quantization grids: planes a power of two apart, `origin + q * 2^exp`.
//!
//! Child boxes are bytes on the grid of the node that holds them, rounded outward, so that they cost a quarter of
//! floats and never lose a hit. [`NodeGrid`] has its origin in scene units. In a page, where nodes are many, that
//! origin is itself a plane of the [`PageGrid`], so that a node fits a cache line ([`Subgrid`]).

use crate::Aabb;
use glam::Vec3;

/// The grid of one node. Its planes are computed by [`NodeGrid::plane`] alone, so that the writer, which rounds
/// outward against the very same floats, and the tracer agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeGrid {
    /// Plane 0 of each axis.
    pub origin: Vec3,
    /// log2 of the spacing of each axis.
    pub exponent: [i8; 3],
}

/// Least exponent of a spacing: 2^-126 is the least normal f32.
const LEAST_EXPONENT: i32 = -126;

impl NodeGrid {
    /// The finest grid that covers `bounds`.
    ///
    /// # Panics
    /// If `bounds` is empty or not finite.
    pub fn covering(bounds: &Aabb) -> NodeGrid {
        assert!(!bounds.is_empty() && bounds.min.is_finite() && bounds.max.is_finite(), "{bounds:?}");
        let mut grid = NodeGrid { origin: bounds.min, exponent: [0; 3] };
        for axis in 0..3 {
            let extent = f64::from(bounds.max[axis]) - f64::from(bounds.min[axis]);
            let mut exponent = floor_log2(extent / 255.0).max(LEAST_EXPONENT);
            loop {
                grid.exponent[axis] = exponent as i8;
                if grid.plane(axis, 255) >= bounds.max[axis] {
                    break;
                }
                exponent += 1;
            }
        }
        grid
    }

    /// Distance between planes of each axis.
    pub fn spacing(&self) -> Vec3 {
        Vec3::from_array(self.exponent.map(power_of_two))
    }

    /// Position of plane `q`.
    pub fn plane(&self, axis: usize, q: u8) -> f32 {
        self.origin[axis] + f32::from(q) * power_of_two(self.exponent[axis])
    }

    /// The last plane at or below `x`, which must not lie below the grid.
    pub fn round_down(&self, axis: usize, x: f32) -> u8 {
        let guess = ((x - self.origin[axis]) / power_of_two(self.exponent[axis])).floor().clamp(0.0, 255.0);
        let mut q = guess as u8;
        while q > 0 && self.plane(axis, q) > x {
            q -= 1;
        }
        while q < 255 && self.plane(axis, q + 1) <= x {
            q += 1;
        }
        q
    }

    /// The first plane at or above `x`, which must not lie above the grid.
    pub fn round_up(&self, axis: usize, x: f32) -> u8 {
        let guess = ((x - self.origin[axis]) / power_of_two(self.exponent[axis])).ceil().clamp(0.0, 255.0);
        let mut q = guess as u8;
        while q < 255 && self.plane(axis, q) < x {
            q += 1;
        }
        while q > 0 && self.plane(axis, q - 1) >= x {
            q -= 1;
        }
        q
    }
}

/// The grid of a page: 65,536 planes an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PageGrid {
    /// Plane 0 of each axis.
    pub origin: Vec3,
    /// log2 of the spacing of each axis.
    pub exponent: [i8; 3],
}

impl PageGrid {
    /// The finest grid that covers `bounds` also with every fourth plane, on which strips are split.
    ///
    /// # Panics
    /// If `bounds` is empty or not finite.
    pub fn covering(bounds: &Aabb) -> PageGrid {
        assert!(!bounds.is_empty() && bounds.min.is_finite() && bounds.max.is_finite(), "{bounds:?}");
        let exponent = [0, 1, 2].map(|axis| {
            let extent = f64::from(bounds.max[axis]) - f64::from(bounds.min[axis]);
            covering_exponent(extent, f64::from(u16::MAX - 3))
        });
        PageGrid { origin: bounds.min, exponent }
    }

    /// The finest grid that covers `bounds` and has zero in its middle: [`PageGrid::around_zero`].
    pub fn covering_around_zero(bounds: &Aabb) -> PageGrid {
        let greatest = bounds.max.max(-bounds.min).max(Vec3::ZERO);
        PageGrid::around_zero(PageGrid::covering(&Aabb { min: -greatest, max: greatest }).exponent)
    }

    /// The grid whose plane 32768 is at zero on each axis.
    pub fn around_zero(exponent: [i8; 3]) -> PageGrid {
        PageGrid { origin: Vec3::from_array(exponent.map(|e| -32768.0 * power_of_two(e))), exponent }
    }

    /// Position of plane `q`, exact unless 53 bits cannot hold it.
    pub fn plane(&self, axis: usize, q: u16) -> f64 {
        f64::from(self.origin[axis]) + f64::from(q) * f64::from(power_of_two(self.exponent[axis]))
    }

    /// The last plane at or below `x`, which must not lie below the grid.
    pub fn round_down(&self, axis: usize, x: f32) -> u16 {
        self.steps(axis, x).floor() as u16
    }

    /// The first plane at or above `x`, which must not lie above the grid.
    pub fn round_up(&self, axis: usize, x: f32) -> u16 {
        self.steps(axis, x).ceil() as u16
    }

    fn steps(&self, axis: usize, x: f32) -> f64 {
        (f64::from(x) - f64::from(self.origin[axis])) / f64::from(power_of_two(self.exponent[axis]))
    }
}

/// The grid of a node in a page: 256 planes an axis from a plane of the page's grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subgrid {
    /// The page's.
    pub page: PageGrid,
    /// Which plane of the page's grid is plane 0 of each axis.
    pub origin: [u16; 3],
    /// log2 of the spacing of each axis.
    pub exponent: [i8; 3],
}

impl Subgrid {
    /// The finest grid that covers `bounds`, which must lie within that of the page.
    pub fn covering(page: PageGrid, bounds: &Aabb) -> Subgrid {
        let origin = [0, 1, 2].map(|axis| page.round_down(axis, bounds.min[axis]));
        let exponent = [0, 1, 2].map(|axis| {
            covering_exponent(f64::from(bounds.max[axis]) - page.plane(axis, origin[axis]), 255.0)
        });
        Subgrid { page, origin, exponent }
    }

    /// Position of plane `q`, exact unless 53 bits cannot hold it.
    pub fn plane(&self, axis: usize, q: u8) -> f64 {
        self.page.plane(axis, self.origin[axis]) + f64::from(q) * f64::from(power_of_two(self.exponent[axis]))
    }

    /// The last plane at or below `x`, which must not lie below the grid.
    pub fn round_down(&self, axis: usize, x: f32) -> u8 {
        self.steps(axis, x).floor() as u8
    }

    /// The first plane at or above `x`, which must not lie above the grid.
    pub fn round_up(&self, axis: usize, x: f32) -> u8 {
        self.steps(axis, x).ceil() as u8
    }

    fn steps(&self, axis: usize, x: f32) -> f64 {
        let from = self.page.plane(axis, self.origin[axis]);
        (f64::from(x) - from) / f64::from(power_of_two(self.exponent[axis]))
    }
}

/// The least exponent with which `steps` steps cover `extent`.
fn covering_exponent(extent: f64, steps: f64) -> i8 {
    let least = floor_log2(extent / steps).max(LEAST_EXPONENT) as i8;
    if f64::from(power_of_two(least)) * steps >= extent { least } else { least + 1 }
}

/// The greatest integer *n* with 2^*n* <= `x`, from the bits of `x`: the logarithms of some systems are off by one
/// unit in the last place, which here would be another grid. Very small for what is not a normal positive number.
pub fn floor_log2(x: f64) -> i32 {
    (x.to_bits() >> 52) as i32 - 1023
}

/// 2^`exponent`, which must be at least -126: the least for a normal f32.
#[inline]
pub fn power_of_two(exponent: i8) -> f32 {
    f32::from_bits(((i32::from(exponent) + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn planes_enclose(a in prop::array::uniform3(-1e6f32..1e6), e in prop::array::uniform3(0f32..1e4), s in prop::array::uniform3(0f32..=1.0)) {
            let min = Vec3::from_array(a);
            let bounds = Aabb { min, max: min + Vec3::from_array(e) };
            let grid = NodeGrid::covering(&bounds);
            for axis in 0..3 {
                let x = (bounds.min[axis] + s[axis] * e[axis]).min(bounds.max[axis]);
                let (lo, hi) = (grid.round_down(axis, x), grid.round_up(axis, x));
                prop_assert!(grid.plane(axis, lo) <= x && x <= grid.plane(axis, hi));
                prop_assert!(hi <= lo.saturating_add(1));
            }
        }
    }

    proptest! {
        #[test]
        fn planes_of_a_page_enclose(
            a in prop::array::uniform3(-1e6f32..1e6), e in prop::array::uniform3(0f32..1e4),
            s in prop::array::uniform3(0f32..=1.0), share in 0f32..1.0,
        ) {
            let min = Vec3::from_array(a);
            let bounds = Aabb { min, max: min + Vec3::from_array(e) };
            let page = PageGrid::covering(&bounds);
            let x = (min + Vec3::from_array(e) * Vec3::from_array(s)).min(bounds.max);
            let part = Aabb { min: x, max: (x + Vec3::from_array(e) * share).min(bounds.max) };
            let node = Subgrid::covering(page, &part);
            for axis in 0..3 {
                let (lo, hi) = (node.round_down(axis, part.min[axis]), node.round_up(axis, part.max[axis]));
                prop_assert!(node.plane(axis, lo) <= f64::from(part.min[axis]));
                prop_assert!(node.plane(axis, hi) >= f64::from(part.max[axis]));
                let q = page.round_up(axis, part.max[axis]);
                prop_assert!(page.plane(axis, q) >= f64::from(part.max[axis]));
            }
        }
    }

    #[test]
    fn logarithms_are_exact() {
        for (x, n) in [(1.0, 0), (1.9999999, 0), (2.0, 1), (0.75, -1), (8.0, 3), (1e18, 59)] {
            assert_eq!(floor_log2(x), n);
        }
        assert!(floor_log2(0.0) < LEAST_EXPONENT);
    }

    #[test]
    fn flat_and_tiny_boxes_have_a_grid() {
        for extent in [0.0, f32::MIN_POSITIVE, 1e-30, 1e30] {
            let bounds =
                Aabb { min: Vec3::splat(-1.0), max: Vec3::splat(-1.0) + Vec3::new(extent, 0.0, 1.0) };
            let grid = NodeGrid::covering(&bounds);
            for axis in 0..3 {
                assert!(grid.plane(axis, 255) >= bounds.max[axis]);
            }
        }
    }
}
