//! The coat: what hair grows where.

use super::squirrel::{EYE_RADIUS, EYES, NOSE, NOSE_RADIUS, NUT, NUT_RADIUS, along_tail};
use crate::scene::noise::Noise;
use crate::scene::random::Random;
use crate::scene::solid::step;
use glam::{DVec3, Vec3};

/// Segments of a strand.
pub const SEGMENTS: usize = 8;
/// Points of a strand.
pub const POINTS: usize = SEGMENTS + 1;
/// Radius of a strand at its root, in meters, and of the tip as a share of that.
const RADIUS: f64 = 1.5e-5;
const TIP: f64 = 0.25;
/// With fewer strands than this they are thicker, so that as much is covered.
const FULL: f64 = 32e6;
/// Thicker than this it is no hair any more.
const MOST_RADIUS: f64 = 2e-4;

/// Colors of hair, by number.
pub const COLORS: [&str; 2] = ["red", "white"];
const RED: usize = 0;
const WHITE: usize = 1;

/// How hair grows at a place.
#[derive(Clone, Copy, Debug)]
pub struct Growth {
    /// Strands on an area, in those of the back.
    pub density: f64,
    /// In meters.
    length: f64,
    /// How far it stands off: 0 flat, 1 upright.
    lift: f64,
    /// Along the skin, where it is combed to.
    comb: DVec3,
    /// Number of its color.
    pub color: usize,
}

/// The coat of one animal.
pub struct Coat {
    clumps: Noise,
    waves: Noise,
    seed: u64,
}

impl Coat {
    pub fn new(seed: u64) -> Coat {
        Coat { clumps: Noise::new(seed ^ 0xC0A7), waves: Noise::new(seed ^ 0x3A7E), seed }
    }

    /// How hair grows at a point of the skin with this normal.
    pub fn growth(&self, p: DVec3, normal: DVec3) -> Growth {
        let (place, from_bone, bone) = along_tail(p);
        let tail = 1.0 - step(0.011, 0.02, from_bone);
        let tail = tail * step(0.02, 0.1, place);
        // Front and inner sides are white.
        let front = step(0.2, 0.75, normal.z) * step(0.025, 0.05, p.y) * (1.0 - step(0.165, 0.18, p.y));
        let inside = step(0.006, 0.03, 0.045 - p.x.abs());
        let is_white = tail < 0.5 && front * inside + 0.25 * self.waves.at(p * 120.0) > 0.45;
        let head = step(0.16, 0.185, p.y) * (1.0 - tail);
        let snout = step(0.066, 0.09, p.z) * head;
        let ear = step(0.222, 0.236, p.y) * (1.0 - tail);
        let limbs = 1.0 - step(0.012, 0.03, p.y);
        let body = mix(0.012, 0.0065, head);
        let length = mix(body, 0.0022, snout.max(limbs));
        let length = mix(mix(length, 0.012, ear), 0.034 - 0.008 * (1.0 - place), tail);
        let lift = mix(mix(0.32, 0.55, ear), 0.62, tail);
        // From the nose backwards and down the body; along the tail to its tip.
        let down = DVec3::new(0.0, -1.0 + 0.7 * head, -0.55 - 0.6 * head);
        let along = mix_vectors(down, DVec3::Y, ear * 0.8);
        let along = mix_vectors(along, bone, tail);
        let comb = (along - normal * along.dot(normal)).normalize_or(normal.any_orthonormal_vector());
        let bare = [(EYES[0], EYE_RADIUS), (EYES[1], EYE_RADIUS), (NOSE, NOSE_RADIUS), (NUT, NUT_RADIUS)];
        let is_bare = bare.iter().any(|&(center, radius)| p.distance(center) < 1.2 * radius);
        Growth {
            density: if is_bare { 0.0 } else { mix(1.0, 1.6, tail) },
            length,
            lift,
            comb,
            color: if is_white { WHITE } else { RED },
        }
    }

    /// The points of strand `number`, which grows at a root.
    pub fn strand(&self, number: u64, root: DVec3, normal: DVec3, growth: &Growth) -> [Vec3; POINTS] {
        let mut random = Random::new(&[self.seed, number]);
        // Strands of a clump bend to the same side and meet at their tips.
        let clump = |k: f64| {
            let q = root * 350.0 + DVec3::splat(17.3 * k);
            DVec3::new(
                self.clumps.at(q),
                self.clumps.at(q + DVec3::X * 31.7),
                self.clumps.at(q + DVec3::Y * 47.1),
            )
        };
        let jitter =
            DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        let lift = (growth.lift + 0.12 * random.between(-1.0, 1.0)).clamp(0.05, 0.95);
        let out = (normal * lift + growth.comb * (1.0 - lift) + jitter * 0.1).normalize();
        let length = growth.length * random.between(0.7, 1.05);
        let bend = (growth.comb * 0.5 + clump(0.0) * 0.9 + DVec3::NEG_Y * 0.12) * length;
        std::array::from_fn(|k| {
            let s = k as f64 / SEGMENTS as f64;
            (root + out * (length * s) + bend * (s * s * 0.55)).as_vec3()
        })
    }

    /// Width of strand `number` of `count` at point `k`.
    pub fn width(&self, number: u64, count: u64, k: usize) -> f32 {
        let thick = (RADIUS * (FULL / count as f64).sqrt().max(1.0)).min(MOST_RADIUS);
        let own = Random::new(&[self.seed, number, 2]).between(0.75, 1.25);
        let s = k as f64 / SEGMENTS as f64;
        (2.0 * thick * own * mix(1.0, TIP, s * s)) as f32
    }
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}

fn mix_vectors(a: DVec3, b: DVec3, share: f64) -> DVec3 {
    a + (b - a) * share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strands_grow_out_of_the_skin() {
        let coat = Coat::new(1);
        let back = DVec3::new(0.0, 0.08, -0.06);
        let growth = coat.growth(back, DVec3::NEG_Z);
        assert_eq!(growth.color, RED);
        for number in 0..100 {
            let points = coat.strand(number, back, DVec3::NEG_Z, &growth);
            assert_eq!(points[0], back.as_vec3());
            let tip = points[SEGMENTS].as_dvec3() - back;
            assert!(tip.z < 0.0 && tip.y < 0.0 && (0.004..0.03).contains(&tip.length()), "{tip}");
        }
        assert_eq!(coat.growth(DVec3::new(0.0, 0.12, 0.054), DVec3::Z).color, WHITE);
        assert_eq!(coat.growth(NOSE, DVec3::Z).density, 0.0);
    }

    #[test]
    fn fewer_strands_are_thicker() {
        let coat = Coat::new(1);
        assert!(coat.width(5, 1_000_000, 0) > 4.0 * coat.width(5, 32_000_000, 0));
        assert!(coat.width(5, 1000, 0) < 2.6 * MOST_RADIUS as f32);
        assert!(coat.width(5, 1000, SEGMENTS) < coat.width(5, 1000, 0));
    }
}
