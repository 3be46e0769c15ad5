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
    /// The same in f64, and the inverse of the direction along z.
    pub exact_shear_x: f64,
    pub exact_shear_y: f64,
    pub exact_inverse_z: f64,
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
        let exact_inverse_z = 1.0 / f64::from(ray.dir[kz]);
        let exact_shear_x = f64::from(ray.dir[kx]) * exact_inverse_z;
        let exact_shear_y = f64::from(ray.dir[ky]) * exact_inverse_z;
        PreparedRay {
            org: ray.org,
            tnear: ray.tnear,
            tfar: ray.tfar,
            inv_dir,
            forward: [inv_dir[0] >= 0.0, inv_dir[1] >= 0.0, inv_dir[2] >= 0.0],
            order: [0, 1 + kx as i32, 1 + ky as i32, 1 + kz as i32],
            org_x: ray.org[kx],
            org_y: ray.org[ky],
            org_z: ray.org[kz],
            shear_x: exact_shear_x as f32,
            shear_y: exact_shear_y as f32,
            exact_shear_x,
            exact_shear_y,
            exact_inverse_z,
        }
    }
}
