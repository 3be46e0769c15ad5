//! AgX (Troy Sobotka, <https://github.com/sobotka/AgX>, 2022): logarithms of channels that are mixed somewhat, through a
//! sigmoid. Bright colors so lose saturation as film does, without changes of hue where a channel ends.
//!
//! The curve is the sigmoid of Sobotka's generator itself, not the polynomial of B. Wrensch, "Minimal AgX Implementation"
//! (2023), which is fitted to it; the mixing and its undoing are as there.

use glam::{Mat3, Vec3};

/// Mixes channels.
const INSET: Mat3 = Mat3::from_cols(
    Vec3::new(0.842_479_06, 0.042_328_242, 0.042_375_655),
    Vec3::new(0.078_433_6, 0.878_468_64, 0.078_433_6),
    Vec3::new(0.079_223_745, 0.079_166_13, 0.879_143),
);

/// The inverse.
const OUTSET: Mat3 = Mat3::from_cols(
    Vec3::new(1.196_879, -0.052_896_85, -0.052_971_635),
    Vec3::new(-0.098_020_88, 1.151_903_1, -0.098_043_45),
    Vec3::new(-0.099_029_74, -0.098_961_18, 1.151_073_7),
);

/// Middle gray, and the stops below and above it that are shown.
const GRAY: f32 = 0.18;
const STOPS: [f32; 2] = [10.0, 6.5];

/// Steepness in the middle.
const SLOPE: f32 = 2.0;
/// How sudden the curve bends, below middle gray and above.
const BENDS: [f32; 2] = [3.0, 3.25];
/// What middle gray becomes, encoded for a screen.
const MIDDLE: f32 = 0.5;
/// The encoding that the curve ends in.
const SCREEN_GAMMA: f32 = 2.2;

/// Linear RGB for a screen.
pub(super) fn apply(rgb: Vec3) -> Vec3 {
    let stops = (INSET * (rgb / GRAY)).to_array().map(|c| libm::log2f(c.max(f32::MIN_POSITIVE)));
    let encoded = OUTSET * Vec3::from(stops.map(sigmoid));
    encoded.clamp(Vec3::ZERO, Vec3::ONE).to_array().map(|c| libm::powf(c, SCREEN_GAMMA)).into()
}

/// What so many stops above middle gray become: a line through the middle that bends to end at 0 and 1.
fn sigmoid(stops: f32) -> f32 {
    let side = usize::from(stops > 0.0);
    let (end, bend) = (STOPS[side], BENDS[side]);
    let room = if side == 0 { MIDDLE } else { 1.0 - MIDDLE };
    // The line at the end, over what it has to be bent to.
    let line_at = |stops: f32| SLOPE * stops / (STOPS[0] + STOPS[1]);
    let excess = libm::powf(line_at(end) / room, bend) - 1.0;
    let share = stops.abs().min(end) / end;
    let height = line_at(share * end) / libm::powf(1.0 + excess * libm::powf(share, bend), 1.0 / bend);
    if side == 0 { MIDDLE - height } else { MIDDLE + height }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The polynomial that others use instead.
    fn wrensch(stops: f32) -> f32 {
        let x = ((stops + STOPS[0]) / (STOPS[0] + STOPS[1])).clamp(0.0, 1.0);
        [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.002_32].into_iter().fold(0.0, |sum, c| sum * x + c)
    }

    #[test]
    fn curve_has_its_known_points() {
        assert_eq!([-12.0, -10.0, 0.0, 6.5, 9.0].map(sigmoid), [0.0, 0.0, 0.5, 1.0, 1.0]);
        for i in -100..=65 {
            let stops = 0.1 * i as f32;
            assert!(
                (sigmoid(stops) - wrensch(stops)).abs() < 6e-3,
                "{stops}: {} {}",
                sigmoid(stops),
                wrensch(stops)
            );
        }
    }

    #[test]
    fn gray_stays_gray_and_red_turns_white() {
        let gray = apply(Vec3::splat(GRAY));
        assert!((gray - libm::powf(0.5, 2.2)).abs().max_element() < 1e-4, "{gray}");
        assert!((INSET * OUTSET).abs_diff_eq(Mat3::IDENTITY, 1e-5));
        let [dim, bright] = [1.0, 1e3].map(|light| apply(Vec3::new(light, 0.02 * light, 0.02 * light)));
        assert!(dim.y / dim.x < 0.4 && bright.y / bright.x > 0.8, "{dim} {bright}");
    }
}
