//! How much a smooth boundary reflects.

use glam::Vec3;

/// Reflectance of the boundary to a medium with `eta` times the index of refraction, for light that is not polarized and
/// comes at an angle of this cosine (Fresnel). 1 where all is reflected.
pub(super) fn dielectric(cosine: f32, eta: f32) -> f32 {
    let Some(transmitted) = transmitted_cosine(cosine, eta) else { return 1.0 };
    let parallel = (eta * cosine - transmitted) / (eta * cosine + transmitted);
    let perpendicular = (cosine - eta * transmitted) / (cosine + eta * transmitted);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// The cosine behind the boundary (Snell); `None` where all is reflected.
pub(super) fn transmitted_cosine(cosine: f32, eta: f32) -> Option<f32> {
    let squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    (squared > 0.0).then(|| squared.sqrt())
}

/// Reflectance of what reflects `normal` straight back (Schlick 1994).
pub(super) fn schlick(cosine: f32, normal: Vec3) -> Vec3 {
    let x = (1.0 - cosine).clamp(0.0, 1.0);
    let x2 = x * x;
    normal + (1.0 - normal) * (x2 * x2 * x)
}

/// A reflectance that is `normal` straight back, of a boundary for which it should be `colored` there and still all at
/// grazing angles.
pub(super) fn colored(reflectance: f32, normal: f32, colored: Vec3) -> Vec3 {
    reflectance + (colored - normal) * ((1.0 - reflectance) / (1.0 - normal).max(1e-6))
}

/// Reflectance of a sheet that reflects `r` at each of its two sides, with all that goes to and fro between them.
pub(super) fn sheet(r: Vec3) -> Vec3 {
    2.0 * r / (1.0 + r)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boundaries_reflect_what_they_should() {
        let normal = |eta: f32| ((eta - 1.0) / (eta + 1.0)) * ((eta - 1.0) / (eta + 1.0));
        for eta in [1.5, 1.0 / 1.5, 2.4] {
            assert!((dielectric(1.0, eta) - normal(eta)).abs() < 1e-6);
        }
        assert!(dielectric(1e-4, 1.5) > 0.99);
        // At Brewster's angle only one polarization is reflected.
        let tangent = 1.5f32;
        let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
        let half = (1.0 - tangent * tangent) / (1.0 + tangent * tangent);
        assert!((dielectric(cosine, 1.5) - 0.5 * half * half).abs() < 1e-6);
        // From the inside beyond the critical angle, and the same boundary from both sides.
        assert_eq!(dielectric(0.7, 1.0 / 1.5), 1.0);
        let inside = transmitted_cosine(0.6, 1.5).unwrap();
        assert!((dielectric(0.6, 1.5) - dielectric(inside, 1.0 / 1.5)).abs() < 1e-6);
        assert!(dielectric(0.3, 1.0) < 1e-9);
    }

    #[test]
    fn all_is_white_at_grazing_angles() {
        let gold = Vec3::new(1.0, 0.7, 0.3);
        assert_eq!((schlick(1.0, gold), schlick(0.0, gold)), (gold, Vec3::ONE));
    }
}
