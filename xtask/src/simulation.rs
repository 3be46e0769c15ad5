//! A world that simulates caches with what its rays read.

use crate::cache::{Cache, PageCache, Shape};
use raystrips_geom::{Aabb, Hit, Ray, scene::SceneDesc};
use raystrips_render::{Emitter, Surface, TracedWorld, World};
use raystrips_tracer::{Access, OpenError, Part, Tracer};
use std::sync::{Mutex, PoisonError};

/// Counts for each part of a pack.
pub type ByPart = [u64; Part::ALL.len()];

/// A world all of whose rays are traced one by one, in the order in which they are asked for. What is read for shading is
/// left out.
pub struct SimulatedWorld {
    world: TracedWorld,
    simulation: Mutex<Simulation>,
}

/// Caches beside each other: each sees all that is read.
pub struct Simulation {
    caches: Vec<Cache>,
    /// By cache.
    misses: Vec<ByPart>,
    pages: Vec<Pages>,
    /// Where pages begin in the file, and their bytes, as they lie there.
    directory: Vec<(u64, u64)>,
    steps: Steps,
    /// Rays so far.
    pub rays: u64,
}

/// A cache of pages and what it missed.
struct Pages {
    cache: PageCache,
    misses: u64,
    bytes: u64,
}

/// From one read in a page to the next, whichever ray it is of.
#[derive(Default)]
struct Steps {
    last: Option<(u64, usize)>,
    count: u64,
    log_distances: f64,
    page_switches: u64,
}

impl Steps {
    fn add(&mut self, place: u64, page: usize) {
        if let Some((last_place, last_page)) = self.last.replace((place, page)) {
            self.count += 1;
            self.log_distances += ((place.abs_diff(last_place) + 1) as f64).log2();
            self.page_switches += u64::from(page != last_page);
        }
    }
}

/// What caches are simulated.
pub struct Caches<'a> {
    /// Of blocks.
    pub blocks: &'a [Shape],
    /// Of pages: the part of all pages that each holds.
    pub page_shares: &'a [f64],
}

impl Simulation {
    fn new(world: &TracedWorld, caches: &Caches) -> Simulation {
        let directory = world.scene().pack().directory.iter();
        let mut directory: Vec<_> = directory.map(|page| (page.offset, u64::from(page.bytes))).collect();
        directory.sort_unstable();
        let all = directory.iter().map(|(_, bytes)| bytes).sum::<u64>() as f64;
        let pages = |&share: &f64| Pages { cache: PageCache::new((all * share) as u64), misses: 0, bytes: 0 };
        Simulation {
            caches: caches.blocks.iter().map(|&shape| Cache::new(shape)).collect(),
            misses: vec![ByPart::default(); caches.blocks.len()],
            pages: caches.page_shares.iter().map(pages).collect(),
            directory,
            steps: Steps::default(),
            rays: 0,
        }
    }

    fn read(&mut self, access: Access) {
        let part = access.part as usize;
        for (cache, misses) in self.caches.iter_mut().zip(&mut self.misses) {
            misses[part] += cache.read(access.place, access.bytes);
        }
        if access.part == Part::Upper {
            return;
        }
        let page = self.directory.partition_point(|&(begin, _)| begin <= access.place) - 1;
        self.steps.add(access.place, page);
        let (_, bytes) = self.directory[page];
        for pages in &mut self.pages {
            if pages.cache.read(page, bytes) {
                pages.misses += 1;
                pages.bytes += bytes;
            }
        }
    }

    /// Misses of cache `i` of blocks for each ray, by part.
    pub fn misses_a_ray(&self, i: usize) -> [f64; Part::ALL.len()] {
        self.misses[i].map(|misses| misses as f64 / self.rays as f64)
    }

    /// The mean of log2 of the bytes from one read in a page to the next: what cache-oblivious layouts make small.
    pub fn mean_log_distance(&self) -> f64 {
        self.steps.log_distances / self.steps.count.max(1) as f64
    }

    /// How often a ray goes on in another page than that of the read before.
    pub fn page_switches_a_ray(&self) -> f64 {
        self.steps.page_switches as f64 / self.rays as f64
    }

    /// Pages and bytes that cache `i` of pages had to bring for each ray.
    pub fn pages_a_ray(&self, i: usize) -> (f64, f64) {
        let Pages { misses, bytes, .. } = self.pages[i];
        (misses as f64 / self.rays as f64, bytes as f64 / self.rays as f64)
    }
}

impl SimulatedWorld {
    /// Empty caches under `world`.
    pub fn new(world: TracedWorld, caches: &Caches) -> SimulatedWorld {
        let simulation = Mutex::new(Simulation::new(&world, caches));
        SimulatedWorld { world, simulation }
    }

    /// What came of it.
    pub fn into_simulation(self) -> Simulation {
        self.simulation.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls `trace` with what is to be told of every read.
    fn observe(&self, rays: usize, trace: impl FnOnce(&mut Tracer, &mut dyn FnMut(Access))) {
        let mut simulation = self.simulation.lock().unwrap_or_else(PoisonError::into_inner);
        simulation.rays += rays as u64;
        trace(&mut Tracer::new(self.world.scene()), &mut |access| simulation.read(access));
    }
}

impl World for SimulatedWorld {
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError> {
        self.observe(rays.len(), |tracer, observer| {
            let pairs = rays.iter().zip(hits);
            pairs.for_each(|(ray, hit)| *hit = tracer.intersect_observed(ray, observer));
        });
        Ok(())
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) -> Result<(), OpenError> {
        self.observe(rays.len(), |tracer, observer| {
            let pairs = rays.iter().zip(occluded);
            pairs.for_each(|(ray, occluded)| *occluded = tracer.occluded_observed(ray, observer));
        });
        Ok(())
    }

    fn surface_batch(&self, hits: &[Hit], surfaces: &mut [Surface]) -> Result<(), OpenError> {
        self.world.surface_batch(hits, surfaces)
    }

    fn bounds(&self) -> Aabb {
        self.world.bounds()
    }

    fn description(&self) -> &SceneDesc {
        self.world.description()
    }

    fn emitters(&self) -> &[Emitter] {
        self.world.emitters()
    }
}
