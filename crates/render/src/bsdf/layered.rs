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
    /// Two tangents and the normal of the clear coat, in the frame of the surface.
    frame: [Vec3; 3],
    sheen: Option<Sheen>,
    /// Probabilities with which clear coat and sheen are chosen.
    choice: [f32; 2],
}

impl Layered {
    /// Layers with a clear coat of this normal in the frame of the surface.
    pub fn new(layers: &Layers, coat_normal: Vec3) -> Option<Layered> {
        let alpha = layers.clearcoat_roughness * layers.clearcoat_roughness;
        let coat = Coat { alpha, normal: Vec3::splat(CLEARCOAT_NORMAL), strength: layers.clearcoat };
        let sheen = Sheen::new(layers.sheen, layers.sheen_roughness);
        let (s, t) = coat_normal.any_orthonormal_pair();
        layers.reflect().then_some(Layered {
            coat: (layers.clearcoat > 0.0).then_some(coat),
            facets: (alpha >= Ggx::MIN_ALPHA).then(|| Ggx::new(alpha)),
            frame: [s, t, coat_normal],
            sheen: (layers.sheen != Vec3::ZERO).then_some(sheen),
            choice: [0.0; 2],
        })
    }

    /// A direction in the frame of the clear coat, before it.
    fn at_coat(&self, w: Vec3) -> Vec3 {
        let [s, t, n] = self.frame;
        Vec3::new(s.dot(w), t.dot(w), n.dot(w).max(1e-4))
    }

    /// A direction of that frame in the frame of the surface.
    fn at_surface(&self, w: Vec3) -> Vec3 {
        let [s, t, n] = self.frame;
        s * w.x + t * w.y + n * w.z
    }

    /// What clear coat and sheen reflect of light from everywhere to a viewer.
    pub fn reflected(&self, wo: Vec3) -> [f32; 2] {
        let coat = self.coat.map_or(0.0, |coat| 1.0 - coat.passed(self.at_coat(wo).z));
        [coat, self.sheen.map_or(0.0, |sheen| sheen.albedo(wo.z)) * (1.0 - coat)]
    }

    /// Share of light that gets below both if it comes along one direction and leaves along the other.
    pub fn passed(&self, directions: [Vec3; 2]) -> f32 {
        self.below_coat(directions) * self.below_sheen(directions)
    }

    /// Share of what is diffused below a boundary that gets there and back through that and the layers, with all of the light
    /// where nothing is absorbed ([`Coat::diffuse`], of both coats together).
    pub fn diffuse(&self, boundary: Coat, directions: [Vec3; 2]) -> f32 {
        let below_sheen = self.below_sheen(directions);
        let Some(coat) = self.coat else { return boundary.diffuse(directions.map(|w| w.z)) * below_sheen };
        const STEPS: u32 = 16;
        let passed = |cosine: f32| coat.passed(cosine) * boundary.passed(cosine);
        let mean =
            (0..STEPS).map(|i| passed(((i as f32 + 0.5) / STEPS as f32).sqrt())).sum::<f32>() / STEPS as f32;
        let [a, b] = directions.map(|w| coat.passed(self.at_coat(w).z) * boundary.passed(w.z));
        if mean > 0.0 { a * b / mean * below_sheen } else { 0.0 }
    }

    fn below_coat(&self, directions: [Vec3; 2]) -> f32 {
        let [a, b] = directions.map(|w| self.at_coat(w).z);
        self.coat.map_or(1.0, |coat| coat.passed(a).min(coat.passed(b)))
    }

    fn below_sheen(&self, [a, b]: [Vec3; 2]) -> f32 {
        self.sheen.map_or(1.0, |sheen| 1.0 - sheen.albedo(a.z).max(sheen.albedo(b.z)))
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
            value += sheen.value(wo, wi) * self.below_coat([wo, wi]);
            pdf += self.choice[1] * Sheen::PDF;
        }
        let is_before_coat = self.frame[2].dot(wi) > 0.0;
        if let (Some(coat), Some(ggx), true) = (self.coat, self.facets, is_before_coat) {
            let (coat_wo, coat_wi) = (self.at_coat(wo), self.at_coat(wi));
            let h = (coat_wo + coat_wi).normalize();
            let facets = ggx.facets(h) / (4.0 * coat_wo.z);
            // By the cosine at the surface, with which the sum will be multiplied.
            let visible = ggx.visible_from_both(coat_wo, coat_wi) / wi.z;
            value += coat.reflectance(coat_wo.dot(h)) * (facets * visible);
            pdf += self.choice[0] * facets * ggx.visible(coat_wo);
        }
        (value, pdf)
    }

    /// A direction by the layer that `choice` is for, counted from the first; and all there is to know if that is the only one
    /// from which light comes to the viewer.
    pub fn sample(&self, wo: Vec3, u: [f32; 2], choice: f32) -> (Vec3, Option<Scattered>) {
        match (self.coat, self.facets) {
            (Some(_), Some(ggx)) if choice < self.choice[0] => {
                let coat_wo = self.at_coat(wo);
                let wi = mirrored(coat_wo, ggx.sample(coat_wo, u));
                // Nothing comes from behind.
                (if wi.z > 0.0 { self.at_surface(wi) } else { Vec3::NEG_Z }, None)
            }
            (Some(coat), None) if choice < self.choice[0] => {
                let coat_wo = self.at_coat(wo);
                let wi = self.at_surface(mirrored(coat_wo, Vec3::Z));
                let weight = coat.reflectance(coat_wo.z) / self.choice[0];
                (wi, Some(Scattered { wi, weight, pdf: None, is_transmitted: false, eta: 1.0 }))
            }
            _ => (Sheen::sample(u), None),
        }
    }
}
