//! Ambient occlusion.

use super::{Shader, past_what_is_not_there};
use crate::{
    camera::CameraPaths,
    interaction::SurfaceInteraction,
    sampling::cosine_hemisphere,
    wave::{Path, ShadeOutput},
};
use glam::Vec3;
use raystrips_geom::{Aabb, Ray};

/// Directions of the hemisphere; pair 0 is the place in the pixel.
const PAIR_DIRECTION: u32 = 1;

/// White surfaces under a white sky that ends at a distance: one shadow ray a sample, opacity ignored.
pub(crate) struct AmbientOcclusion {
    camera: CameraPaths,
    /// Nothing farther away occludes.
    radius: f32,
}

impl AmbientOcclusion {
    /// Occlusion within a quarter of the diagonal of the scene.
    pub fn new(camera: CameraPaths, bounds: &Aabb) -> AmbientOcclusion {
        AmbientOcclusion { camera, radius: 0.25 * bounds.diagonal() }
    }
}

impl Shader for AmbientOcclusion {
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
            out.add(path, Vec3::ONE);
            return None;
        };
        if let Some(ray) = past_what_is_not_there(path, ray, hit) {
            return Some(ray);
        }
        out.add_first_hit(path, hit);
        let (dir, _) = cosine_hemisphere(hit.n, path.sampler.get_2d(PAIR_DIRECTION));
        let ray = Ray { tfar: self.radius, ..hit.point.spawn(hit.n, dir) };
        out.add_unless_occluded(path, ray, Vec3::ONE);
        None
    }
}
