//! A world that simulates caches with what its rays read.

use crate::cache::{Cache, Shape};
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
    /// Rays so far.
    pub rays: u64,
    pub dir: Vec<(u64, u64)>,
    pub pcaches: Vec<(f64, PageLru)>,
    pub paged: Vec<(f64, (u64, u64))>,
    /// Reads so far.
    pub reads: ByPart,
}

impl Simulation {
    /// Empty caches of these shapes.
    pub fn new(shapes: &[Shape]) -> Simulation {
        Simulation {
            caches: shapes.iter().map(|&shape| Cache::new(shape)).collect(),
            misses: vec![ByPart::default(); shapes.len()],
            rays: 0,
            dir: vec![],
            pcaches: vec![],
            paged: vec![],
            reads: ByPart::default(),
        }
    }

    fn read(&mut self, access: Access) {
        let part = access.part as usize;
        self.reads[part] += 1;
        if access.place < 1 << 48 {
            let p = self.dir.partition_point(|d| d.0 <= access.place) - 1;
            let bytes = self.dir[p].1;
            for ((_, c), (_, r)) in self.pcaches.iter_mut().zip(&mut self.paged) {
                if c.touch(p as u64, bytes) {
                    r.0 += 1;
                    r.1 += bytes;
                }
            }
        }
        for (cache, misses) in self.caches.iter_mut().zip(&mut self.misses) {
            misses[part] += cache.read(access.place, access.bytes);
        }
    }

    /// Misses of cache `i` so far, by part.
    pub fn misses(&self, i: usize) -> ByPart {
        self.misses[i]
    }

    /// Misses of cache `i` for each ray.
    pub fn misses_a_ray(&self, i: usize) -> f64 {
        self.misses[i].iter().sum::<u64>() as f64 / self.rays as f64
    }
}

impl SimulatedWorld {
    /// Caches of these shapes under `world`.
    pub fn new(world: TracedWorld, shapes: &[Shape]) -> SimulatedWorld {
        let mut sim = Simulation::new(shapes);
        sim.dir = world.scene().pack().directory.iter().map(|e| (e.offset, e.bytes as u64)).collect();
        let total: u64 = sim.dir.iter().map(|d| d.1).sum();
        for share in [0.5, 0.25, 0.1] {
            sim.pcaches.push((
                share,
                PageLru {
                    cap: (total as f64 * share) as u64,
                    used: 0,
                    clock: 0,
                    at: Default::default(),
                    by: Default::default(),
                },
            ));
            sim.paged.push((share, (0, 0)));
        }
        SimulatedWorld { world, simulation: Mutex::new(sim) }
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

pub struct PageLru {
    cap: u64,
    used: u64,
    clock: u64,
    at: std::collections::HashMap<u64, u64>,
    by: std::collections::BTreeMap<u64, (u64, u64)>,
}
impl PageLru {
    fn touch(&mut self, p: u64, bytes: u64) -> bool {
        self.clock += 1;
        if let Some(t) = self.at.insert(p, self.clock) {
            if let Some(v) = self.by.remove(&t) {
                self.by.insert(self.clock, v);
            }
            return false;
        }
        self.by.insert(self.clock, (p, bytes));
        self.used += bytes;
        while self.used > self.cap {
            let (_, (q, b)) = self.by.pop_first().unwrap();
            self.at.remove(&q);
            self.used -= b;
        }
        true
    }
}
