//! What a ray found: a point on a surface as seen from where the ray came.

use crate::{
    material::{Materials, ShadingMaterial},
    offset::SurfacePoint,
    world::Surface,
};
use glam::Vec3;
use raystrips_geom::{Hit, Ray, Shape};

/// A hit made ready for shading.
pub(crate) struct SurfaceInteraction<'a> {
    pub point: SurfacePoint,
    /// The geometric normal on the side of the viewer.
    pub n: Vec3,
    /// The front was hit, from which the corners run counter-clockwise.
    pub front: bool,
    /// Distance from the ray's origin in scene units.
    pub distance: f32,
    pub material: &'a ShadingMaterial,
    /// How much of the path ends here. Strands that let a ray pass were not hit by it.
    pub alpha: f32,
}

impl<'a> SurfaceInteraction<'a> {
    /// `None` where nothing was hit, or a triangle without area.
    pub fn new(materials: &'a Materials, ray: &Ray, hit: &Hit, surface: &Surface) -> Option<Self> {
        if !hit.is_hit() {
            return None;
        }
        let point = match &surface.shape {
            Shape::Triangle(corners) => SurfacePoint::on_triangle(corners, surface.u, surface.v)?,
            Shape::Segment(segment) => SurfacePoint::on_segment(segment, surface.u, ray, hit.t)?,
        };
        let front = point.ng.dot(ray.dir) < 0.0;
        let material = materials.of(surface.geometry);
        Some(SurfaceInteraction {
            alpha: if matches!(surface.shape, Shape::Segment(_)) { 1.0 } else { material.alpha },
            point,
            n: if front { point.ng } else { -point.ng },
            front,
            distance: hit.t * ray.dir.length(),
            material,
        })
    }

    /// The half line along `dir` from here, on this side or behind the surface.
    pub fn spawn(&self, dir: Vec3, is_behind: bool) -> Ray {
        self.point.spawn(if is_behind { -self.n } else { self.n }, dir)
    }

    /// What is left of light after its way here: a solid that it came through absorbs some.
    pub fn transmittance(&self) -> Vec3 {
        match !self.front && self.material.is_solid() {
            true => self.material.transmittance(self.distance),
            false => Vec3::ONE,
        }
    }
}
