//! The clothes of a figure: a long pleated robe, and a cloak around it that is drawn from the right hip over the
//! left shoulder.
//!
//! Cloth lies around a body whose sections are ellipses. Folds are noise that is drawn out along them: its absolute
//! value has round backs with sharp valleys between, as cloth has.

use crate::scene::noise::Noise;
use crate::scene::solid::{ellipse, step};
use glam::{DVec2, DVec3};

/// Height and radii of the body with the robe, from the ground up.
const SECTIONS: [[f64; 3]; 11] = [
    [0.0, 0.265, 0.235],
    [0.1, 0.245, 0.215],
    [0.3, 0.22, 0.185],
    [0.55, 0.208, 0.172],
    [0.8, 0.205, 0.165],
    [0.95, 0.195, 0.15],
    [1.1, 0.155, 0.118],
    [1.25, 0.165, 0.128],
    [1.36, 0.17, 0.118],
    [1.43, 0.135, 0.09],
    [1.5, 0.06, 0.06],
];
/// How sharp valleys are.
const VALLEY: f64 = 0.04;
/// Clothes farther from a point than this do not matter to it.
const REACH: f64 = 0.12;

/// The clothes of a figure.
pub struct Cloth {
    noise: Noise,
}

impl Cloth {
    /// With folds of their own.
    pub fn new(seed: u64) -> Cloth {
        Cloth { noise: Noise::new(seed) }
    }

    /// The distance to the clothed body, without arms and legs.
    pub fn distance(&self, p: DVec3) -> f64 {
        let smooth = ellipse(DVec2::new(p.x, p.z), radii(p.y)).max(p.y - 1.48).max(-0.1 - p.y);
        if smooth.abs() > REACH { smooth } else { smooth * 0.85 - self.height(p) }
    }

    /// How far cloth is above the body.
    fn height(&self, p: DVec3) -> f64 {
        let warp = 0.05 * self.noise.at(p * 3.0);
        let below_border = 1.2 + 1.3 * p.x + warp - p.y;
        let above_hem = p.y - (0.42 + 0.5 * p.x + 0.4 * warp);
        let cloak = step(-0.012, 0.012, below_border) * step(-0.01, 0.01, above_hem);
        let roll = 1.0 - ((below_border - 0.045) / 0.055).abs().min(1.0);
        let roll =
            0.035 * step(0.0, 1.0, roll) * (1.0 + 0.8 * self.fold(p, DVec3::new(0.6, 0.8, 0.0), 16.0, 0.25));
        self.robe(p) * (1.0 - cloak) + cloak * (0.028 + self.cloak(p, below_border)) + roll
    }

    /// Upright pleats, deeper toward the ground, up to the neckline.
    fn robe(&self, p: DVec3) -> f64 {
        let depth = 0.007 + 0.024 * (1.0 - p.y).clamp(0.0, 1.0);
        let wide = self.fold(p, DVec3::Y, 12.0 + 12.0 * step(0.8, 1.1, p.y), 0.05);
        let below_neck = step(0.0, 0.02, 1.385 + 0.35 * p.x.abs() - 0.1 * p.z - p.y);
        below_neck * (0.006 + depth * (wide + 0.25 * self.fold(p + DVec3::ONE, DVec3::Y, 31.0, 0.05)))
    }

    /// Folds that fall from the shoulder, and further down from the hip.
    fn cloak(&self, p: DVec3, below_border: f64) -> f64 {
        let drawn = self.fold(p, DVec3::new(0.6, 0.8, 0.0), 9.5, 0.12);
        let falling = self.fold(p - DVec3::ONE, DVec3::new(-0.28, 0.96, 0.0), 9.0, 0.1);
        let lower = step(0.1, 0.5, below_border + 0.3 * p.z);
        let fine = self.fold(p + DVec3::ONE, DVec3::new(0.28, 0.96, 0.0), 24.0, 0.1);
        0.027 * step(-0.02, 0.15, below_border) * (drawn * (1.0 - lower) + falling * lower + 0.35 * fine)
    }

    /// Folds along a direction, so many a meter across; -0.3 to 1.
    fn fold(&self, p: DVec3, along: DVec3, per_meter: f64, drawn: f64) -> f64 {
        let across = p - along * (p.dot(along) * (1.0 - drawn));
        let noise = self.noise.at(across * per_meter);
        // Not quite sharp in the valleys, which triangles could not follow.
        2.4 * (noise * noise + VALLEY * VALLEY).sqrt() - 0.3
    }

    /// The end of the cloak that hangs from the left arm, between two points of it.
    pub fn hanging(&self, p: DVec3, [inner, outer]: [DVec3; 2]) -> f64 {
        let axis = (outer - inner) * DVec3::new(1.0, 0.0, 1.0);
        let along = ((p - inner).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        let sheet = inner + axis * along;
        let side = (p.x - sheet.x).abs().max((p.z - sheet.z).abs());
        let lowest = 0.5 + 0.22 * along + 0.05 * self.noise.at(p * DVec3::new(14.0, 0.0, 14.0));
        let smooth = side.max(lowest - p.y).max(p.y + 0.045 - inner.y.max(outer.y)) - 0.02;
        if smooth > REACH { smooth } else { 0.8 * smooth - 0.02 * self.fold(p, DVec3::Y, 15.0, 0.08) }
    }
}

/// Smooth between the sections.
fn radii(y: f64) -> DVec2 {
    let after = SECTIONS.iter().position(|section| section[0] > y).unwrap_or(SECTIONS.len() - 1).max(1);
    let section = |i: usize| SECTIONS[i.min(SECTIONS.len() - 1)];
    let [before, from, to, next] =
        [section(after.saturating_sub(2)), section(after - 1), section(after), section(after + 1)];
    let t = ((y - from[0]) / (to[0] - from[0])).clamp(0.0, 1.0);
    let along = |axis: usize| {
        let [begin, end] = [(to[axis] - before[axis]) / 2.0, (next[axis] - from[axis]) / 2.0];
        let [a, b] = [from[axis], to[axis]];
        let square = (3.0 * (b - a) - 2.0 * begin - end) * t * t;
        a + begin * t + square + (2.0 * (a - b) + begin + end) * t * t * t
    };
    DVec2::new(along(1), along(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_met_and_neighbors_alike() {
        assert_eq!(radii(0.3), DVec2::new(0.22, 0.185));
        let steps = (0..1500).map(|i| f64::from(i) * 0.001);
        assert!(steps.map(|y| radii(y).distance(radii(y + 0.001))).fold(0.0, f64::max) < 0.003);
    }

    #[test]
    fn cloth_is_around_the_body() {
        let cloth = Cloth::new(1);
        assert!(cloth.distance(DVec3::new(0.0, 0.7, 0.0)) < -0.1);
        assert!(cloth.distance(DVec3::new(0.35, 0.7, 0.0)) > 0.03);
    }
}
