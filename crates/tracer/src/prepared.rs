//! What all tests of one ray share, computed once.

use glam::{DVec3, Vec3};
use raystrips_geom::Ray;

/// A direction component is taken for at least this share of the largest when it is inverted for box tests. Over
/// any distance it moves the ray by less than the slack of those tests, and keeps everything finite.
const LEAST_SHARE: f32 = 1e-12;

/// A ray ready for tests.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedRay {
    /// Origin and inverse direction for box tests.
    pub org: [f32; 4],
    pub inv_dir: [f32; 4],
    pub tnear: f32,
    pub tfar: f32,
    /// The axes x, y, z of the sheared space, z being that along which the ray runs fastest.
    pub axes: [u32; 3],
    /// Origin along those axes.
    pub org_sheared: [f32; 3],
    /// Shear of x and y that turns the ray into the z axis (Woop, Benthin, Wald 2013).
    pub shear: [f32; 2],
    /// The same in f64, and the inverse of the direction along z.
    pub exact_shear: [f64; 2],
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
        let exact_inverse_z = 1.0 / f64::from(ray.dir[kz]);
        let exact_shear =
            [f64::from(ray.dir[kx]) * exact_inverse_z, f64::from(ray.dir[ky]) * exact_inverse_z];
        PreparedRay {
            org: [ray.org.x, ray.org.y, ray.org.z, 0.0],
            inv_dir: inverse_direction(ray.dir),
            tnear: ray.tnear,
            tfar: ray.tfar,
            axes: [kx as u32, ky as u32, kz as u32],
            org_sheared: [ray.org[kx], ray.org[ky], ray.org[kz]],
            shear: [exact_shear[0] as f32, exact_shear[1] as f32],
            exact_shear,
            exact_inverse_z,
        }
    }

    /// Direction.
    pub fn direction(&self) -> DVec3 {
        let z = 1.0 / self.exact_inverse_z;
        let mut dir = [0.0; 3];
        for (axis, along) in self.axes.into_iter().zip([self.exact_shear[0] * z, self.exact_shear[1] * z, z])
        {
            dir[axis as usize % 3] = along;
        }
        DVec3::from_array(dir)
    }
}

/// The inverse of a direction for box tests: finite.
#[inline(always)]
pub(crate) fn inverse_direction(dir: Vec3) -> [f32; 4] {
    let least = dir.abs().max_element() * LEAST_SHARE;
    let inverse = |d: f32| 1.0 / if d.abs() < least { least.copysign(d) } else { d };
    [inverse(dir.x), inverse(dir.y), inverse(dir.z), 0.0]
}
