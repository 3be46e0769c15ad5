//! A frame of reference for boxes: where most strands of hair run one way, boxes along that way overlap much less than
//! boxes along the axes of the scene (compare Woop, Benthin, Wald, Johnson, Tabellion 2014, "Exploiting Local Orientation
//! Similarity for Efficient Ray Traversal of Hair and Fur").

use crate::Aabb;
use glam::{DQuat, DVec3, Vec3};

/// Axes that are turned, around a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// What is zero.
    pub origin: Vec3,
    /// The turn from the axes of the scene to those of the frame: a quaternion x, y, z, w.
    pub turn: [f32; 4],
}

impl Frame {
    /// The frame around `origin` whose z axis runs along `direction`, a unit vector.
    pub fn along(origin: Vec3, direction: Vec3) -> Frame {
        // In doubles: near -Z the real part of the quaternion is what is left of 1 - 1, and floats would leave noise.
        let turn = DQuat::from_rotation_arc(direction.as_dvec3().normalize(), DVec3::Z).normalize();
        Frame { origin, turn: turn.as_quat().to_array() }
    }

    /// The axes of the frame, as the scene sees them.
    #[inline(always)]
    pub fn axes(&self) -> [Vec3; 3] {
        // The rows of the rotation matrix of a quaternion.
        let [x, y, z, w] = self.turn;
        let (xx, yy, zz) = (x * x, y * y, z * z);
        [
            Vec3::new(1.0 - 2.0 * (yy + zz), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            Vec3::new(2.0 * (x * y + w * z), 1.0 - 2.0 * (xx + zz), 2.0 * (y * z - w * x)),
            Vec3::new(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (xx + yy)),
        ]
    }

    /// A direction, seen from the frame.
    #[inline(always)]
    pub fn turned(&self, direction: Vec3) -> Vec3 {
        let [x, y, z] = self.axes();
        Vec3::new(x.dot(direction), y.dot(direction), z.dot(direction))
    }

    /// Box around a ball, seen from the frame, rounded outward.
    #[inline]
    pub fn ball_bounds(&self, center: Vec3, radius: f32) -> Aabb {
        let away = center.as_dvec3() - self.origin.as_dvec3();
        let place = DVec3::from_array(self.axes().map(|axis| axis.as_dvec3().dot(away)));
        let radius = f64::from(radius) * (1.0 + f64::from(f32::EPSILON));
        let corner =
            |sign: f64, round: fn(f32) -> f32| (place + sign * radius).as_vec3().to_array().map(round);
        Aabb {
            min: Vec3::from_array(corner(-1.0, f32::next_down)),
            max: Vec3::from_array(corner(1.0, f32::next_up)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn axes_are_at_right_angles_and_the_last_one_runs_along(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0, flat in 0..6) {
            // Flattened, so that some directions are nearly along the axis, or against it.
            let flat = 0.1f32.powi(flat);
            let Some(direction) = Vec3::new(x * flat, y * flat, z).try_normalize() else { return Ok(()) };
            let frame = Frame::along(Vec3::ONE, direction);
            let axes = frame.axes();
            for (i, a) in axes.iter().enumerate() {
                for (k, b) in axes.iter().enumerate() {
                    prop_assert!((a.dot(*b) - f32::from(u8::from(i == k))).abs() < 2e-6);
                }
            }
            prop_assert!((frame.turned(direction) - Vec3::Z).length() < 2e-6);
            let ball = frame.ball_bounds(Vec3::ONE + direction * 3.0, 0.5);
            prop_assert!((ball.center() - Vec3::Z * 3.0).length() < 1e-5 && ball.extent().min_element() >= 1.0);
        }
    }
}
