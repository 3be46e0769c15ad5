//! Where rays probably hit (Moon et al. 2010, section 4.1).

use glam::Vec3;
use raystrips_geom::{Aabb, Hit, Ray};
use raystrips_tracer::{GeometryBounds, Scene, Tracer};

/// With more geometries than this, what a ray misses is found by the box around all of them.
const MOST_BOXES: usize = 64;
/// Boxes are this part of the scene's diagonal larger, so that no rounding makes a ray miss one that it meets.
const SLACK: f32 = 1e-4;

/// Finds approximate hit points with a proxy that fits the processor's cache, and boxes of the original geometries.
pub struct HitPoints {
    proxy: Option<Scene>,
    boxes: Vec<Aabb>,
}

impl HitPoints {
    /// From the proxy and the boxes of the geometries of a scene with these bounds.
    pub fn new(proxy: Option<Scene>, geometries: &[GeometryBounds], bounds: &Aabb) -> HitPoints {
        let geometry = |b: &GeometryBounds| Aabb { min: b.min.into(), max: b.max.into() };
        let mut boxes: Vec<Aabb> =
            geometries.iter().map(geometry).filter(|b| b.min.cmple(b.max).all()).collect();
        if boxes.is_empty() || boxes.len() > MOST_BOXES {
            boxes = vec![*bounds];
        }
        let slack = Vec3::splat(SLACK * bounds.diagonal());
        boxes.iter_mut().for_each(|b| *b = Aabb { min: b.min - slack, max: b.max + slack });
        HitPoints { proxy, boxes }
    }

    /// Writes into `points[i]` where `rays[i]` hits the proxy, else where it enters the nearest box of a geometry (the
    /// virtual hit point); `None` if it meets no box, and so nothing.
    pub(crate) fn find(&self, rays: &[Ray], points: &mut Vec<Option<Vec3>>) {
        let mut hits = vec![Hit::MISS; rays.len()];
        if let Some(proxy) = &self.proxy {
            Tracer::new(proxy).intersect_batch(rays, &mut hits);
        }
        points.clear();
        points.extend(rays.iter().zip(hits).map(|(ray, hit)| match hit.is_hit() {
            true => Some(ray.at(hit.t)),
            false => {
                self.boxes.iter().filter_map(|b| entry(b, ray)).min_by(f32::total_cmp).map(|t| ray.at(t))
            }
        }));
    }
}

/// Where a ray enters a box, or its beginning if that is inside.
fn entry(b: &Aabb, ray: &Ray) -> Option<f32> {
    let inv_dir = ray.dir.recip();
    let (lo, hi) = ((b.min - ray.org) * inv_dir, (b.max - ray.org) * inv_dir);
    // Where a ray runs in a plane of the box a product is no number: that axis decides nothing.
    let decides_nothing = lo.is_nan_mask() | hi.is_nan_mask();
    let or = |other: f32, x: Vec3| Vec3::select(decides_nothing, Vec3::splat(other), x);
    let tnear = or(ray.tnear, lo.min(hi)).max_element().max(ray.tnear);
    let tfar = or(ray.tfar, lo.max(hi)).min_element().min(ray.tfar);
    (tnear <= tfar).then_some(tnear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_entered_or_missed() {
        let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let entry = |org: [f32; 3], dir: [f32; 3]| entry(&unit, &Ray::new(org.into(), dir.into()));
        assert_eq!(entry([-1.0, 0.5, 0.5], [2.0, 0.0, 0.0]), Some(0.5));
        assert_eq!(entry([0.5, 0.5, 0.5], [1.0, 1.0, 0.0]), Some(0.0));
        assert_eq!(entry([-1.0, 1.5, 0.5], [1.0, 0.0, 0.0]), None);
        assert_eq!(entry([-1.0, 0.5, 0.5], [-1.0, 0.0, 0.0]), None);
        assert_eq!(entry([-1.0, 0.0, 0.5], [1.0, 0.0, 0.0]), Some(1.0));
    }

    #[test]
    fn what_meets_no_box_hits_nothing() {
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let hit_points = HitPoints::new(None, &[], &bounds);
        let mut points = Vec::new();
        let toward = Ray::new(Vec3::new(-1.0, 0.5, 0.5), Vec3::X);
        let short = Ray { tfar: 0.5, ..toward };
        hit_points.find(&[toward, short], &mut points);
        assert!(points[0].is_some_and(|p| p.x.abs() < 1e-3) && points[1].is_none());
    }
}
