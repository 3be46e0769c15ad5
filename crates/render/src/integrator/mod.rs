//! Integrators: what a ray contributes once its nearest hit is known.

mod ao;
mod normal;
mod path;

pub(crate) use ao::AmbientOcclusion;
pub(crate) use normal::Normals;
#[cfg(test)]
pub(crate) use path::LightWeight;
pub(crate) use path::PathTracer;

use crate::{
    interaction::SurfaceInteraction,
    wave::{Path, ShadeOutput},
};
use raystrips_geom::Ray;

/// The shading step of a wave.
pub(crate) trait Shader: Sync {
    /// Shades what `ray` of a path found (`None`: nothing): adds light to the film, asks for shadow rays, and
    /// returns the ray with which the path goes on.
    fn shade(
        &self,
        path: &mut Path,
        ray: &Ray,
        hit: Option<&SurfaceInteraction>,
        out: &mut ShadeOutput,
    ) -> Option<Ray>;
}
