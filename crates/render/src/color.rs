//! Linear RGB with the primaries of sRGB, as `Vec3`.

use glam::Vec3;

/// Relative luminance (ITU-R BT.709).
pub(crate) fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
