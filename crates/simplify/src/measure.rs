//! How far two surfaces are apart: distances of points of one to the other, both ways.
//!
//! Points are spread evenly over the area, one in each stretch of equal area, and within triangles by a sequence of low
//! discrepancy: the same points every time.

use crate::closest::ClosestPoint;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Distances in scene units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// Mean over the area of both surfaces: half of the points are on each.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// The largest: about the Hausdorff distance.
    pub max: f64,
}

/// Points that a thread looks at in a row.
const RUN: usize = 4096;

/// Measures the distance between two meshes, each a list of positions and one of triangles, with `points` points on each
/// of both. It does not depend on the number of threads.
///
/// # Panics
/// If a mesh has no triangles or an index is out of range.
pub fn measure(a: (&[Vec3], &[[u32; 3]]), b: (&[Vec3], &[[u32; 3]]), points: usize) -> Distances {
    let sums = [(a, b), (b, a)].map(|(from, to)| one_way(from, to, points));
    let mean_of = |i: usize| (sums[0][i] + sums[1][i]) / (2 * points.max(1)) as f64;
    Distances { mean: mean_of(0), rms: mean_of(1).sqrt(), max: sums[0][2].max(sums[1][2]) }
}

/// Sum, sum of squares and maximum of the distances of points of `from` to `to`.
fn one_way(from: (&[Vec3], &[[u32; 3]]), to: (&[Vec3], &[[u32; 3]]), points: usize) -> [f64; 3] {
    let surface = Surface::of(from.0, from.1);
    let closest = ClosestPoint::of(to.0, to.1);
    let run = |run: usize| {
        let mut guess = 0;
        let mut sums = [0.0f64; 3];
        for i in run * RUN..points.min((run + 1) * RUN) {
            let nearest = closest.nearest(surface.point(i, points), guess);
            guess = nearest.triangle;
            let distance = nearest.distance_squared.sqrt();
            sums = [sums[0] + distance, sums[1] + nearest.distance_squared, sums[2].max(distance)];
        }
        sums
    };
    // Added in order, so that rounding does not depend on threads.
    let runs: Vec<[f64; 3]> = (0..points.div_ceil(RUN)).into_par_iter().map(run).collect();
    runs.into_iter().fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2].max(b[2])])
}

/// Triangles with the area up to the end of each.
struct Surface<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    area_until: Vec<f64>,
}

impl<'a> Surface<'a> {
    fn of(positions: &'a [Vec3], triangles: &'a [[u32; 3]]) -> Surface<'a> {
        let area_until = triangles.iter().scan(0.0, |sum, t| {
            let [a, b, c] = t.map(|v| positions[v as usize].as_dvec3());
            *sum += (b - a).cross(c - a).length();
            Some(*sum)
        });
        Surface { positions, triangles, area_until: area_until.collect() }
    }

    /// Point `i` of `count`.
    fn point(&self, i: usize, count: usize) -> DVec3 {
        let total = self.area_until.last().copied().unwrap_or(0.0);
        let area = (i as f64 + 0.5) / count as f64 * total;
        let triangle = self.area_until.partition_point(|&until| until <= area).min(self.triangles.len() - 1);
        let [a, b, c] = self.triangles[triangle].map(|v| self.positions[v as usize].as_dvec3());
        let (u, v) = plastic(i);
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + (b - a) * u + (c - a) * v
    }
}

/// Point `i` of the sequence of Roberts (2018, "The Unreasonable Effectiveness of Quasirandom Sequences") in the square.
fn plastic(i: usize) -> (f64, f64) {
    const G: f64 = 1.324_717_957_244_746;
    let i = i as f64;
    ((0.5 + i / G).fract(), (0.5 + i / (G * G)).fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parallel_squares_are_as_far_apart_as_their_planes() {
        let square = |z: f32| {
            vec![
                Vec3::new(0.0, 0.0, z),
                Vec3::new(1.0, 0.0, z),
                Vec3::new(1.0, 1.0, z),
                Vec3::new(0.0, 1.0, z),
            ]
        };
        let triangles = [[0, 1, 2], [0, 2, 3]];
        let distances = measure((&square(0.0), &triangles), (&square(0.25), &triangles), 10_000);
        assert!((distances.mean - 0.25).abs() < 1e-12 && (distances.rms - 0.25).abs() < 1e-12);
        assert_eq!(distances.max, 0.25);
        let half = measure((&square(0.0), &triangles), (&square(0.0), &triangles[..1]), 10_000);
        // Half of one square is up to half a diagonal away, the other half and all of the rest nothing.
        assert!((half.max - 0.5f64.sqrt()).abs() < 0.02, "{}", half.max);
        assert!((half.mean - 0.5f64.sqrt() / 12.0).abs() < 1e-3, "{}", half.mean);
    }
}
