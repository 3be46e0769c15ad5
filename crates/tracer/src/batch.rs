//! Many rays at once, for callers without a tracer of their own.

use crate::{Scene, Tracer};
use raystrips_geom::{Hit, Ray};

/// Closest hits of `rays`, `hits[i]` for `rays[i]`.
///
/// # Panics
/// If the lengths differ.
pub fn intersect_batch(scene: &Scene, rays: &[Ray], hits: &mut [Hit]) {
    Tracer::new(scene).intersect_batch(rays, hits);
}

/// Whether something lies on each of `rays`, `occluded[i]` for `rays[i]`.
///
/// # Panics
/// If the lengths differ.
pub fn occluded_batch(scene: &Scene, rays: &[Ray], occluded: &mut [bool]) {
    Tracer::new(scene).occluded_batch(rays, occluded);
}
