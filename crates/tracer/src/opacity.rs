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
    opacity >= 1.0 || chance(ray, entry) < opacity
}

/// A number from 0 to 1 that belongs to this ray and this place of a segment (finalizer of SplitMix64, Steele et al. 2014).
#[cold]
fn chance(ray: &PreparedRay, entry: &WindowHit) -> f32 {
    let pair = |a: f32, b: f32| u64::from(a.to_bits()) << 32 | u64::from(b.to_bits());
    let [[x, y, z, _], [u, v, w, _]] = [ray.org, ray.inv_dir];
    let words = [pair(x, y), pair(z, u), pair(v, w), pair(entry.t, entry.u)];
    let hash = words.iter().fold(0u64, |hash, word| {
        let z = (hash ^ word).wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    });
    (hash >> 40) as f32 / (1u32 << 24) as f32
}
