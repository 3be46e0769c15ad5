//! Hair and other strands: chains of round cones.
//!
//! A strand is a row of points, each with a radius. Between two points next to each other lies a *segment*: all that is
//! inside of a ball that rolls from one to the other while its radius changes steadily. Segments of a strand that follow
//! each other have a ball in common, so the chain has no gaps.

use crate::Aabb;
use glam::Vec3;

/// Most segments that are stored and tested together: a *window* of a strand.
pub const WINDOW_SEGMENTS: usize = 6;

/// A segment of a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Its points.
    pub ends: [Vec3; 2],
    /// Radii there.
    pub radii: [f32; 2],
}

/// What a ray can hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Corners, counter-clockwise as seen from the front.
    Triangle([Vec3; 3]),
    /// Of a strand.
    Segment(Segment),
}

impl Default for Shape {
    /// A triangle without area.
    fn default() -> Shape {
        Shape::Triangle([Vec3::ZERO; 3])
    }
}

/// Box around a ball, rounded outward.
#[inline]
pub fn ball_bounds(center: Vec3, radius: f32) -> Aabb {
    let min = (center - radius).to_array().map(f32::next_down);
    let max = (center + radius).to_array().map(f32::next_up);
    Aabb { min: Vec3::from_array(min), max: Vec3::from_array(max) }
}

/// A byte for each radius of a scene: steps of equal size between the bits of the least and the greatest one, which
/// makes them steps of about equal ratio. All of a scene have one code, so a point has the same radius wherever it
/// is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RadiusCode {
    /// Bits of the least radius.
    pub base: u32,
    /// log2 of the distance of bits from one code to the next.
    pub shift: u32,
}

impl RadiusCode {
    /// The finest code for radii from `least` to `greatest`, which are finite and greater than zero.
    pub fn covering(least: f32, greatest: f32) -> RadiusCode {
        let (base, end) = (least.to_bits(), greatest.to_bits().max(least.to_bits()));
        let shift = (0..24).find(|&shift| u32::from(u8::MAX) << shift >= end - base).unwrap_or(24);
        RadiusCode { base, shift }
    }

    /// The code of the nearest radius.
    pub fn encode(self, radius: f32) -> u8 {
        let above = radius.to_bits().saturating_sub(self.base);
        let half = if self.shift > 0 { 1 << (self.shift - 1) } else { 0 };
        ((above + half) >> self.shift).min(u32::from(u8::MAX)) as u8
    }

    /// The radius of a code.
    #[inline(always)]
    pub fn decode(self, code: u8) -> f32 {
        f32::from_bits(self.base.wrapping_add(u32::from(code) << (self.shift & 31)))
    }

    /// The radius that stands for this one.
    pub fn rounded(self, radius: f32) -> f32 {
        self.decode(self.encode(radius))
    }

    /// Most by which a radius is off, as a share of it.
    pub fn error(self) -> f64 {
        if self.shift == 0 { 0.0 } else { f64::from(1u32 << (self.shift - 1)) / f64::from(1u32 << 23) }
    }

    /// True where every code stands for a finite radius greater than zero.
    pub fn is_sane(self) -> bool {
        let greatest = u64::from(self.base) + (u64::from(u8::MAX) << self.shift.min(24));
        self.shift <= 24 && self.base > 0 && greatest < u64::from(f32::INFINITY.to_bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn radii_come_back_within_the_error(least in 1e-9f32..1e3, ratio in 1.0f32..60_000.0, at in 0.0f32..1.0) {
            let code = RadiusCode::covering(least, least * ratio);
            prop_assert!(code.is_sane());
            let radius = least * ratio.powf(at);
            let decoded = code.decode(code.encode(radius));
            let off = (f64::from(decoded) - f64::from(radius)).abs() / f64::from(radius);
            prop_assert!(off <= code.error(), "{} for {}: {} above {}", decoded, radius, off, code.error());
            prop_assert!(code.error() <= 1.0 / 16.0);
        }
    }

    #[test]
    fn one_radius_is_exact_and_a_range_is_fine() {
        let code = RadiusCode::covering(0.1, 0.1);
        assert_eq!((code.decode(code.encode(0.1)), code.error()), (0.1, 0.0));
        assert!(RadiusCode::covering(0.01, 0.039).error() < 0.005);
    }

    #[test]
    fn boxes_hold_their_balls() {
        let bounds = ball_bounds(Vec3::ZERO, 0.5).union(ball_bounds(Vec3::X, 0.1));
        assert!(bounds.min.x < -0.5 && bounds.max.x > 1.1 && bounds.max.y > 0.5 && bounds.max.y < 0.500_001);
    }
}
