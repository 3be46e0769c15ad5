//! Cameras: from a point of the picture to a ray.

use crate::params::{RenderError, RenderParams};
use crate::sampler::PathSampler;
use crate::wave::Path;
use crate::world::World;
use glam::{DVec3, Vec3};
use raystrips_geom::{
    Aabb, Ray,
    scene::{Camera, Projection},
};

/// A camera made ready for one picture size.
pub(crate) struct CameraRays {
    position: Vec3,
    forward: Vec3,
    /// From the middle of the picture to its right border, at distance 1 for perspective.
    right: Vec3,
    /// From the middle of the picture to its upper border.
    up: Vec3,
    orthographic: bool,
}

impl CameraRays {
    /// `aspect` is the width of the picture over its height, which takes the place of the camera's own: the
    /// height of what is seen stays.
    ///
    /// # Errors
    /// Where the camera has no direction or sees nothing.
    pub fn new(camera: &Camera, aspect: f32) -> Result<CameraRays, RenderError> {
        let bad = |problem| RenderError::Camera { name: camera.name.clone(), problem };
        let forward = Vec3::from(camera.forward).try_normalize().ok_or(bad("has no forward direction"))?;
        let right = forward.cross(camera.up.into()).try_normalize();
        let right = right.ok_or(bad("looks along its up direction"))?;
        let (half_height, orthographic) = match camera.projection {
            Projection::Perspective { vertical_fov } => (libm::tanf(0.5 * vertical_fov), false),
            Projection::Orthographic { height } => (0.5 * height, true),
        };
        if !(half_height > 0.0 && half_height < 1e10) {
            return Err(bad("has a field of view that is not between 0 and 180 degrees, or no height"));
        }
        let position = DVec3::from(camera.position).as_vec3();
        if !position.is_finite() {
            return Err(bad("has no finite position"));
        }
        let up = right.cross(forward) * half_height;
        Ok(CameraRays { position, forward, right: right * (half_height * aspect), up, orthographic })
    }

    /// The ray through a point of the picture, from -1 to 1 rightwards and upwards. Its direction is of unit
    /// length.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let across = self.right * x + self.up * y;
        if self.orthographic {
            Ray::new(self.position + across, self.forward)
        } else {
            Ray::new(self.position, (self.forward + across).normalize())
        }
    }
}

/// Where the paths of a picture begin: at the camera.
pub(crate) struct CameraPaths {
    camera: CameraRays,
    width: u32,
    height: u32,
    seed: u64,
    /// Number of what is sample 0 here.
    first_sample: u32,
    /// Width of a pixel at the camera, and how much wider it is at distance 1.
    extent: [f32; 2],
}

impl CameraPaths {
    /// Of the camera that was asked for, else of the first one of the scene, else of one that sees all of it.
    ///
    /// # Errors
    /// Where that is of no use.
    pub fn new(params: &RenderParams, world: &dyn World) -> Result<CameraPaths, RenderError> {
        let camera = params.camera.as_ref().or(world.description().cameras.first()).cloned();
        let camera = camera.unwrap_or_else(|| frame_bounds(&world.bounds(), params.aspect()));
        let camera = CameraRays::new(&camera, params.aspect())?;
        let &RenderParams { width, height, seed, .. } = params;
        let extent = 2.0 * camera.up.length() / height as f32;
        let extent = if camera.orthographic { [extent, 0.0] } else { [0.0, extent] };
        Ok(CameraPaths { camera, width, height, seed, first_sample: 0, extent })
    }

    /// The same with other samples.
    pub fn starting_at(self, first_sample: u32) -> CameraPaths {
        CameraPaths { first_sample, ..self }
    }

    /// The beginning of a path, which is counted to number `pixel` of a film: a ray through a uniform point of the pixel at
    /// (x, y), so a box filter of one pixel.
    pub fn begin(&self, [x, y]: [u32; 2], sample_index: u32, pixel: u32) -> (Ray, Path) {
        let sampler = PathSampler::new([x, y], self.first_sample + sample_index, self.seed);
        let [u, v] = sampler.get_2d(0);
        let along = |pixel: u32, u: f32, extent: u32| 2.0 * (pixel as f32 + u) / extent as f32 - 1.0;
        let ray = self.camera.ray(along(x, u, self.width), -along(y, v, self.height));
        let [width, spread] = self.extent;
        (ray, Path { width, spread, ..Path::new(pixel, sampler, Vec3::ONE) })
    }
}

