//! What lies over a surface: a clear coat, and below it sheen.
//!
//! What each of them reflects is taken from what is below, by the share that it reflects of light from everywhere: the greater
//! one of those of the two directions, so that both ways are the same and no light is made (KHR_materials_sheen, as Estevez and
//! Kulla 2017, section 4). Where light is diffused below a clear coat nothing is lost by that.

use super::energy::Coat;
use super::ggx::Ggx;
use super::sheen::Sheen;
use super::{Scattered, mirrored};
use crate::layers::Layers;
use glam::Vec3;

/// Reflectance straight back of a clear coat, whose index of refraction is 1.5.
const CLEARCOAT_NORMAL: f32 = 0.04;

/// Layers that reflect by themselves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layered {
    coat: Option<Coat>,
    /// Of the clear coat; nothing: it is smooth.
    facets: Option<Ggx>,
    sheen: Option<Sheen>,
    /// Probabilities with which clear coat and sheen are chosen.
    choice: [f32; 2],
}

impl Layered {
    pub fn new(layers: &Layers) -> Option<Layered> {
        let alpha = layers.clearcoat_roughness * layers.clearcoat_roughness;
        let coat = Coat { alpha, normal: Vec3::splat(CLEARCOAT_NORMAL), strength: layers.clearcoat };
        let sheen = Sheen::new(layers.sheen, layers.sheen_roughness);
        layers.reflect().then_some(Layered {
            coat: (layers.clearcoat > 0.0).then_some(coat),
            facets: (alpha >= Ggx::MIN_ALPHA).then(|| Ggx::new(alpha)),
            sheen: (layers.sheen != Vec3::ZERO).then_some(sheen),
            choice: [0.0; 2],
        })
    }

    /// What clear coat and sheen reflect of light from everywhere to a viewer.
    pub fn reflected(&self, cosine: f32) -> [f32; 2] {
        let coat = self.coat.map_or(0.0, |coat| 1.0 - coat.passed(cosine));
        [coat, self.sheen.map_or(0.0, |sheen| sheen.albedo(cosine)) * (1.0 - coat)]
    }

    /// Share of light that gets below both if it comes at one angle and leaves at another one.
    pub fn passed(&self, cosines: [f32; 2]) -> f32 {
        self.below_coat(cosines) * self.below_sheen(cosines)
    }

    /// Share of what is diffused below a boundary that gets there and back through that and the layers, with all of the light
    /// where nothing is absorbed ([`Coat::diffuse`], of both coats together).
    pub fn diffuse(&self, boundary: Coat, cosines: [f32; 2]) -> f32 {
        let Some(coat) = self.coat else { return boundary.diffuse(cosines) * self.below_sheen(cosines) };
        const STEPS: u32 = 16;
        let passed = |cosine: f32| coat.passed(cosine) * boundary.passed(cosine);
        let mean =
            (0..STEPS).map(|i| passed(((i as f32 + 0.5) / STEPS as f32).sqrt())).sum::<f32>() / STEPS as f32;
        let [a, b] = cosines.map(passed);
        if mean > 0.0 { a * b / mean * self.below_sheen(cosines) } else { 0.0 }
    }

    fn below_coat(&self, [a, b]: [f32; 2]) -> f32 {
        self.coat.map_or(1.0, |coat| coat.passed(a).min(coat.passed(b)))
    }

    fn below_sheen(&self, [a, b]: [f32; 2]) -> f32 {
        self.sheen.map_or(1.0, |sheen| 1.0 - sheen.albedo(a).max(sheen.albedo(b)))
    }

    pub fn choose(&mut self, choice: [f32; 2]) {
        self.choice = choice;
    }

    /// Some of it is spread at least as widely as by facets of this width.
    pub fn is_wide(&self, alpha: f32) -> bool {
        let [coat, sheen] = self.choice;
        sheen > 0.0 || (coat > 0.0 && self.coat.is_some_and(|coat| coat.alpha >= alpha))
    }

    /// What both reflect by themselves, and the density with which they are asked for this direction.
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let (mut value, mut pdf) = (Vec3::ZERO, 0.0);
        if let Some(sheen) = self.sheen {
            value += sheen.value(wo, wi) * self.below_coat([wo.z, wi.z]);
            pdf += self.choice[1] * Sheen::PDF;
        }
        if let (Some(coat), Some(ggx)) = (self.coat, self.facets) {
            let h = (wo + wi).normalize();
            let facets = ggx.facets(h) / (4.0 * wo.z);
            value += coat.reflectance(wo.dot(h)) * (facets * ggx.visible_from_both(wo, wi) / wi.z);
            pdf += self.choice[0] * facets * ggx.visible(wo);
        }
        (value, pdf)
    }

    /// A direction by the layer that `choice` is for, counted from the first; and all there is to know if that is the only one
    /// from which light comes to the viewer.
    pub fn sample(&self, wo: Vec3, u: [f32; 2], choice: f32) -> (Vec3, Option<Scattered>) {
        match (self.coat, self.facets) {
            (Some(_), Some(ggx)) if choice < self.choice[0] => (mirrored(wo, ggx.sample(wo, u)), None),
            (Some(coat), None) if choice < self.choice[0] => {
                let wi = mirrored(wo, Vec3::Z);
                let weight = coat.reflectance(wo.z) / self.choice[0];
                (wi, Some(Scattered { wi, weight, pdf: None, is_transmitted: false, eta: 1.0 }))
            }
            _ => (Sheen::sample(u), None),
        }
    }
}
