//! Photons on their way: a path from a light that leaves a photon wherever it lands.

use super::emission::{Emission, Numbers};
use super::map::PhotonMap;
use super::packed::Photon;
use crate::{
    bsdf::Bsdf,
    integrator::{MAX_PASSED, Shader},
    interaction::SurfaceInteraction,
    sampler::PathSampler,
    wave::{Path, ShadeOutput},
};
use glam::Vec3;
use raystrips_geom::Ray;
use std::sync::{Mutex, PoisonError};

/// Bytes of a photon and its number until the map is made.
pub(super) const KEPT_BYTES: u64 = size_of::<Landed>() as u64;

/// Photons are put into one of so many lists, so that threads seldom wait for each other.
const LISTS: u32 = 64;

/// Sends out photons and keeps those that land.
pub(super) struct PhotonTracer<'a> {
    emission: Emission<'a>,
    seed: u64,
    max_bounces: u32,
    landed: Vec<Mutex<Vec<Landed>>>,
}

/// A photon where it landed.
struct Landed {
    /// Which photon, and the how many surface it is: by these they are sorted, so that the order in which threads work
    /// changes nothing.
    number: [u32; 3],
    /// It came from a light through glass or by mirrors alone, be they glossy.
    is_caustic: bool,
    /// It may be reflected twice more: here, and where a path gathers it.
    is_global: bool,
    photon: Photon,
}

/// Photons by where they landed.
pub(super) struct PhotonMaps {
    /// All but those of so many bounces that a path that gathers would be too long with them.
    pub global: PhotonMap,
    /// Those that came from a light through glass or by mirrors alone, be they glossy.
    pub caustic: PhotonMap,
}

/// Pairs of random numbers: those of the beginning, then those of each segment.
const CHOICE: u32 = 0;
const PLACE: u32 = 1;
const DIRECTION: u32 = 2;
const SEGMENTS: u32 = 3;
const PAIRS_A_SEGMENT: u32 = 3;

impl<'a> PhotonTracer<'a> {
    pub fn new(emission: Emission<'a>, seed: u64, max_bounces: u32) -> PhotonTracer<'a> {
        PhotonTracer { emission, seed, max_bounces, landed: (0..LISTS).map(|_| Mutex::default()).collect() }
    }

    /// Maps of what landed. Each photon has `scale` of its power. Estimates are made from so many photons within a radius.
    pub fn into_maps(self, scale: f32, (nearest, most_radius): (u32, f32)) -> PhotonMaps {
        let lists =
            self.landed.into_iter().map(|list| list.into_inner().unwrap_or_else(PoisonError::into_inner));
        let mut landed: Vec<Landed> = lists.flatten().collect();
        landed.sort_unstable_by_key(|landed| landed.number);
        let those = |is_one: fn(&Landed) -> bool| {
            landed.iter().filter(|landed| is_one(landed)).map(|landed| landed.photon).collect()
        };
        let (caustic, global) = (those(|landed| landed.is_caustic), those(|landed| landed.is_global));
        drop(landed);
        PhotonMaps {
            global: PhotonMap::new(global, scale).with_irradiance(nearest, most_radius),
            caustic: PhotonMap::new(caustic, scale),
        }
    }

    fn keep(&self, path: &Path, ray: &Ray, hit: &SurfaceInteraction) {
        let from = -ray.dir.normalize();
        // Paths decide by chance again whether a partly opaque surface is met: the light on it is told, not the share that
        // landed.
        let power = path.throughput / hit.alpha;
        let landed = Landed {
            number: [path.pixel, path.sampler.sample_index(), path.segment],
            is_caustic: path.bounces > 0 && path.scatter_pdf.is_none(),
            is_global: path.bounces + 2 <= self.max_bounces,
            photon: Photon::new(hit.point.p, hit.n, from, power),
        };
        let list = &self.landed[(path.sampler.sample_index() % LISTS) as usize];
        list.lock().unwrap_or_else(PoisonError::into_inner).push(landed);
    }

    /// The ray with which a photon goes on, unless it ends here: by chance, so that those that go on have about the same
    /// power.
    fn scatter(&self, path: &mut Path, hit: &SurfaceInteraction, bsdf: &Bsdf) -> Option<Ray> {
        let numbers = |i: u32| path.sampler.get_2d(SEGMENTS + path.segment * PAIRS_A_SEGMENT + i);
        let [choice, survival] = numbers(1);
        let scattered = bsdf.sample(numbers(0), choice)?;
        if !hit.leaves(scattered.wi, scattered.is_transmitted) {
            return None;
        }
        let kept = scattered.weight.max_element().min(1.0);
        if survival >= kept {
            return None;
        }
        path.throughput *= scattered.weight / kept;
        path.bounces += 1;
        path.medium = hit.medium_after(path.medium, scattered.is_transmitted);
        // What left a diffuse surface is no caustic photon any more. By glossy ones it stays one: paths that gather do not
        // look for lamps there.
        path.scatter_pdf = path.scatter_pdf.or(scattered.pdf.filter(|_| bsdf.is_diffuse()));
        Some(hit.spawn(scattered.wi, scattered.is_transmitted))
    }
}

impl Shader for PhotonTracer<'_> {
    fn begin(&self, at: [u32; 2], sample_index: u32, pixel: u32) -> (Ray, Path) {
        let sampler = PathSampler::new(at, sample_index, self.seed);
        let [choice, place, direction] = [CHOICE, PLACE, DIRECTION].map(|pair| sampler.get_2d(pair));
        let photon = self.emission.photon(&Numbers { choice, place, direction });
        // One that goes nowhere is traced and ends at once.
        let (ray, power) = photon.unwrap_or((Ray::new(Vec3::ZERO, Vec3::Y), Vec3::ZERO));
        (ray, Path::new(pixel, sampler, power))
    }

    fn shade(
        &self,
        path: &mut Path,
        ray: &Ray,
        hit: Option<&SurfaceInteraction>,
        _out: &mut ShadeOutput,
    ) -> Option<Ray> {
        let hit = hit.filter(|_| path.throughput != Vec3::ZERO)?;
        path.throughput *= hit.transmittance();
        let numbers = path.sampler.get_2d(SEGMENTS + path.segment * PAIRS_A_SEGMENT + 2);
        let next = if numbers[0] >= hit.alpha {
            path.passed += 1;
            (path.passed <= MAX_PASSED).then(|| hit.spawn(ray.dir, true))
        } else {
            let bsdf = Bsdf::new(&hit.material, hit.shading_n, hit.front, ray.dir);
            if bsdf.is_diffuse() && !hit.is_strand {
                self.keep(path, ray, hit);
            }
            // Where it lands it is reflected once more, to the camera.
            if path.bounces + 1 < self.max_bounces { self.scatter(path, hit, &bsdf) } else { None }
        };
        path.segment += 1;
        next
    }
}
