//! Normals as colors.

use super::{Shader, past_what_is_not_there};
use crate::{
    camera::CameraPaths,
    interaction::SurfaceInteraction,
    wave::{Path, ShadeOutput},
};
use raystrips_geom::Ray;

/// (n + 1) / 2 of the normal on the side of the viewer; black where nothing is.
pub(crate) struct Normals {
    pub camera: CameraPaths,
}

impl Shader for Normals {
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
        let hit = hit?;
        if let Some(ray) = past_what_is_not_there(path, ray, hit) {
            return Some(ray);
        }
        out.add_first_hit(path, hit);
        out.add(path, hit.shading_n * 0.5 + 0.5);
        None
    }
}
