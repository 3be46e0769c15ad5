//! Light that comes straight from lamps and is reflected: one point of the area lights and one punctual light are sampled.

use super::numbers::Pair;
use crate::{
    bsdf::Bsdf,
    interaction::SurfaceInteraction,
    lights::{AreaLights, PunctualLights},
    wave::{Path, ShadeOutput},
};
use glam::Vec3;

/// Weight of a point found by light sampling, of its density and that of sampling by direction. Points found by
/// direction get the rest to 1.
pub(crate) type LightWeight = fn(f32, f32) -> f32;

/// Lamps that are sampled.
pub(crate) struct DirectLight<'a> {
    pub area_lights: AreaLights<'a>,
    pub punctual_lights: PunctualLights<'a>,
    pub weight: LightWeight,
}

impl DirectLight<'_> {
    /// Adds what of their light reaches a surface, unless something stands between.
    pub fn add(&self, path: &Path, hit: &SurfaceInteraction, bsdf: &Bsdf, out: &mut ShadeOutput) {
        self.add_area_light(path, hit, bsdf, out);
        self.add_punctual_light(path, hit, bsdf, out);
    }

    fn add_area_light(&self, path: &Path, hit: &SurfaceInteraction, bsdf: &Bsdf, out: &mut ShadeOutput) {
        if self.area_lights.is_empty() {
            return;
        }
        if let Some(light) = self.area_lights.sample(&hit.point, hit.n, Pair::AreaLight.of(path)) {
            let (reflected, pdf) = bsdf.evaluate(light.wi);
            if reflected != Vec3::ZERO {
                let scale = hit.shading_n.dot(light.wi).max(0.0) * (self.weight)(light.pdf, pdf) / light.pdf;
                let contribution = path.throughput * reflected * light.radiance * scale;
                out.add_unless_occluded(path, light.shadow_ray, contribution);
            }
        }
    }

    fn add_punctual_light(&self, path: &Path, hit: &SurfaceInteraction, bsdf: &Bsdf, out: &mut ShadeOutput) {
        if self.punctual_lights.is_empty() {
            return;
        }
        let [u, _] = Pair::PunctualLight.of(path);
        if let Some((ray, irradiance)) = self.punctual_lights.sample(&hit.point, hit.n, hit.shading_n, u) {
            let (reflected, _) = bsdf.evaluate(ray.dir.normalize());
            if reflected != Vec3::ZERO {
                out.add_unless_occluded(path, ray, path.throughput * reflected * irradiance);
            }
        }
    }
}
