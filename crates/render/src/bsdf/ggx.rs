//! The distribution of microfacets of Trowbridge and Reitz 1975 (GGX), with the shadowing of Smith; and that stretched along
//! one direction of the surface (Heitz 2014, "Understanding the masking-shadowing function in microfacet-based BRDFs", section
//! 5).
//!
//! Directions are unit vectors in a frame whose z is the normal of the surface.

use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// A surface of microfacets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ggx {
    /// Widths of the distribution along x and y.
    pub alpha: Vec2,
    /// Their product.
    alpha2: f32,
    /// The first over the second.
    ratio: f32,
}

impl Ggx {
    /// Rougher than this: what is smoother is taken as smooth, since its lobe is narrower than floats can tell.
    pub const MIN_ALPHA: f32 = 1e-3;

    /// Of width `alpha`, at least [`Ggx::MIN_ALPHA`].
    pub fn new(alpha: f32) -> Ggx {
        Ggx::stretched(Vec2::splat(alpha))
    }

    /// Of different widths along x and y, each at least [`Ggx::MIN_ALPHA`].
    pub fn stretched(alpha: Vec2) -> Ggx {
        Ggx { alpha, alpha2: alpha.x * alpha.y, ratio: alpha.x / alpha.y }
    }

    /// Its widths differ.
    pub fn is_stretched(&self) -> bool {
        self.alpha.x != self.alpha.y
    }

    /// Density of facets with normal `h`.
    pub fn facets(&self, h: Vec3) -> f32 {
        // As a sum, which does not lose digits near the normal.
        let x = h.z * h.z * self.alpha2 + (h.x * h.x / self.ratio + h.y * h.y * self.ratio);
        self.alpha2 / (PI * x * x)
    }

    /// Area of hidden facets over that of visible ones, seen from `w`.
    fn hidden(&self, w: Vec3) -> f32 {
        let tangent2 = (w.x * w.x * self.ratio + w.y * w.y / self.ratio) / (w.z * w.z);
        0.5 * ((1.0 + self.alpha2 * tangent2).sqrt() - 1.0)
    }

    /// Share of facets that are seen from `w`.
    pub fn visible(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.hidden(w))
    }

    /// Share of facets that are seen from both sides of a reflection (Smith, heights correlated).
    pub fn visible_from_both(&self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.hidden(wo) + self.hidden(wi))
    }

    /// Normal of a facet that is seen from `wo`, with density `visible(wo) (wo·h) facets(h) / wo.z` (Heitz 2018, in the way
    /// of Dupuy and Benyoub 2023, "Sampling visible GGX normals with spherical caps").
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(self.alpha.x * wo.x, self.alpha.y * wo.y, wo.z).normalize();
        let (sin, cos) = libm::sincosf(TAU * u[0]);
        let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let h = Vec3::new(r * cos, r * sin, z) + stretched;
        Vec3::new(self.alpha.x * h.x, self.alpha.y * h.y, h.z.max(1e-12)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::PathSampler;

    /// Directions of the hemisphere, spread evenly, and what of its solid angle each stands for.
    fn hemisphere(count: u32) -> impl Iterator<Item = (Vec3, f32)> {
        (0..count).map(move |i| {
            let [u, v] = PathSampler::new([0, 0], i, 0).get_2d(0);
            let (sin, cos) = libm::sincosf(TAU * u);
            let r = (1.0 - v * v).sqrt();
            (Vec3::new(r * cos, r * sin, v), TAU / count as f32)
        })
    }

    #[test]
    fn facets_cover_the_surface_once() {
        for alpha in [Vec2::splat(0.1), Vec2::splat(0.3), Vec2::ONE, Vec2::new(0.9, 0.2), Vec2::new(0.1, 0.5)]
        {
            let ggx = Ggx::stretched(alpha);
            let projected: f32 = hemisphere(1 << 16).map(|(h, part)| ggx.facets(h) * h.z * part).sum();
            assert!((projected - 1.0).abs() < 0.01, "{alpha}: {projected}");
            // What is seen from any direction covers what the surface covers.
            let wo = Vec3::new(0.8, 0.0, 0.6);
            let seen = |h: Vec3| ggx.facets(h) * wo.dot(h).max(0.0) * ggx.visible(wo);
            let seen: f32 = hemisphere(1 << 16).map(|(h, part)| seen(h) * part).sum();
            assert!((seen - wo.z).abs() < 0.01, "{alpha}: {seen}");
        }
    }

    #[test]
    fn sampled_facets_have_the_mean_of_their_density() {
        for alpha in [Vec2::splat(0.4), Vec2::new(0.8, 0.2)] {
            let ggx = Ggx::stretched(alpha);
            let wo = Vec3::new(-0.6, 0.48, 0.64);
            let density = |h: Vec3| ggx.visible(wo) * wo.dot(h).max(0.0) * ggx.facets(h) / wo.z;
            let expected: Vec3 = hemisphere(1 << 16).map(|(h, part)| h * (density(h) * part)).sum();
            let sampler = |i| PathSampler::new([0, 0], i, 1).get_2d(0);
            let mean: Vec3 = (0..1 << 14).map(|i| ggx.sample(wo, sampler(i)) / (1 << 14) as f32).sum();
            assert!((mean - expected).length() < 0.01, "{alpha}: {mean} {expected}");
        }
    }
}
