//! How far two surfaces are apart: distances of points of one to the other, both ways. [`measure`] does that for meshes
//! in memory; [`Surface`], [`ClosestPoint`] and [`Tally`] are what it is made of.
//!
//! Points are spread evenly over the area, one in each stretch of equal area, and within triangles by a sequence of low
//! discrepancy: the same points every time.

use crate::closest::ClosestPoint;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::ops::Range;

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
    let mut tally = Tally::default();
    for (from, to) in [(a, b), (b, a)] {
        let surface = Surface::of(from.0, from.1);
        let closest = ClosestPoint::of(to.0, to.1);
        tally.add(&distances(&closest, 0..points, |i| surface.point(i, surface.stratum(i, points))));
    }
    tally.distances()
}

/// The distances to the nearest of some triangles of the points `range`. It does not depend on the number of threads.
pub fn distances(
    closest: &ClosestPoint,
    range: Range<usize>,
    point: impl Fn(usize) -> DVec3 + Sync,
) -> Tally {
    let run = |run: usize| {
        let mut guess = 0;
        let mut tally = Tally::default();
        let begin = range.start + run * RUN;
        for i in begin..range.end.min(begin + RUN) {
            let nearest = closest.nearest(point(i), guess);
            guess = nearest.triangle;
            tally.push(nearest.distance_squared);
        }
        tally
    };
    // Added in order, so that rounding does not depend on threads.
    let runs: Vec<Tally> = (0..range.len().div_ceil(RUN)).into_par_iter().map(run).collect();
    let mut tally = Tally::default();
    runs.iter().for_each(|run| tally.add(run));
    tally
}

/// Distances, added up.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    count: usize,
    sum: f64,
    sum_of_squares: f64,
    max: f64,
}

impl Tally {
    /// Adds a distance, given squared.
    pub fn push(&mut self, distance_squared: f64) {
        let distance = distance_squared.sqrt();
        self.count += 1;
        self.sum += distance;
        self.sum_of_squares += distance_squared;
        self.max = self.max.max(distance);
    }

    /// Adds all distances of another.
    pub fn add(&mut self, other: &Tally) {
        self.count += other.count;
        self.sum += other.sum;
        self.sum_of_squares += other.sum_of_squares;
        self.max = self.max.max(other.max);
    }

    /// What they come to.
    pub fn distances(&self) -> Distances {
        let mean_of = |sum: f64| sum / self.count.max(1) as f64;
        Distances { mean: mean_of(self.sum), rms: mean_of(self.sum_of_squares).sqrt(), max: self.max }
    }
}

/// Triangles with the area up to the end of each.
pub struct Surface<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    area_until: Vec<f64>,
}

impl<'a> Surface<'a> {
    /// The surface of a mesh.
    pub fn of(positions: &'a [Vec3], triangles: &'a [[u32; 3]]) -> Surface<'a> {
        let area_until = triangles.iter().scan(0.0, |sum, t| {
            let [a, b, c] = t.map(|v| positions[v as usize].as_dvec3());
            *sum += (b - a).cross(c - a).length() / 2.0;
            Some(*sum)
        });
        Surface { positions, triangles, area_until: area_until.collect() }
    }

    /// Area in squared scene units.
    pub fn area(&self) -> f64 {
        self.area_until.last().copied().unwrap_or(0.0)
    }

    /// Area before point `i` of `count` that are spread evenly.
    pub fn stratum(&self, i: usize, count: usize) -> f64 {
        (i as f64 + 0.5) / count as f64 * self.area()
    }

    /// Point `i`, on the triangle with so much area before it.
    ///
    /// # Panics
    /// If there are no triangles.
    pub fn point(&self, i: usize, area: f64) -> DVec3 {
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
