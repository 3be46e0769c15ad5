//! A ray with what every test of it needs.

use glam::Vec3;
use raystrips_geom::{Hit, Ray};

/// Shortest component of a direction. A ray parallel to an axis gets this instead of 0, so that no product of 0 and
/// infinity, which is no number, decides anything (the paper says nothing of them). A ray in the very face of a box
/// then is inside by the lower face and outside by the upper one.
const SHORTEST: f32 = 1e-20;

/// Exits are taken to be this much later: more than all roundings of three operations (Ize 2013), so that no box or
/// split loses a ray.
pub const LATER: f32 = 1.0 + 8.0 * f32::EPSILON;
/// Entries into split halves are taken to be this much earlier.
pub const EARLIER: f32 = 1.0 - 8.0 * f32::EPSILON;

/// A ray with the reciprocals of its direction.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Origin.
    pub org: Vec3,
    /// Direction, as given.
    pub dir: Vec3,
    /// Reciprocals of the direction, all finite.
    pub inv_dir: Vec3,
    /// Least distance of a hit.
    pub tnear: f32,
    /// Greatest distance of a hit.
    pub tfar: f32,
}

impl PreparedRay {
    /// Prepares a valid ray.
    #[inline]
    pub fn new(ray: &Ray) -> PreparedRay {
        let inv = |d: f32| 1.0 / if d.abs() < SHORTEST { SHORTEST } else { d };
        let inv_dir = Vec3::new(inv(ray.dir.x), inv(ray.dir.y), inv(ray.dir.z));
        PreparedRay { org: ray.org, dir: ray.dir, inv_dir, tnear: ray.tnear, tfar: ray.tfar }
    }

    /// What to begin a search with: no hit, and none beyond the end of the ray.
    #[inline]
    pub fn no_hit(&self) -> Hit {
        Hit { t: self.tfar, ..Hit::MISS }
    }
}

/// The result of a search.
#[inline]
pub fn hit_or_miss(best: Hit) -> Hit {
    if best.is_hit() { best } else { Hit::MISS }
}
