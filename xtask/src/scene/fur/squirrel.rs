//! A squirrel that sits up and holds a nut, as a solid. Lengths are in meters; it looks along z.

use crate::scene::solid::{Solid, ball, ellipsoid, join, limb};
use glam::DVec3;

/// The box around it.
pub const BOUNDS: [DVec3; 2] = [DVec3::new(-0.08, -0.01, -0.18), DVec3::new(0.08, 0.28, 0.12)];
/// The bone of the tail, from the body to the tip.
pub const TAIL: [DVec3; 8] = [
    DVec3::new(0.0, 0.035, -0.045),
    DVec3::new(0.0, 0.026, -0.085),
    DVec3::new(0.0, 0.05, -0.12),
    DVec3::new(0.0, 0.095, -0.135),
    DVec3::new(0.0, 0.145, -0.132),
    DVec3::new(0.0, 0.19, -0.118),
    DVec3::new(0.0, 0.22, -0.125),
    DVec3::new(0.0, 0.232, -0.15),
];
const TAIL_RADIUS: f64 = 0.009;
/// Middles of the eyes of the right side and the left, and their radius.
pub const EYES: [DVec3; 2] = [DVec3::new(-0.0245, 0.199, 0.0585), DVec3::new(0.0245, 0.199, 0.0585)];
pub const EYE_RADIUS: f64 = 0.0062;
/// Middle and radius of the nose.
pub const NOSE: DVec3 = DVec3::new(0.0, 0.1795, 0.0965);
pub const NOSE_RADIUS: f64 = 0.0042;
/// Middle and radius of the nut.
pub const NUT: DVec3 = DVec3::new(0.0, 0.133, 0.088);
pub const NUT_RADIUS: f64 = 0.013;

/// The squirrel without its coat.
pub struct Squirrel;

impl Solid for Squirrel {
    fn distance(&self, p: DVec3) -> f64 {
        // Both sides are the same.
        let q = DVec3::new(p.x.abs(), p.y, p.z);
        let belly = ellipsoid(q, DVec3::new(0.0, 0.064, -0.008), DVec3::new(0.045, 0.06, 0.052));
        let chest = ellipsoid(q, DVec3::new(0.0, 0.124, 0.018), DVec3::new(0.034, 0.05, 0.036));
        let mut body = join(belly, chest, 0.03);
        let thigh = ellipsoid(q, DVec3::new(0.036, 0.046, 0.012), DVec3::new(0.02, 0.038, 0.042));
        body = join(body, thigh, 0.008);
        let foot = limb(q, [DVec3::new(0.036, 0.008, 0.02), DVec3::new(0.034, 0.007, 0.07)], [0.011, 0.0085]);
        body = join(body, foot, 0.008);
        let neck = limb(q, [DVec3::new(0.0, 0.14, 0.02), DVec3::new(0.0, 0.19, 0.04)], [0.028, 0.024]);
        body = join(body, neck, 0.02);
        body = join(body, head(q), 0.012);
        let [shoulder, elbow, hand] =
            [[0.026, 0.14, 0.034], [0.035, 0.112, 0.055], [0.0115, 0.131, 0.083]].map(DVec3::from_array);
        let arm = join(
            limb(q, [shoulder, elbow], [0.0125, 0.0095]),
            limb(q, [elbow, hand], [0.009, 0.0055]),
            0.006,
        );
        body = join(body, arm, 0.008);
        join(body, tail(p), 0.012)
    }
}

fn head(q: DVec3) -> f64 {
    let skull = ellipsoid(q, DVec3::new(0.0, 0.196, 0.045), DVec3::new(0.0275, 0.0265, 0.034));
    let snout = limb(q, [DVec3::new(0.0, 0.19, 0.064), DVec3::new(0.0, 0.1805, 0.089)], [0.018, 0.0085]);
    let cheek = ball(q, DVec3::new(0.014, 0.184, 0.065), 0.013);
    let ear = limb(q, [DVec3::new(0.017, 0.215, 0.032), DVec3::new(0.022, 0.238, 0.028)], [0.0085, 0.003]);
    join(join(join(skull, snout, 0.02), cheek, 0.012), ear, 0.006)
}

fn tail(p: DVec3) -> f64 {
    let part = |ends: &[DVec3]| limb(p, [ends[0], ends[1]], [TAIL_RADIUS; 2]);
    TAIL.windows(2).map(part).fold(f64::INFINITY, f64::min)
}

/// The place of the tail's bone that is nearest to a point: how far along the tail, from 0 to 1, how far away, and
/// where the bone leads there.
pub fn along_tail(p: DVec3) -> (f64, f64, DVec3) {
    let count = (TAIL.len() - 1) as f64;
    let place = |(i, ends): (usize, &[DVec3])| {
        let axis = ends[1] - ends[0];
        let share = ((p - ends[0]).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        ((i as f64 + share) / count, p.distance(ends[0] + axis * share), axis.normalize())
    };
    let nearest = |a: (f64, f64, DVec3), b: (f64, f64, DVec3)| if b.1 < a.1 { b } else { a };
    TAIL.windows(2).enumerate().map(place).fold((0.0, f64::INFINITY, DVec3::Y), nearest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_in_its_box_and_alike_on_both_sides() {
        let [low, high] = BOUNDS;
        let at = |x: f64, y: f64, z: f64| low + (high - low) * DVec3::new(x, y, z);
        for i in 0..=20 {
            for k in 0..=20 {
                let (u, v) = (f64::from(i) / 20.0, f64::from(k) / 20.0);
                for p in
                    [at(0.0, u, v), at(1.0, u, v), at(u, 0.0, v), at(u, 1.0, v), at(u, v, 0.0), at(u, v, 1.0)]
                {
                    assert!(Squirrel.distance(p) > 0.0, "{p}");
                }
                let p = at(u, v, 0.6);
                assert_eq!(Squirrel.distance(p), Squirrel.distance(p * DVec3::new(-1.0, 1.0, 1.0)));
            }
        }
        assert!(Squirrel.distance(DVec3::new(0.0, 0.06, 0.0)) < -0.03);
    }

    #[test]
    fn eyes_and_nose_show() {
        for (center, radius) in [(EYES[0], EYE_RADIUS), (EYES[1], EYE_RADIUS), (NOSE, NOSE_RADIUS)] {
            let outside = Squirrel.distance(center);
            assert!(outside > -radius && outside < radius, "{center}: {outside}");
        }
        assert!(Squirrel.distance(NUT) > 0.0 && Squirrel.distance(NUT) < NUT_RADIUS);
    }
}
