//! Shadow rays in scenes with surfaces that let rays pass here and there, such as leaves cut out of a picture: they go from
//! surface to surface as paths do, since what is met first decides, and whether it stops a ray its textures tell.

use crate::interaction::SurfaceInteraction;
use crate::wave::{Path, PendingLight, ShadeOutput};
use raystrips_geom::Ray;

/// Surfaces that a shadow ray may pass, so that every one ends.
const MAX_PASSED: u32 = 256;

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
    let passes = hit.alpha < 1.0 && chance(ray, hit.distance) >= hit.alpha && path.passed <= MAX_PASSED;
    let t = hit.distance / ray.dir.length();
    passes.then(|| Ray { tfar: ray.tfar - t, ..hit.spawn(ray.dir, true) })
}

/// A number from 0 to 1 that belongs to this ray and this place (finalizer of SplitMix64, Steele et al. 2014).
fn chance(ray: &Ray, distance: f32) -> f32 {
    let pair = |a: f32, b: f32| u64::from(a.to_bits()) << 32 | u64::from(b.to_bits());
    let (org, dir) = (ray.org, ray.dir);
    let words = [pair(org.x, org.y), pair(org.z, dir.x), pair(dir.y, dir.z), pair(distance, 0.0)];
    let hash = words.iter().fold(0u64, |hash, word| {
        let z = (hash ^ word).wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    });
    (hash >> 40) as f32 / (1u32 << 24) as f32
}
