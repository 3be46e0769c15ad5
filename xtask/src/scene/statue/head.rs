//! The head of a figure: skull, face, hair, and a wreath around it. It looks along z, the ears being at height 0.

use crate::scene::noise::Noise;
use crate::scene::solid::{ball, cut, ellipsoid, join, limb, step};
use glam::{DVec2, DVec3};

/// Everything is nearer to the middle of the head than this.
pub const RADIUS: f64 = 0.21;

/// The head.
pub struct Head {
    noise: Noise,
    beard: bool,
}

impl Head {
    /// With hair of its own.
    pub fn new(seed: u64, beard: bool) -> Head {
        Head { noise: Noise::new(seed ^ 0xEA), beard }
    }

    /// The distance to the head.
    pub fn distance(&self, p: DVec3) -> f64 {
        let far = p.length() - RADIUS;
        if far > 0.08 {
            return far;
        }
        let mut head = face(p);
        head = join(head, self.hair(p), 0.006);
        if self.beard {
            head = join(head, self.beard(p), 0.008);
        }
        join(head, self.wreath(p), 0.004)
    }

    /// Strands that run back from the brow, and a knot or curls at the neck.
    fn hair(&self, p: DVec3) -> f64 {
        let cap = ellipsoid(p, DVec3::new(0.0, 0.032, -0.02), DVec3::new(0.088, 0.1, 0.106));
        let face = limb(p, [DVec3::new(0.0, -0.05, 0.1), DVec3::new(0.0, 0.015, 0.115)], [0.085, 0.068]);
        let nape = -0.055 - p.y + 0.4 * p.z;
        let cap = cut(cap, face, 0.012).max(nape);
        let knot = ball(p, DVec3::new(0.0, 0.02, -0.128), if self.beard { 0.0 } else { 0.045 });
        let strands = self.noise.at(DVec3::new(p.x * 60.0, p.y * 34.0 + p.z * 8.0, p.z * 22.0)).abs();
        join(cap, knot, 0.02) - 0.012 * strands
    }

    fn beard(&self, p: DVec3) -> f64 {
        let chin = ellipsoid(p, DVec3::new(0.0, -0.1, 0.052), DVec3::new(0.052, 0.062, 0.042));
        let cheeks = ellipsoid(p, DVec3::new(0.0, -0.07, 0.03), DVec3::new(0.068, 0.045, 0.05));
        let mouth = ball(p, DVec3::new(0.0, -0.062, 0.12), 0.026);
        let curls = self.noise.at(p * DVec3::new(55.0, 34.0, 55.0)).abs();
        cut(join(chin, cheeks, 0.03), mouth, 0.01) - 0.014 * curls
    }

    /// Leaves around the head, along a tilted ring.
    fn wreath(&self, p: DVec3) -> f64 {
        let q = DVec3::new(p.x, p.y - 0.05 - 0.25 * p.z, p.z + 0.012);
        let around = DVec2::new(q.x / 0.092, q.z / 0.108);
        let ring = DVec2::new((around.length() - 1.0) * 0.1, q.y).length();
        let leaves = self.noise.at(p * 48.0);
        ring - 0.009 - 0.016 * step(-0.25, 0.3, leaves)
    }
}

/// Skull and face.
fn face(p: DVec3) -> f64 {
    // Both sides are alike.
    let m = DVec3::new(p.x.abs(), p.y, p.z);
    let skull = ellipsoid(p, DVec3::new(0.0, 0.03, -0.008), DVec3::new(0.076, 0.092, 0.096));
    let jaw = ellipsoid(p, DVec3::new(0.0, -0.05, 0.03), DVec3::new(0.056, 0.068, 0.062));
    let mut face = join(skull, jaw, 0.035);
    face = join(face, ball(m, DVec3::new(0.04, -0.022, 0.055), 0.024), 0.025);
    face = join(face, ball(p, DVec3::new(0.0, -0.102, 0.075), 0.016), 0.025);
    let brow = limb(m, [DVec3::new(0.008, 0.03, 0.087), DVec3::new(0.05, 0.028, 0.066)], [0.009, 0.007]);
    face = join(face, brow, 0.016);
    face = cut(face, ball(m, DVec3::new(0.032, 0.008, 0.1), 0.0185), 0.012);
    face = join(face, ellipsoid(m, DVec3::new(0.031, 0.008, 0.074), DVec3::new(0.016, 0.011, 0.0135)), 0.002);
    let lid = limb(m, [DVec3::new(0.018, 0.014, 0.083), DVec3::new(0.045, 0.013, 0.073)], [0.004, 0.003]);
    face = join(face, lid, 0.004);
    let nose = limb(p, [DVec3::new(0.0, 0.024, 0.088), DVec3::new(0.0, -0.024, 0.112)], [0.007, 0.0115]);
    let wing = ball(m, DVec3::new(0.011, -0.028, 0.099), 0.0075);
    face = join(face, join(nose, wing, 0.008), 0.01);
    face = join(face, mouth(m), 0.006);
    join(face, ellipsoid(m, DVec3::new(0.08, -0.005, -0.005), DVec3::new(0.009, 0.03, 0.018)), 0.008)
}

fn mouth(m: DVec3) -> f64 {
    let upper = limb(m, [DVec3::new(0.004, -0.053, 0.094), DVec3::new(0.024, -0.057, 0.082)], [0.006, 0.003]);
    let lower = limb(m, [DVec3::new(0.0, -0.066, 0.091), DVec3::new(0.02, -0.061, 0.082)], [0.0075, 0.003]);
    upper.min(lower)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_is_within_the_radius() {
        for head in [Head::new(1, true), Head::new(2, false)] {
            let around = (0..4000).map(f64::from).map(|i| {
                let (sin, cos) = libm::sincos(i * 2.4);
                let y = i / 2000.0 - 1.0;
                let across = (1.0 - y * y).sqrt();
                DVec3::new(cos * across, y, sin * across)
            });
            assert!(around.map(|d| head.distance(d * (RADIUS - 0.01))).all(|d| d > 0.0));
            assert!(head.distance(DVec3::ZERO) < 0.0);
        }
    }
}
