//! Strands that are partly opaque.
//!
//! A ray is stopped by such a strand with the probability of its opacity, and else goes on as if nothing were there. So the
//! mean over rays is that of light that is weakened from strand to strand, for shadows too, and no ray has to be taken
//! up again: the paper goes on with every ray until 0.9 of it is stopped (Moon et al. 2010, section 7). What decides is
//! a hash of the ray and of where it enters the strand, so that the answer is the same in whatever order strands are met,
//! and however they are packed.

use crate::pages::Pages;
use crate::prepared::PreparedRay;
use crate::window::WindowHit;
use raystrips_geom::chance;
use raystrips_pack::ClusterView;

/// Whether a segment of strip number `strip`, which is of a strand, stops a ray that enters it.
#[inline(always)]
pub(crate) fn stops<'s>(
    pages: impl Pages<'s>,
    cluster: &ClusterView,
    strip: usize,
    ray: &PreparedRay,
    entry: &WindowHit,
) -> bool {
    let opacity = pages.opacity(cluster.geometry_of_strip(strip));
    opacity >= 1.0 || of_entry(ray, entry) < opacity
}

/// The chance of this ray at this place of a segment.
#[cold]
fn of_entry(ray: &PreparedRay, entry: &WindowHit) -> f32 {
    let [[x, y, z, _], [u, v, w, _]] = [ray.org, ray.inv_dir];
    chance([[x, y], [z, u], [v, w], [entry.t, entry.u]])
}
