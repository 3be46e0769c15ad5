//! From linear light to what a screen can show.

use super::{aces, agx};
use glam::Vec3;

/// How values beyond the range of a screen are treated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Cut at 1: for data.
    Clip,
    /// Identity up to 0.8; above, highlights are compressed towards 1 and lose some saturation, keeping their
    /// hue: the shoulder of the Khronos PBR Neutral Tone Mapper (2024) without its toe, which makes up for a
    /// specular reflection that diffuse surfaces do not have.
    #[default]
    Neutral,
    /// AgX with its base look (Sobotka 2022): 16.5 stops, and highlights of any hue end in white.
    Agx,
    /// The look of the Academy Color Encoding System for a screen, as fitted by Stephen Hill: much contrast, bright
    /// colors change their hue.
    Aces,
}

impl ToneCurve {
    /// Linear RGB in 0 to 1.
    pub(crate) fn apply(self, rgb: Vec3) -> Vec3 {
        let compressed = match self {
            ToneCurve::Clip => rgb,
            ToneCurve::Neutral => compress_highlights(rgb),
            ToneCurve::Agx => agx::apply(rgb),
            ToneCurve::Aces => aces::apply(rgb),
        };
        compressed.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// Where the compression of highlights starts.
const SHOULDER: f32 = 0.8;

/// How fast highlights turn white.
const DESATURATION: f32 = 0.15;

fn compress_highlights(rgb: Vec3) -> Vec3 {
    let peak = rgb.max_element();
    if peak < SHOULDER {
        return rgb;
    }
    // A hyperbola that meets the identity with slope 1 and tends to 1.
    let room = 1.0 - SHOULDER;
    let new_peak = 1.0 - room * room / (peak + room - SHOULDER);
    let saturation = 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    Vec3::splat(new_peak).lerp(rgb * (new_peak / peak), saturation)
}

/// The transfer function of sRGB (IEC 61966-2-1) for a value in 0 to 1, rounded to a byte.
pub(crate) fn srgb_byte(linear: f32) -> u8 {
    let encoded =
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::luminance;

    #[test]
    fn shoulder_is_smooth_increasing_and_bounded() {
        let gray = |x: f32| ToneCurve::Neutral.apply(Vec3::splat(x)).x;
        assert_eq!(gray(0.5), 0.5);
        assert!((gray(0.801) - 0.801).abs() < 1e-4);
        let values: Vec<f32> = (0..1000).map(|i| gray(i as f32 * 0.02)).collect();
        assert!(values.is_sorted() && values[999] <= 1.0);
        let hot = ToneCurve::Neutral.apply(Vec3::new(50.0, 5.0, 0.5));
        assert!(hot.x > hot.y && hot.y > hot.z && luminance(hot) > 0.6);
    }

    #[test]
    fn every_curve_is_increasing_and_bounded() {
        for curve in [ToneCurve::Clip, ToneCurve::Neutral, ToneCurve::Agx, ToneCurve::Aces] {
            let values: Vec<f32> =
                (0..400).map(|i| curve.apply(Vec3::splat(1e-4 * 1.05f32.powi(i))).y).collect();
            assert!(values.is_sorted(), "{curve:?}");
            assert!(values[0] < 1e-3 && values[399] > 0.96, "{curve:?}: {} to {}", values[0], values[399]);
            for odd in
                [Vec3::ZERO, Vec3::splat(f32::MAX), Vec3::new(1e9, 0.0, 0.0), Vec3::new(0.0, 0.0, 1e-30)]
            {
                let shown = curve.apply(odd);
                assert!(shown.cmpge(Vec3::ZERO).all() && shown.cmple(Vec3::ONE).all(), "{curve:?} of {odd}");
            }
        }
    }

    #[test]
    fn srgb_has_its_known_values() {
        assert_eq!([0.0, 0.001, 0.214_041, 1.0].map(srgb_byte), [0, 3, 127, 255]);
    }
}
