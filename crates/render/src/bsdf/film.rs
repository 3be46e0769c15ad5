//! A thin film on a boundary: light that it reflects at its two sides interferes (Belcour and Barla 2017, "A practical extension
//! to microfacet theory for the modeling of varying iridescence"), as KHR_materials_iridescence has it. In contrast to it the upper
//! side reflects by Fresnel's equations: by Schlick's a film that is next to nothing would be bright at grazing angles.

use super::fresnel::{dielectric, schlick, transmitted_cosine};
use glam::{Mat3, Vec3};
use std::f32::consts::PI;

/// What a film does to the reflectance of a boundary.
#[derive(Clone, Copy, Debug)]
pub(super) struct Film {
    /// How much of it there is.
    strength: f32,
    /// Index of refraction.
    ior: f32,
    /// In nanometers.
    thickness: f32,
}

impl Film {
    pub fn new(strength: f32, ior: f32, thickness: f32) -> Film {
        // A film that is thinner than what it can be made of goes over into none.
        let x = (thickness / 0.03).clamp(0.0, 1.0);
        Film { strength, ior: 1.0 + (ior - 1.0) * (x * x * (3.0 - 2.0 * x)), thickness }
    }

    /// Reflectance at an angle of this cosine of what without the film reflects `plain`, and `normal` straight back.
    pub fn over(&self, plain: Vec3, cosine: f32, normal: Vec3) -> Vec3 {
        plain.lerp(self.reflectance(cosine, normal), self.strength)
    }

    /// What reflects straight back so much that by Schlick's reflection it is nowhere darker than with the film.
    pub fn bound(&self, normal: Vec3) -> Vec3 {
        const STEPS: u32 = 8;
        (1..=STEPS).fold(normal, |most, i| {
            let cosine = i as f32 / STEPS as f32;
            let grazing = schlick(cosine, Vec3::ZERO);
            let needed = (self.over(schlick(cosine, normal), cosine, normal) - grazing) / (1.0 - grazing);
            most.max(needed.clamp(Vec3::ZERO, Vec3::ONE))
        })
    }

    /// Reflectance of the film and what is below it, which without would reflect `normal` straight back.
    fn reflectance(&self, cosine: f32, normal: Vec3) -> Vec3 {
        let Some(inside) = transmitted_cosine(cosine, self.ior) else { return Vec3::ONE };
        let square = |x: f32| x * x;
        let upper = dielectric(cosine, self.ior);
        // The index below is that with which it would reflect so much beside air.
        let root = normal.clamp(Vec3::ZERO, Vec3::splat(0.9999)).map(f32::sqrt);
        let below = (1.0 + root) / (1.0 - root);
        let lower = schlick(inside, below.map(|below| square((below - self.ior) / (below + self.ior))));
        // Waves turn around where they are reflected by what is denser. With that, orders of interference have the sign of
        // `order` where only one of the sides turns them, and the other where both do.
        let turn = below.map(|below| if below < self.ior { 0.0 } else { PI });
        let path = 2.0 * self.ior * self.thickness * inside;
        let both = (lower * upper).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
        let passed = square(1.0 - upper);
        let sum = passed * lower / (1.0 - both);
        // The mean over all wavelengths, and then the first two orders of interference.
        let mut reflected = upper + sum;
        let mut order = sum - (1.0 - upper);
        for m in [1.0, 2.0] {
            order *= both.map(f32::sqrt);
            reflected += order * (2.0 * seen(m * path, m * turn));
        }
        reflected.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// How red, green and blue change with a difference of paths in nanometers and a turn of each of the three: the Fourier
/// transform of what the eye sees, as Gaussians (section 5 of the paper and its supplement).
fn seen(path: f32, turn: Vec3) -> Vec3 {
    /// From XYZ to linear RGB with the primaries of sRGB.
    const RGB_FROM_XYZ: Mat3 = Mat3::from_cols(
        Vec3::new(3.240_454_2, -0.969_266, 0.055_643_4),
        Vec3::new(-1.537_138_5, 1.876_010_8, -0.204_025_9),
        Vec3::new(-0.498_531_4, 0.041_556, 1.057_225_2),
    );
    /// Height, place and variance of each, and X has two.
    const X: [f32; 3] = [5.4856e-13, 1.6810e6, 4.3278e9];
    const Y: [f32; 3] = [4.4201e-13, 1.7953e6, 9.3046e9];
    const Z: [f32; 3] = [5.2481e-13, 2.2084e6, 6.6121e9];
    const SECOND_X: [f32; 3] = [9.7470e-14, 2.2399e6, 4.5282e9];
    const SUM: f32 = 1.0685e-7;
    let phase = 2.0 * PI * path * 1e-9;
    let wave = |[height, place, variance]: [f32; 3], turn: f32| {
        let width = (2.0 * PI * variance).sqrt();
        height * width * libm::cosf(place * phase + turn) * libm::expf(-variance * phase * phase)
    };
    let xyz = Vec3::new(wave(X, turn.x) + wave(SECOND_X, turn.x), wave(Y, turn.y), wave(Z, turn.z));
    RGB_FROM_XYZ * (xyz / SUM)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_film_changes_nothing() {
        let normal = Vec3::new(0.04, 0.3, 0.9);
        for cosine in [0.2, 0.6, 1.0] {
            let plain = schlick(cosine, normal);
            assert_eq!(Film::new(0.0, 1.5, 300.0).over(plain, cosine, normal), plain);
            // A film of no thickness is not seen, but for orders above the second.
            let thin = Film::new(1.0, 1.6, 0.0).over(plain, cosine, normal);
            assert!((thin - plain).abs().max_element() < 0.02, "{cosine}: {thin} {plain}");
        }
    }

    #[test]
    fn films_of_different_thickness_have_different_colors() {
        let normal = Vec3::splat(0.04);
        let of = |thickness| Film::new(1.0, 1.33, thickness).over(normal, 1.0, normal);
        // A quarter of a wave there and back: between air and glass, a film of less index takes reflection away.
        let green = of(550.0 / (4.0 * 1.33));
        assert!(green.max_element() < 0.02, "{green}");
        assert!((of(400.0) - of(250.0)).abs().max_element() > 0.005);
        // Very thick ones have no color.
        let white = of(20_000.0);
        assert!((white.x - white.y).abs() < 1e-3 && (white.y - white.z).abs() < 1e-3, "{white}");
    }

    #[test]
    fn nothing_is_brighter_than_the_bound() {
        for (ior, thickness) in [(1.3, 400.0), (2.0, 300.0), (1.0, 100.0), (1.8, 900.0)] {
            let (film, normal) = (Film::new(1.0, ior, thickness), Vec3::splat(0.04));
            let bound = film.bound(normal);
            for cosine in (1..50).map(|i| i as f32 / 50.0) {
                let found = film.over(schlick(cosine, normal), cosine, normal);
                assert!((found - schlick(cosine, bound)).max_element() < 0.02, "{ior} {thickness} {cosine}");
            }
        }
    }
}
