//! Normals as colors.

use super::Shader;
use crate::{
    interaction::SurfaceInteraction,
    wave::{Path, ShadeOutput},
};
use raystrips_geom::Ray;

/// (n + 1) / 2 of the geometric normal on the side of the viewer; black where nothing is.
pub(crate) struct Normals;

impl Shader for Normals {
    fn shade(
        &self,
        path: &mut Path,
        _ray: &Ray,
        hit: Option<&SurfaceInteraction>,
        out: &mut ShadeOutput,
    ) -> Option<Ray> {
        let hit = hit?;
        out.add_first_hit(path, hit);
        out.add(path, hit.n * 0.5 + 0.5);
        None
    }
}
