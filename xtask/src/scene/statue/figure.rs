//! A standing figure in long clothes on a plinth, as a solid.

use super::cloth::Cloth;
use super::head::Head;
use super::pose::Pose;
use crate::scene::solid::{Solid, ball, block, ellipsoid, join, limb};
use glam::DVec3;

/// The middle of the head.
const HEAD: DVec3 = DVec3::new(0.0, 1.635, 0.015);
/// The box around figure and plinth.
pub const BOUNDS: [DVec3; 2] = [DVec3::new(-0.56, -0.27, -0.42), DVec3::new(0.56, 2.08, 0.42)];

/// The figure. Its feet are at height 0, and it looks along z.
pub struct Figure {
    pose: Pose,
    cloth: Cloth,
    head: Head,
}

impl Figure {
    /// In a pose.
    pub fn new(pose: Pose) -> Figure {
        Figure { pose, cloth: Cloth::new(pose.seed), head: Head::new(pose.seed, pose.beard) }
    }

    fn body(&self, p: DVec3) -> f64 {
        // The weight is on one leg: the hip goes to its side, the shoulders to the other.
        let q = p - DVec3::X * (self.pose.sway * bend(p.y));
        let mut body = join(self.cloth.distance(q), self.free_leg(q), 0.06);
        body = join(body, chest(q), 0.05);
        let neck = limb(q, [DVec3::new(0.0, 1.4, -0.015), DVec3::new(0.0, 1.6, 0.0)], [0.062, 0.054]);
        body = join(body, neck, 0.035);
        body = join(body, self.head.distance(self.turned(q - HEAD)), 0.012);
        let cloak = self.cloth.hanging(q, self.pose.left);
        body = join(body, cloak, 0.03);
        body = join(body, arm(q, DVec3::new(-0.17, 1.39, -0.01), self.pose.right), 0.025);
        join(body, arm(q, DVec3::new(0.17, 1.39, -0.01), self.pose.left), 0.025)
    }

    /// Seen from the head.
    fn turned(&self, p: DVec3) -> DVec3 {
        let sin = self.pose.head_turn;
        let cos = (1.0 - sin * sin).sqrt();
        // It bows a little.
        let p = DVec3::new(p.x * cos - p.z * sin, p.y, p.x * sin + p.z * cos);
        DVec3::new(p.x, p.y + 0.1 * p.z, p.z - 0.1 * p.y)
    }

    /// The leg that is set forward shows through the robe.
    fn free_leg(&self, p: DVec3) -> f64 {
        let [hip, knee, ankle] =
            [[-0.09, 0.92, 0.02], [-0.105, 0.53, 0.125], [-0.125, 0.08, 0.09]].map(DVec3::from_array);
        let leg = join(limb(p, [hip, knee], [0.1, 0.074]), limb(p, [knee, ankle], [0.07, 0.045]), 0.03);
        let toes = [-0.125, 0.085].map(|x| {
            let foot = [DVec3::new(x, 0.03, 0.14), DVec3::new(x * 1.25, 0.018, 0.265)];
            limb(p, foot, [0.045, 0.03])
        });
        leg.min(toes[0]).min(toes[1])
    }

    fn held(&self, p: DVec3) -> f64 {
        let mut held = f64::INFINITY;
        let q = p - DVec3::X * (self.pose.sway * bend(self.pose.right[1].y));
        if self.pose.staff {
            let [elbow, hand] = self.pose.right;
            let palm = hand + (hand - elbow).normalize_or(DVec3::Y) * 0.05 + DVec3::Z * 0.025;
            let ends = [DVec3::new(palm.x + 0.02, -0.05, palm.z), DVec3::new(palm.x, 1.93, palm.z)];
            let tip = ellipsoid(q, ends[1] + DVec3::Y * 0.05, DVec3::new(0.036, 0.1, 0.014));
            held = join(limb(q, ends, [0.017, 0.015]), tip, 0.01);
        }
        if self.pose.orb {
            let hand = self.pose.left[1];
            held = held.min(ball(q, hand + DVec3::new(0.0, 0.075, 0.05), 0.062));
        }
        held
    }
}

impl Solid for Figure {
    fn distance(&self, p: DVec3) -> f64 {
        let p = if self.pose.mirrored { DVec3::new(-p.x, p.y, p.z) } else { p };
        let standing = join(self.body(p), self.held(p), 0.008);
        join(standing, plinth(p), 0.015)
    }
}

/// -1 at the shoulders, 1 at the hip.
fn bend(y: f64) -> f64 {
    let t = (y - 0.9) / 0.9;
    1.0 - 1.6 * t * t
}

fn chest(p: DVec3) -> f64 {
    let shoulders = limb(p, [DVec3::new(-0.155, 1.4, -0.015), DVec3::new(0.155, 1.4, -0.015)], [0.062; 2]);
    let m = DVec3::new(p.x.abs(), p.y, p.z);
    join(shoulders, ellipsoid(m, DVec3::new(0.075, 1.27, 0.075), DVec3::new(0.068, 0.065, 0.055)), 0.04)
}

/// Upper arm, forearm, and a hand with fingers.
fn arm(p: DVec3, shoulder: DVec3, [elbow, hand]: [DVec3; 2]) -> f64 {
    let upper = limb(p, [shoulder, elbow], [0.062, 0.046]);
    let lower = limb(p, [elbow, hand], [0.046, 0.031]);
    let mut arm = join(upper, lower, 0.02);
    let along = (hand - elbow).normalize_or(DVec3::Z);
    let side = along.cross(DVec3::Y).try_normalize().unwrap_or(DVec3::X);
    let across = side.cross(along);
    let palm = hand + along * 0.045;
    arm = join(arm, limb(p, [palm - side * 0.016, palm + side * 0.016], [0.025; 2]), 0.02);
    for finger in 0..4 {
        let root = palm + along * 0.02 + side * (0.0165 * (f64::from(finger) - 1.5));
        let tip = root + along * 0.045 - across * 0.022;
        arm = join(arm, limb(p, [root, tip], [0.0105, 0.0085]), 0.005);
    }
    let thumb = [palm + side * 0.02, palm + side * 0.035 + along * 0.045 + across * 0.012];
    join(arm, limb(p, thumb, [0.013, 0.009]), 0.008)
}

/// A block with a molding.
fn plinth(p: DVec3) -> f64 {
    let foot = block(p, DVec3::new(0.0, -0.215, 0.0), DVec3::new(0.395, 0.04, 0.345), 0.012);
    let body = block(p, DVec3::new(0.0, -0.11, 0.0), DVec3::new(0.35, 0.1, 0.3), 0.008);
    let top = block(p, DVec3::new(0.0, -0.03, 0.0), DVec3::new(0.38, 0.026, 0.33), 0.018);
    join(join(foot, body, 0.03), top, 0.02)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_within_their_bounds() {
        let [low, high] = BOUNDS;
        for seed in 0..6 {
            let figure = Figure::new(Pose::new(seed));
            for i in 0..6000u32 {
                let mut at = [0, 1, 2].map(|axis| crate::scene::random::unit_of(&[u64::from(i), axis]));
                at[i as usize % 3] = f64::from(i / 3 % 2);
                let p = low + (high - low) * DVec3::from_array(at);
                assert!(figure.distance(p) > 0.0, "{seed} {p}");
            }
            assert!(figure.distance(DVec3::Y) < 0.0);
        }
    }
}
