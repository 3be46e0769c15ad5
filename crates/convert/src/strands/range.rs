//! The radii of a scene.

use raystrips_geom::RadiusCode;
use serde::{Deserialize, Serialize};

/// Radii are told apart down to this part of the greatest.
const LEAST_PART: f32 = 1.0 / 65536.0;
/// Where strands end in a point, the radius there is this part of the least one elsewhere.
const TIP_PART: f32 = 1.0 / 8.0;

/// Least and greatest radius of all strands, and whether some have none at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RadiusRange {
    least: f32,
    greatest: f32,
    has_zero: bool,
}

impl RadiusRange {
    pub const EMPTY: RadiusRange = RadiusRange { least: f32::INFINITY, greatest: 0.0, has_zero: false };

    pub fn grow(&mut self, radii: &[f32]) {
        for &radius in radii {
            if radius >= f32::MIN_POSITIVE {
                self.least = self.least.min(radius);
                self.greatest = self.greatest.max(radius);
            } else {
                self.has_zero = true;
            }
        }
    }

    /// The same with all radii times `factor`.
    pub fn scaled(&self, factor: f32) -> RadiusRange {
        RadiusRange { least: self.least * factor, greatest: self.greatest * factor, ..*self }
    }

    /// How these radii are stored, nothing below being told apart from the least.
    pub fn code(&self) -> RadiusCode {
        if self.greatest == 0.0 {
            // There are strands, but they are thinner than numbers are small.
            return RadiusCode::covering(f32::MIN_POSITIVE, f32::MIN_POSITIVE);
        }
        let least = if self.has_zero { self.least * TIP_PART } else { self.least };
        let least = least.max(self.greatest * LEAST_PART).max(f32::MIN_POSITIVE);
        RadiusCode::covering(least, self.greatest)
    }
}
