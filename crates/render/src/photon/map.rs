//! Photons by place: a balanced tree over them, and the light of those that are nearest to a point.

use super::packed::{Photon, SharedExponent};
use glam::Vec3;
use rayon::{join, prelude::*};
use std::collections::BinaryHeap;
use std::f32::consts::PI;

/// Below this many photons a branch is not worth a thread.
const PARALLEL_MIN: usize = 8192;
/// Photons on surfaces turned by more than the angle of this cosine do not count.
const LEAST_NORMAL_COSINE: f32 = 0.8;
/// Distances along the normal count as if they were longer by the root of one more than this: photons of another surface
/// close by do not count as those of this one.
const FLATNESS: f32 = 15.0;

/// Photons as a balanced tree: the middle one of a range divides it along its axis (Bentley 1975).
pub(super) struct PhotonMap {
    photons: Vec<Photon>,
    /// What the power of a photon is multiplied by.
    scale: f32,
    /// Irradiance at each photon, if it was found.
    irradiance: Vec<SharedExponent>,
}

/// A point whose light is asked for.
pub(super) struct Query {
    pub p: Vec3,
    pub n: Vec3,
    /// Photons of an estimate.
    pub nearest: u32,
    /// Those farther away do not count.
    pub most_radius: f32,
}

/// The nearest photons so far: squared distances, as bits, which ascend as they do, and places in the tree.
struct Found {
    heap: BinaryHeap<(u32, u32)>,
    most: usize,
    /// Squared distance beyond which nothing counts.
    limit: f32,
}

impl PhotonMap {
    /// Puts photons into a tree. Each has `scale` of its power.
    pub fn new(mut photons: Vec<Photon>, scale: f32) -> PhotonMap {
        divide(&mut photons);
        PhotonMap { photons, scale, irradiance: Vec::new() }
    }

    /// Bytes of memory that it takes.
    pub fn bytes(&self) -> u64 {
        let PhotonMap { photons, irradiance, .. } = self;
        (photons.capacity() * size_of::<Photon>() + irradiance.capacity() * size_of::<SharedExponent>())
            as u64
    }

    /// Finds the irradiance at each photon, so that it need not be estimated anew for each ray that comes near (Christensen
    /// 1999, "Faster photon map global illumination").
    pub fn with_irradiance(mut self, nearest: u32, most_radius: f32) -> PhotonMap {
        let at = |photon: &Photon| {
            let query = Query { p: photon.p, n: photon.n(), nearest, most_radius };
            SharedExponent::new(self.estimate(&query, |_| Vec3::ONE), 0.5)
        };
        self.irradiance = self.photons.par_iter().map(at).collect();
        self
    }

    /// The irradiance at the photon that is nearest to a point, or none where all are too far away.
    pub fn irradiance(&self, query: &Query) -> Vec3 {
        let limit = query.most_radius * query.most_radius;
        let mut found = Found { heap: BinaryHeap::with_capacity(2), most: 1, limit };
        self.search(&self.photons, 0, query, &mut found);
        found.heap.peek().map_or(Vec3::ZERO, |nearest| self.irradiance[nearest.1 as usize].get())
    }

    /// Light that leaves towards a viewer of the photons nearest to a point: `reflected` tells what of light from a direction
    /// does. The power of all but the farthest is spread over the disc that this one is at the rim of.
    pub fn estimate(&self, query: &Query, reflected: impl Fn(Vec3) -> Vec3) -> Vec3 {
        let most = query.nearest as usize + 1;
        let limit = query.most_radius * query.most_radius;
        let mut found = Found { heap: BinaryHeap::with_capacity(most + 1), most, limit };
        self.search(&self.photons, 0, query, &mut found);
        if found.heap.len() == most {
            found.heap.pop();
        }
        let mut nearest = found.heap.into_vec();
        nearest.sort_unstable();
        let light = nearest.iter().map(|&(_, place)| {
            let photon = &self.photons[place as usize];
            reflected(photon.from()) * photon.power()
        });
        light.sum::<Vec3>() * (self.scale / (PI * found.limit))
    }

