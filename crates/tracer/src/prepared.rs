//! What all tests of one ray share, computed once.

use glam::Vec3;
use raystrips_geom::Ray;

/// A direction component is taken for at least this share of the largest when it is inverted for box tests. Over
/// any distance it moves the ray by less than the slack of those tests, and keeps everything finite.
const LEAST_SHARE: f32 = 1e-12;

/// A ray ready for tests.
pub(crate) struct PreparedRay {
    pub org: Vec3,
    pub tnear: f32,
    pub tfar: f32,
    /// Inverse direction for box tests.
    pub inv_dir: [f32; 3],
    /// Whether it runs up each axis.
    pub forward: [bool; 3],
    /// The axes x, y, z of the sheared space, z being that along which the ray runs fastest: one more than the
    /// number of each, after a zero.
    pub order: [i32; 4],
    /// Origin along those axes.
    pub org_x: f32,
    pub org_y: f32,
    pub org_z: f32,
    /// Shear that turns the ray into the z axis (Woop, Benthin, Wald 2013).
    pub shear_x: f32,
    pub shear_y: f32,
    /// Direction along those axes.
    pub dir_x: f32,
    pub dir_y: f32,
    pub dir_z: f32,
}

impl PreparedRay {
    #[inline(always)]
    pub fn new(ray: &Ray) -> PreparedRay {
        let size = ray.dir.abs();
        let kz = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
        let least = size[kz] * LEAST_SHARE;
        let inverse = |d: f32| 1.0 / if d.abs() < least { least.copysign(d) } else { d };
        let inv_dir = [inverse(ray.dir.x), inverse(ray.dir.y), inverse(ray.dir.z)];
        PreparedRay {
            org: ray.org,
            tnear: ray.tnear,
            tfar: ray.tfar,
            inv_dir,
            forward: inv_dir.map(|d| d >= 0.0),
            order: [0, 1 + kx as i32, 1 + ky as i32, 1 + kz as i32],
            org_x: ray.org[kx],
            org_y: ray.org[ky],
            org_z: ray.org[kz],
            shear_x: ray.dir[kx] / ray.dir[kz],
            shear_y: ray.dir[ky] / ray.dir[kz],
            dir_x: ray.dir[kx],
            dir_y: ray.dir[ky],
            dir_z: ray.dir[kz],
        }
    }
}
