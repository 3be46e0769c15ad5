//! Light that comes straight from lamps or an environment and is reflected: one point of the area lights, one punctual light
//! and one direction of the environment are sampled.

use super::numbers::Pair;
use crate::{
    bsdf::Bsdf,
    interaction::SurfaceInteraction,
    lights::{AreaLights, PunctualLights},
    sky::SkyLight,
    wave::{Path, ShadeOutput},
};
use glam::Vec3;

/// Weight of a point found by light sampling, of its density and that of sampling by direction. Points found by
/// direction get the rest to 1.
pub(crate) type LightWeight = fn(f32, f32) -> f32;

/// Lamps and the sky.
pub(crate) struct DirectLight<'a> {
    pub area_lights: AreaLights<'a>,
    pub punctual_lights: PunctualLights<'a>,
    pub weight: LightWeight,
    pub sky: SkyLight<'a>,
    /// The same as `weight` for directions of the sky.
    pub sky_weight: LightWeight,
}

impl DirectLight<'_> {
    /// Adds what of the light of lamps reaches a surface, unless something stands between.
    pub fn add_lamps(&self, path: &Path, hit: &SurfaceInteraction, bsdf: &Bsdf, out: &mut ShadeOutput) {
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

    /// Adds what of the light of an environment reaches a surface, as far as it is found by sampling it.
    pub fn add_sky(&self, path: &Path, hit: &SurfaceInteraction, bsdf: &Bsdf, out: &mut ShadeOutput) {
        let SkyLight::Environment(environment) = self.sky else { return };
        let Some(light) = environment.sample(Pair::Sky.of(path)) else { return };
        let cosine = hit.shading_n.dot(light.wi);
        if cosine <= 0.0 || !hit.leaves(light.wi, false) {
            return;
        }
        let (reflected, pdf) = bsdf.evaluate(light.wi);
        if reflected != Vec3::ZERO {
            let scale = cosine * (self.sky_weight)(light.pdf, pdf) / light.pdf;
            let contribution = path.throughput * reflected * environment.radiance(light.wi) * scale;
            out.add_unless_occluded(path, hit.point.spawn(hit.n, light.wi), contribution);
        }
    }

    /// Light of the sky that a ray along `dir` finds, as far as it is found so. `scatter_pdf`: the density of the direction,
    /// where it could have been sampled for its light too.
    pub fn sky_found(&self, dir: Vec3, scatter_pdf: Option<f32>) -> Vec3 {
        match (self.sky, scatter_pdf) {
            (SkyLight::Environment(environment), Some(scatter_pdf)) => {
                let (radiance, pdf) = environment.radiance_and_pdf(dir);
                radiance * (1.0 - (self.sky_weight)(pdf, scatter_pdf))
            }
            (sky, _) => sky.radiance(dir),
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
