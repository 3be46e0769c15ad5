//! How a figure stands.

use crate::scene::random::Random;
use glam::DVec3;

/// Poses that are told apart.
pub const POSES: u64 = 3;

/// All that figures differ in. Lengths are in meters, of a figure of 1.8 m; its left is at positive x.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Decides folds and hair.
    pub seed: u64,
    /// Left and right are changed.
    pub mirrored: bool,
    /// How far the hip is to the side.
    pub sway: f64,
    /// Sine of the angle by which the head is turned to its left.
    pub head_turn: f64,
    /// Elbow and hand of the right arm.
    pub right: [DVec3; 2],
    /// Elbow and hand of the left arm, over which the cloak hangs.
    pub left: [DVec3; 2],
    /// There is a staff in the right hand.
    pub staff: bool,
    /// There is a ball in the left hand.
    pub orb: bool,
    /// A beard instead of a knot of hair.
    pub beard: bool,
}

impl Pose {
    /// One of the poses for each three numbers, always with other folds.
    pub fn new(seed: u64) -> Pose {
        let mut random = Random::new(&[seed, 0x57A7]);
        let sway = random.between(0.02, 0.045);
        let left = [DVec3::new(0.275, 1.1, -0.03), DVec3::new(0.2, 1.09, 0.21)];
        let across = DVec3::new(-0.02, 1.27, 0.175);
        let common = Pose {
            seed,
            mirrored: false,
            sway,
            head_turn: random.between(0.25, 0.45),
            right: [DVec3::new(-0.29, 1.12, -0.02), across],
            left,
            staff: false,
            orb: true,
            beard: false,
        };
        match seed % POSES {
            1 => Pose {
                right: [DVec3::new(-0.37, 1.27, 0.02), DVec3::new(-0.31, 1.48, 0.14)],
                staff: true,
                orb: false,
                beard: true,
                ..common
            },
            2 => Pose { mirrored: true, ..common },
            _ => Pose {
                right: [DVec3::new(-0.29, 1.12, -0.05), DVec3::new(-0.27, 0.89, 0.09)],
                head_turn: -common.head_turn,
                ..common
            },
        }
    }
}
