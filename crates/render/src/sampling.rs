//! Warps of the unit square and multiple importance sampling.

use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

/// A direction of the hemisphere around the unit vector `n`, with density cos / π (Malley's method), and its
/// cosine with `n`.
pub(crate) fn cosine_hemisphere(n: Vec3, u: [f32; 2]) -> (Vec3, f32) {
    let [x, y] = concentric_disk(u);
    let cosine = (1.0 - x * x - y * y).max(0.0).sqrt();
    let (s, t) = n.any_orthonormal_pair();
    (s * x + t * y + n * cosine, cosine)
}

/// A uniform point of the unit disk; neighbors stay neighbors (Shirley and Chiu 1997).
fn concentric_disk(u: [f32; 2]) -> [f32; 2] {
    let [a, b] = u.map(|u| 2.0 * u - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    let (r, theta) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_2 - FRAC_PI_4 * (a / b)) };
    let (sin, cos) = libm::sincosf(theta);
    [r * cos, r * sin]
}

/// Weights of the second and third corner of a uniform point of a triangle (Heitz, "A Low-Distortion Map
/// Between Triangle and Square", 2019).
pub(crate) fn uniform_triangle([u, v]: [f32; 2]) -> [f32; 2] {
    if u < v { [0.5 * u, v - 0.5 * u] } else { [u - 0.5 * v, 0.5 * v] }
}

/// The weight of a sample of density `pdf` that another strategy takes with density `other` (Veach 1997, power
/// heuristic with exponent 2). Two weights of a sample add up to 1.
pub(crate) fn power_heuristic(pdf: f32, other: f32) -> f32 {
    // As a quotient, so that the squares of large densities do not overflow into NaN.
    let ratio = other / pdf;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::PathSampler;

    #[test]
    fn hemisphere_has_the_moments_of_a_cosine_lobe() {
        let n = Vec3::new(0.3, -0.8, 0.2).normalize();
        let (mut sum, mut sum_cosine_squared) = (Vec3::ZERO, 0.0);
        for i in 0..4096 {
            let (w, cosine) = cosine_hemisphere(n, PathSampler::new([0, 0], i, 0).get_2d(0));
            assert!((w.length() - 1.0).abs() < 1e-5 && (w.dot(n) - cosine).abs() < 1e-5);
            sum += w / 4096.0;
            sum_cosine_squared += cosine * cosine / 4096.0;
        }
        assert!((sum - n * (2.0 / 3.0)).length() < 1e-3, "{sum}");
        assert!((sum_cosine_squared - 0.5).abs() < 1e-3);
    }

    #[test]
    fn triangle_points_are_inside_with_the_right_mean() {
        let mut sum = [0.0; 2];
        for i in 0..4096 {
            let [b1, b2] = uniform_triangle(PathSampler::new([0, 0], i, 0).get_2d(0));
            assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0);
            sum = [sum[0] + b1 / 4096.0, sum[1] + b2 / 4096.0];
        }
        assert!(sum.iter().all(|mean| (mean - 1.0 / 3.0).abs() < 1e-3), "{sum:?}");
    }

    #[test]
    fn power_heuristic_sums_to_one_and_survives_extremes() {
        for (a, b) in [(1.0, 2.0), (1e30, 1e30), (1e-30, 1e30), (f32::MAX, 1.0), (3.0, 0.0)] {
            assert!((power_heuristic(a, b) + power_heuristic(b, a) - 1.0).abs() < 1e-6);
        }
        assert_eq!(power_heuristic(3.0, 0.0), 1.0);
        assert_eq!(power_heuristic(1.0, f32::INFINITY), 0.0);
    }
}
