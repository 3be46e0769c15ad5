//! From positions of the input to those of the pack: moved by the scene offset, in f64, then rounded to f32 or to one
//! grid for the whole scene.
//!
//! The steps of that grid are a power of two, so that what is on it is exact in f32 and needs few bits in the pack's
//! lossless code. Equal positions stay equal: closed meshes stay closed.

use crate::offset::Placement;
use glam::{DVec3, Vec3};
use raystrips_geom::RadiusCode;
use raystrips_geom::grid::floor_log2;
use serde::{Deserialize, Serialize};

/// How positions are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Positions {
    /// As the f32 that were given, or the nearest ones.
    #[default]
    Exact,
    /// On a grid of at most two to the power of `bits` steps along the longest side of the scene.
    Grid {
        /// 4 to 23.
        bits: u8,
    },
}

/// Brings positions to the pack.
pub(crate) struct ToPack {
    /// How radii of strands are stored.
    pub radii: RadiusCode,
    offset: DVec3,
    step: Option<f64>,
}

impl ToPack {
    pub fn new(placement: &Placement, positions: Positions, radii: RadiusCode) -> ToPack {
        let step = match positions {
            Positions::Grid { bits } if placement.size > 0.0 => {
                let exponent = floor_log2(placement.size / f64::from(1u32 << bits)) + 1;
                Some(2f64.powi(exponent))
            }
            _ => None,
        };
        ToPack { radii, offset: DVec3::from_array(placement.offset), step }
    }

    /// For positions that are those of the pack already.
    pub fn identity(radii: RadiusCode) -> ToPack {
        ToPack { radii, offset: DVec3::ZERO, step: None }
    }

    /// Position in the pack. Negative zero becomes zero: they are the same place.
    #[inline]
    pub fn place(&self, position: [f64; 3]) -> Vec3 {
        let exact = self.moved(position);
        let snapped = self.step.map_or(exact, |step| (exact / step).round() * step);
        snapped.as_vec3() + Vec3::ZERO
    }

    /// Most by which a coordinate of `placed`, the place of `position`, is off.
    pub fn error(&self, position: [f64; 3], placed: Vec3) -> f64 {
        (placed.as_dvec3() - self.moved(position)).abs().max_element()
    }

    fn moved(&self, position: [f64; 3]) -> DVec3 {
        DVec3::from_array(position) - self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_offset_keeps_detail() {
        let placement = Placement { offset: [5_000_064.0, 0.0, 0.0], size: 128.0 };
        let exact = ToPack::new(&placement, Positions::Exact, RadiusCode::default());
        let position = [5_000_000.125, 1.0, 0.0];
        assert_eq!(exact.place(position), Vec3::new(-63.875, 1.0, 0.0));
        assert_eq!(exact.error(position, exact.place(position)), 0.0);
    }

    #[test]
    fn a_grid_has_its_bits_and_says_its_error() {
        let placement = Placement { offset: [0.0; 3], size: 10.0 };
        let grid = ToPack::new(&placement, Positions::Grid { bits: 16 }, RadiusCode::default());
        let step = 2f64.powi(-12);
        let mut greatest = 0.0f64;
        for i in 0..1000 {
            let x = f64::from(i) * 0.01;
            let placed = grid.place([x, 0.0, -x]);
            assert_eq!((f64::from(placed.x) / step).fract(), 0.0);
            greatest = greatest.max(grid.error([x, 0.0, -x], placed));
            assert!((f64::from(placed.x) - x).abs() <= greatest && greatest <= step / 2.0);
        }
        assert!(10.0 / step < 65536.0 && greatest > 0.0);
    }
}