/// A camera that shows the whole of a box from right above, in front and to the right (+y is up), with a
/// vertical field of view of 40 degrees. `aspect` is the picture's width over height.
pub fn frame_bounds(bounds: &Aabb, aspect: f32) -> Camera {
    let half_fov = 20f32.to_radians();
    let tightest = half_fov.min(libm::atanf(libm::tanf(half_fov) * aspect));
    // Somewhat away from a scene of a single point or none.
    let radius = if bounds.diagonal() > 0.0 { 0.5 * bounds.diagonal() } else { 1.0 };
    let center = if bounds.is_empty() { Vec3::ZERO } else { bounds.center() };
    let backward = Vec3::new(0.55, 0.45, 1.0).normalize();
    let right = Vec3::Y.cross(backward).normalize();
    let position = center.as_dvec3() + backward.as_dvec3() * f64::from(radius / libm::sinf(tightest));
    Camera {
        name: "frame".into(),
        position: position.into(),
        forward: (-backward).into(),
        up: backward.cross(right).into(),
        projection: Projection::Perspective { vertical_fov: 2.0 * half_fov },
        aspect: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    fn camera(projection: Projection) -> Camera {
        Camera {
            name: String::new(),
            position: [1.0, 2.0, 3.0],
            forward: [0.0, 0.0, -1.0],
            up: [0.0, 1.0, 0.0],
            projection,
            aspect: None,
        }
    }

    #[test]
    fn corners_of_the_picture_are_where_the_projection_says() {
        let perspective = camera(Projection::Perspective { vertical_fov: FRAC_PI_2 });
        let ray = CameraRays::new(&perspective, 2.0).unwrap().ray(1.0, -1.0);
        assert_eq!(ray.org, Vec3::new(1.0, 2.0, 3.0));
        assert!(ray.dir.abs_diff_eq(Vec3::new(2.0, -1.0, -1.0).normalize(), 1e-6));
        let orthographic = camera(Projection::Orthographic { height: 4.0 });
        let ray = CameraRays::new(&orthographic, 0.5).unwrap().ray(1.0, 1.0);
        assert_eq!((ray.org, ray.dir), (Vec3::new(2.0, 4.0, 3.0), Vec3::NEG_Z));
    }

    #[test]
    fn framing_shows_the_whole_bounding_sphere() {
        for (bounds, aspect) in [
            (Aabb { min: Vec3::splat(-1e-3), max: Vec3::splat(1e-3) }, 1.0),
            (Aabb { min: Vec3::new(5.0, 6.0, 7.0), max: Vec3::new(1e6, 10.0, 9.0) }, 0.4),
            (Aabb { min: Vec3::ZERO, max: Vec3::ONE }, 3.0),
        ] {
            let camera = frame_bounds(&bounds, aspect);
            let rays = CameraRays::new(&camera, aspect).unwrap();
            let (center, radius) = (bounds.center().as_dvec3(), f64::from(0.5 * bounds.diagonal()));
            let distance = |x, y| {
                let ray = rays.ray(x, y);
                (center - ray.org.as_dvec3()).cross(ray.dir.as_dvec3()).length()
            };
            assert!(distance(0.0, 0.0) < 1e-3 * radius);
            let borders = [distance(1.0, 0.0), distance(-1.0, 0.0), distance(0.0, 1.0), distance(0.0, -1.0)];
            assert!(borders.iter().all(|d| *d > radius * 0.999));
            assert!(borders.iter().any(|d| *d < radius * 1.001));
        }
    }

    #[test]
    fn useless_cameras_are_refused() {
        let mut blind = camera(Projection::Perspective { vertical_fov: 0.0 });
        assert!(CameraRays::new(&blind, 1.0).is_err());
        blind = camera(Projection::Orthographic { height: 1.0 });
        blind.up = blind.forward;
        assert!(CameraRays::new(&blind, 1.0).is_err());
    }
}
