//! Integrators: what a ray contributes once its nearest hit is known.

mod ao;
mod direct;
mod normal;
mod numbers;
mod path;

pub(crate) use ao::AmbientOcclusion;
pub(crate) use direct::DirectLight;
#[cfg(test)]
pub(crate) use direct::LightWeight;
pub(crate) use normal::Normals;
pub(crate) use numbers::Pair;
pub(crate) use path::{MAX_PASSED, PathTracer};

use crate::{
    interaction::SurfaceInteraction,
    shadow,
    wave::{Path, ShadeOutput},
};
use raystrips_geom::Ray;

/// Shades what a ray of a path found; a shadow ray may be on its way as a path, too.
pub(crate) fn follow(
    shader: &dyn Shader,
    path: &mut Path,
    ray: &Ray,
    hit: Option<&SurfaceInteraction>,
    out: &mut ShadeOutput,
) -> Option<Ray> {
    if path.is_shadow() { shadow::go_on(path, ray, hit, out) } else { shader.shade(path, ray, hit, out) }
}

/// The same ray behind a place that a texture cuts out, for integrators that take all else as opaque.
fn past_what_is_not_there(path: &mut Path, ray: &Ray, hit: &SurfaceInteraction) -> Option<Ray> {
    let is_there = hit.alpha > 0.0 || path.passed == MAX_PASSED;
    if is_there {
        return None;
    }
    path.segment += 1;
    path.straight += hit.distance;
    path.passed += 1;
    Some(hit.spawn(ray.dir, true))
}

/// How paths begin and go on.
pub(crate) trait Shader: Sync {
    /// The beginning of the path of a sample of the pixel at (x, y), which is counted to number `pixel` of a film.
    fn begin(&self, at: [u32; 2], sample_index: u32, pixel: u32) -> (Ray, Path);

    /// Whether shading looks for what is near to a hit, and so wants hits that are near to each other one after the other.
    fn looks_around(&self) -> bool {
        false
    }

    /// Rays with which a path goes on from a surface, at most.
    fn most_branches(&self) -> usize {
        1
    }

    /// Shades what `ray` of a path found (`None`: nothing): adds light to the film, asks for shadow rays, and
    /// returns the ray with which the path goes on. Where it goes on with several, each is a [branch](ShadeOutput::branch).
    fn shade(
        &self,
        path: &mut Path,
        ray: &Ray,
        hit: Option<&SurfaceInteraction>,
        out: &mut ShadeOutput,
    ) -> Option<Ray>;
}
