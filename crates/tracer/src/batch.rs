//! Many rays at once.

use crate::{Scene, Tracer};
use raystrips_geom::{Hit, Ray};

/// Closest hits of `rays`, `hits[i]` for `rays[i]`.
///
/// # Panics
/// If the lengths differ.
pub fn intersect_batch(scene: &Scene, rays: &[Ray], hits: &mut [Hit]) {
    assert_eq!(rays.len(), hits.len());
    let mut tracer = Tracer::new(scene);
    for (ray, hit) in rays.iter().zip(hits) {
        *hit = tracer.intersect(ray);
    }
}

/// Whether something lies on each of `rays`, `occluded[i]` for `rays[i]`.
///
/// # Panics
/// If the lengths differ.
pub fn occluded_batch(scene: &Scene, rays: &[Ray], occluded: &mut [bool]) {
    assert_eq!(rays.len(), occluded.len());
    let mut tracer = Tracer::new(scene);
    for (ray, occluded) in rays.iter().zip(occluded) {
        *occluded = tracer.occluded(ray);
    }
}