    /// Looks for photons among some, the first of which is at place `first`.
    fn search(&self, photons: &[Photon], first: usize, query: &Query, found: &mut Found) {
        if photons.is_empty() {
            return;
        }
        let middle = photons.len() / 2;
        let photon = &photons[middle];
        let away = query.p - photon.p;
        let along = away[photon.axis as usize];
        let halves = [(&photons[..middle], first), (&photons[middle + 1..], first + middle + 1)];
        let near = usize::from(along > 0.0);
        self.search(halves[near].0, halves[near].1, query, found);
        let out_of_plane = away.dot(query.n);
        let distance = away.length_squared() + FLATNESS * out_of_plane * out_of_plane;
        if distance < found.limit && photon.n().dot(query.n) > LEAST_NORMAL_COSINE {
            found.add(distance, (first + middle) as u32);
        }
        if along * along < found.limit {
            self.search(halves[1 - near].0, halves[1 - near].1, query, found);
        }
    }
}

impl Found {
    fn add(&mut self, distance: f32, place: u32) {
        self.heap.push((distance.to_bits(), place));
        if self.heap.len() > self.most {
            self.heap.pop();
        }
        if self.heap.len() == self.most {
            self.limit = self.heap.peek().map_or(self.limit, |farthest| f32::from_bits(farthest.0));
        }
    }
}

/// Puts the middle one of some photons along the longest side of their box into the middle, and so on in both halves.
fn divide(photons: &mut [Photon]) {
    if photons.len() < 2 {
        return;
    }
    let bounds =
        |f: fn(Vec3, Vec3) -> Vec3| photons.iter().map(|photon| photon.p).reduce(f).unwrap_or(Vec3::ZERO);
    let extent = bounds(Vec3::max) - bounds(Vec3::min);
    let axis = extent.max_position();
    let middle = photons.len() / 2;
    photons.select_nth_unstable_by(middle, |a, b| a.p[axis].total_cmp(&b.p[axis]));
    photons[middle].axis = axis as u32;
    let (left, rest) = photons.split_at_mut(middle);
    let right = &mut rest[1..];
    if left.len() > PARALLEL_MIN {
        join(|| divide(left), || divide(right));
    } else {
        divide(left);
        divide(right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::PathSampler;

    /// Photons spread evenly over the unit square, of power 1 together.
    fn square(count: u32) -> Vec<Photon> {
        let place = |i| PathSampler::new([0, 0], i, 0).get_2d(0);
        (0..count)
            .map(|i| {
                Photon::new(Vec3::new(place(i)[0], 0.0, place(i)[1]), Vec3::Y, Vec3::Y, Vec3::splat(1.0))
            })
            .collect()
    }

    #[test]
    fn even_photons_give_their_density() {
        let map = PhotonMap::new(square(1 << 14), 1.0 / (1 << 14) as f32);
        for (x, z) in [(0.5, 0.5), (0.3, 0.7), (0.21, 0.4)] {
            let query = Query { p: Vec3::new(x, 0.0, z), n: Vec3::Y, nearest: 200, most_radius: 1.0 };
            let light = map.estimate(&query, |_| Vec3::ONE);
            assert!((light.x - 1.0).abs() < 0.05, "{light}");
            // From the other side, and where photons are too far away, there is nothing.
            assert_eq!(map.estimate(&Query { n: -Vec3::Y, ..query }, |_| Vec3::ONE), Vec3::ZERO);
            let above = Query { p: Vec3::new(x, 0.6, z), n: Vec3::Y, nearest: 200, most_radius: 0.5 };
            assert_eq!(map.estimate(&above, |_| Vec3::ONE), Vec3::ZERO);
        }
    }

    #[test]
    fn the_nearest_are_those_that_a_look_at_all_finds() {
        let photons = square(3000);
        let map = PhotonMap::new(photons.clone(), 1.0);
        for i in 0..50 {
            let [x, z] = PathSampler::new([1, 1], i, 0).get_2d(0);
            let query = Query { p: Vec3::new(x, 0.0, z), n: Vec3::Y, nearest: 20, most_radius: 1.0 };
            let mut distances: Vec<f32> = photons.iter().map(|q| (query.p - q.p).length_squared()).collect();
            distances.sort_by(f32::total_cmp);
            let expected = 20.0 / (PI * distances[20]);
            let light = map.estimate(&query, |_| Vec3::ONE);
            assert!((light.x / expected - 1.0).abs() < 1e-3, "{light} {expected}");
        }
    }
}
