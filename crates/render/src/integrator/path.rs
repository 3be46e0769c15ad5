//! Path tracing with next-event estimation (Kajiya 1986; the estimator as in chapter 14 of "Physically Based
//! Rendering", 3rd edition).
//!
//! At each surface one point of the area lights and one punctual light are sampled, and the path goes on in a
//! direction sampled as the surface scatters. Area lights and an environment are found both ways and weighted by multiple
//! importance sampling; other skies only by directions, punctual lights only by sampling. Lights are not sampled through surfaces, nor
//! for smooth ones: what goes there counts in full.
//!
//! Partly opaque surfaces let a path pass by chance, and shadow rays too. Of partly opaque strands the tracer decides which
//! rays they stop.

use super::{DirectLight, Pair, Shader};
use crate::{
    bsdf::Bsdf,
    camera::CameraPaths,
    interaction::SurfaceInteraction,
    wave::{Path, ShadeOutput},
};
use glam::Vec3;
use raystrips_geom::Ray;

/// Russian roulette spares this many reflections: they carry most of the light.
const ROULETTE_START: u32 = 3;

/// Partly opaque surfaces that a path may pass, so that every path ends.
pub(crate) const MAX_PASSED: u32 = 256;

/// Light by path tracing.
pub(crate) struct PathTracer<'a> {
    pub camera: CameraPaths,
    pub direct: DirectLight<'a>,
    pub max_bounces: u32,
}

impl<'a> PathTracer<'a> {
    pub fn new(camera: CameraPaths, direct: DirectLight<'a>, max_bounces: u32) -> PathTracer<'a> {
        PathTracer { camera, direct, max_bounces }
    }

    /// An opaque surface: what it emits, what it reflects of lamps, and the ray that finds the rest.
    fn reflect(
        &self,
        path: &mut Path,
        ray: &Ray,
        hit: &SurfaceInteraction,
        out: &mut ShadeOutput,
    ) -> Option<Ray> {
        if path.bounces == 0 {
            out.add_first_hit(path, hit);
        }
        self.add_emission(path, ray, hit, out);
        let bsdf = Bsdf::new(&hit.material, hit.shading_n, hit.front, ray.dir);
        if bsdf.is_black() || path.bounces >= self.max_bounces {
            return None;
        }
        self.direct.add_lamps(path, hit, &bsdf, out);
        self.direct.add_sky(path, hit, &bsdf, out);
        self.scatter(path, hit, &bsdf)
    }

    /// Emission of the surface itself.
    fn add_emission(&self, path: &Path, ray: &Ray, hit: &SurfaceInteraction, out: &mut ShadeOutput) {
        let emitted = hit.material.emitted(hit.front);
        if emitted == Vec3::ZERO {
            return;
        }
        let weight = path.scatter_pdf.map_or(1.0, |scatter_pdf| {
            // Of textured lamps nobody knows where they shine: they are found by direction alone.
            let light_pdf = match hit.material.is_lamp {
                true => {
                    let distance = path.straight + hit.distance;
                    self.direct.area_lights.pdf(&hit.material, distance, hit.n.dot(ray.dir))
                }
                false => 0.0,
            };
            1.0 - (self.direct.weight)(light_pdf, scatter_pdf)
        });
        out.add(path, path.throughput * emitted * weight);
    }

    /// The ray with which the path goes on, unless it ends here.
    fn scatter(&self, path: &mut Path, hit: &SurfaceInteraction, bsdf: &Bsdf) -> Option<Ray> {
        // Of the pair for punctual lights one number is left.
        let [_, choice] = Pair::PunctualLight.of(path);
        let scattered = bsdf.sample(Pair::Direction.of(path), choice)?;
        if !hit.leaves(scattered.wi, scattered.is_transmitted) {
            return None;
        }
        path.throughput *= scattered.weight;
        path.bounces += 1;
        path.straight = 0.0;
        let survival = path.throughput.max_element();
        if path.bounces >= ROULETTE_START && survival < 1.0 {
            if Pair::Survival.of(path)[1] >= survival {
                return None;
            }
            path.throughput /= survival;
        }
        path.scatter_pdf = scattered.pdf;
        path.medium = hit.medium_after(path.medium, scattered.is_transmitted);
        path.spread = path.spread.max(bsdf.spread());
        Some(hit.spawn(scattered.wi, scattered.is_transmitted))
    }

    /// The same ray behind the surface.
    fn pass(&self, path: &mut Path, ray: &Ray, hit: &SurfaceInteraction) -> Option<Ray> {
        path.straight += hit.distance;
        path.passed += 1;
        (path.passed <= MAX_PASSED).then(|| hit.spawn(ray.dir, true))
    }
}

impl Shader for PathTracer<'_> {
    fn begin(&self, at: [u32; 2], sample_index: u32, pixel: u32) -> (Ray, Path) {
        self.camera.begin(at, sample_index, pixel)
    }

    fn shade(
        &self,
        path: &mut Path,
        ray: &Ray,
        hit: Option<&SurfaceInteraction>,
        out: &mut ShadeOutput,
    ) -> Option<Ray> {
        let Some(hit) = hit else {
            out.add(path, path.throughput * self.direct.sky_found(ray.dir, path.scatter_pdf));
            return None;
        };
        path.throughput *= hit.transmittance();
        let passes = hit.alpha < 1.0 && Pair::Survival.of(path)[0] >= hit.alpha;
        let next = if passes { self.pass(path, ray, hit) } else { self.reflect(path, ray, hit, out) };
        path.segment += 1;
        next
    }
}
