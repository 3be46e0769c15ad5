//! Solids as functions: the distance to the surface, negative inside. Most are near to the distance close to the
//! surface only, which is where it matters.

use glam::{DVec2, DVec3};

/// A solid.
pub trait Solid {
    /// About how far a point is outside, or inside if negative.
    fn distance(&self, p: DVec3) -> f64;
}

/// An ellipsoid along the axes.
pub fn ellipsoid(p: DVec3, center: DVec3, radii: DVec3) -> f64 {
    let q = (p - center) / radii;
    let [length, slope] = [q.length(), (q / radii).length()];
    if slope == 0.0 { -radii.min_element() } else { length * (length - 1.0) / slope }
}

/// An upright cylinder over an ellipse.
pub fn ellipse(p: DVec2, radii: DVec2) -> f64 {
    let q = p / radii;
    let [length, slope] = [q.length(), (q / radii).length()];
    if slope == 0.0 { -radii.min_element() } else { length * (length - 1.0) / slope }
}

/// A ball.
pub fn ball(p: DVec3, center: DVec3, radius: f64) -> f64 {
    p.distance(center) - radius
}

/// A limb between two points, with the radius at each of them.
pub fn limb(p: DVec3, [a, b]: [DVec3; 2], [from, to]: [f64; 2]) -> f64 {
    let axis = b - a;
    let along = ((p - a).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    p.distance(a + axis * along) - (from + (to - from) * along)
}

/// A box along the axes with rounded edges.
pub fn block(p: DVec3, center: DVec3, half: DVec3, rounding: f64) -> f64 {
    let q = (p - center).abs() - half + DVec3::splat(rounding);
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - rounding
}

/// Both solids, with a fillet of the size `k` between them.
pub fn join(a: f64, b: f64, k: f64) -> f64 {
    let near = (k - (a - b).abs()).max(0.0);
    a.min(b) - near * near / (4.0 * k)
}

/// `a` without `b`, the edge rounded by `k`.
pub fn cut(a: f64, b: f64, k: f64) -> f64 {
    -join(-a, b, k)
}

/// 0 up to `from`, 1 beyond `to`, smooth between.
pub fn step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances() {
        let p = DVec3::new(0.0, 3.0, 0.0);
        assert_eq!(ball(p, DVec3::ZERO, 1.0), 2.0);
        assert_eq!(ellipsoid(p, DVec3::ZERO, DVec3::new(5.0, 1.0, 2.0)), 2.0);
        assert_eq!(limb(p, [DVec3::X, DVec3::NEG_X], [1.0, 0.5]), 2.25);
        assert_eq!(block(p, DVec3::ZERO, DVec3::new(4.0, 1.0, 1.0), 0.2), 2.0);
        assert!(ellipsoid(DVec3::ZERO, DVec3::ZERO, DVec3::ONE) < 0.0);
    }

    #[test]
    fn joined_solids_have_more_where_both_are_near() {
        assert_eq!(join(1.0, 3.0, 0.5), 1.0);
        assert!(join(0.1, 0.1, 0.5) < 0.1 && cut(-1.0, -1.0, 0.5) > 0.0);
        assert_eq!((step(1.0, 2.0, 0.0), step(1.0, 2.0, 1.5), step(1.0, 2.0, 3.0)), (0.0, 0.5, 1.0));
    }
}
