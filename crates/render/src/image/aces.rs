//! A fit of the transforms of the Academy Color Encoding System for an sRGB screen (RRT and ODT), by Stephen Hill: in
//! `BakingLab/ACES.hlsl` of M. Pettineo and D. Neubelt, "Baking Lab" (2016).

use glam::{Mat3, Vec3};

/// sRGB to XYZ, the white of D65 to that of D60, to AP1, and less saturated as by the reference rendering transform.
const INPUT: Mat3 = Mat3::from_cols(
    Vec3::new(0.59719, 0.07600, 0.02840),
    Vec3::new(0.35458, 0.90834, 0.13383),
    Vec3::new(0.04823, 0.01566, 0.83777),
);

/// More saturated as by the output transform, to XYZ, the white of D60 to that of D65, to sRGB.
const OUTPUT: Mat3 = Mat3::from_cols(
    Vec3::new(1.60475, -0.10208, -0.00327),
    Vec3::new(-0.53108, 1.10813, -0.07276),
    Vec3::new(-0.07367, -0.00605, 1.07602),
);

/// Beyond this the curve has reached its end, and squares are still finite.
const BRIGHTEST: f32 = 1e9;

/// Linear RGB for a screen.
pub(super) fn apply(rgb: Vec3) -> Vec3 {
    let v = INPUT * rgb.min(Vec3::splat(BRIGHTEST));
    let a = v * (v + 0.024_578_6) - 0.000_090_537;
    let b = v * (0.983_729 * v + 0.432_951) + 0.238_081;
    OUTPUT * (a / b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gray_stays_gray() {
        for (light, shown) in [(0.18, 0.1056), (1.0, 0.6191), (1e6, 1.0165)] {
            let rgb = apply(Vec3::splat(light));
            assert!((rgb - shown).abs().max_element() < 2e-3, "{rgb}");
        }
    }
}
