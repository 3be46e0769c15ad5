//! Shadow rays in scenes with surfaces that let rays pass here and there, such as leaves cut out of a picture: they go from
//! surface to surface as paths do, since what is met first decides, and whether it stops a ray its textures tell.

use crate::integrator::MAX_PASSED;
use crate::interaction::SurfaceInteraction;
use crate::wave::{Path, PendingLight, ShadeOutput};
use raystrips_geom::{Ray, chance};

/// A shadow ray as a path: it brings its light if it gets through.
pub(crate) fn path(light: PendingLight) -> Path {
    Path::shadow(light.pixel, light.contribution)
}

/// What comes of a shadow ray that found a surface, or nothing: the ray behind the surface, if it goes on.
pub(crate) fn go_on(
    path: &mut Path,
    ray: &Ray,
    hit: Option<&SurfaceInteraction>,
    out: &mut ShadeOutput,
) -> Option<Ray> {
    let Some(hit) = hit else {
        out.add(path, path.throughput);
        return None;
    };
    path.passed += 1;
    let (org, dir) = (ray.org, ray.dir);
    let chance = || chance([[org.x, org.y], [org.z, dir.x], [dir.y, dir.z], [hit.distance, 0.0]]);
    let passes = hit.alpha < 1.0 && path.passed <= MAX_PASSED && chance() >= hit.alpha;
    let t = hit.distance / ray.dir.length();
    passes.then(|| Ray { tfar: ray.tfar - t, ..hit.spawn(ray.dir, true) })
}
