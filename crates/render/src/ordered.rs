//! Generations of rays, each sorted before it is traced: first the camera rays along a Z-curve over the picture, then all
//! rays that these brought about, then those that came of them (Moon et al. 2010, section 3). Generation, reordering
//! and processing are steps of their own.

use crate::{
    camera::CameraRays,
    deposits::Deposits,
    film::Film,
    hit_points::HitPoints,
    integrator::Shader,
    interaction::SurfaceInteraction,
    material::Materials,
    params::{RenderError, RenderParams},
    render::{RenderOutput, RenderProgress, RenderStats, Setting, camera_rays},
    starts::{CameraPacket, Starts},
    waiting_path::WaitingPath,
    wave::{PendingLight, ShadeOutput, camera_path},
    world::{Surface, World},
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use raystrips_geom::{Hit, Ray};
use raystrips_reorder::{Curve, Keys, Ordering, RayStore, SortedRays};
use raystrips_tracer::OpenError;
use std::path::Path;
use std::sync::atomic::{self, AtomicBool, AtomicU64};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Rays that a thread takes at a time.
const BATCH_RAYS: usize = 4096;
/// Deposits that a worker gathers before it asks for the film.
const MOST_DEPOSITS: usize = 1 << 14;

/// In which order rays are traced.
#[derive(Clone, Copy)]
pub struct OrderParams<'a> {
    /// What they are placed by.
    pub ordering: Ordering,
    /// On which curve.
    pub curve: Curve,
    /// Memory for rays that wait.
    pub buffer_bytes: u64,
    /// Where rays go for which that is too little; `None`: paths are begun in such numbers that it is enough.
    pub scratch: Option<&'a Path>,
    /// Finds where rays probably hit, for orderings that need that.
    pub hit_points: Option<&'a HitPoints>,
}

/// Renders a picture with rays in the given order. `progress` is called now and then, by one thread at a time.
///
/// # Errors
/// Where the size, the samples or the camera are of no use, no threads can be started, the world cannot answer, or the
/// scratch folder is full.
pub fn render_ordered(
    world: &dyn World,
    params: &RenderParams,
    order: &OrderParams,
    progress: &(dyn Fn(RenderProgress) + Sync),
) -> Result<RenderOutput, RenderError> {
    let setting =
        Setting { description: world.description(), bounds: world.bounds(), emitters: world.emitters() };
    setting.run(params, |shader, materials| {
        let temporary = std::env::temp_dir();
        let folder = order.scratch.unwrap_or(&temporary);
        let next = RayStore::new(folder, order.buffer_bytes as usize / STORES);
        let film = Film::new(params.width, params.height, params.aovs);
        let job = Job {
            world,
            params,
            shader,
            materials,
            camera: camera_rays(params, world.description(), &world.bounds())?,
            starts: Starts::new(params),
            keys: Keys::new(order.ordering, order.curve, &world.bounds()),
            hit_points: order.hit_points.filter(|_| order.ordering.needs_hit_points()),
            folder,
            next: Mutex::new(next),
            output: Mutex::new(RenderOutput { film, stats: RenderStats::default() }),
            is_stopped: AtomicBool::new(false),
            progress,
        };
        let starts_at_a_time = match order.scratch {
            Some(_) => u64::MAX,
            None => order.buffer_bytes / (STORES * RAYS_A_PATH * RayStore::<Waiting>::RAY_BYTES) as u64,
        };
        job.run(starts_at_a_time)
    })
}

/// Stores that have rays at a time: of the generation that is traced and of the next.
const STORES: usize = 2;
/// Rays that a path has in a generation, at most.
const RAYS_A_PATH: usize = 3;

/// A ray that waits, with its errand.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Waiting {
    ray: Ray,
    /// Of a shadow ray the pixel and the light are used.
    path: WaitingPath,
    is_shadow: u32,
}

/// What all threads share.
struct Job<'a> {
    world: &'a dyn World,
    params: &'a RenderParams,
    shader: &'a dyn Shader,
    materials: &'a Materials,
    camera: CameraRays,
    starts: Starts,
    keys: Keys,
    hit_points: Option<&'a HitPoints>,
    folder: &'a Path,
    /// The next generation.
    next: Mutex<RayStore<Waiting>>,
    output: Mutex<RenderOutput>,
    is_stopped: AtomicBool,
    progress: &'a (dyn Fn(RenderProgress) + Sync),
}

impl Job<'_> {
    /// Renders all, with about `most` paths at a time.
    fn run(self, most: u64) -> Result<RenderOutput, RenderError> {
        let begin = Instant::now();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.params.threads).build()?;
        let next_start = AtomicU64::new(0);
        let batches_at_a_time = most.div_ceil(Starts::BATCH);
        while next_start.load(atomic::Ordering::Relaxed) < self.starts.count() {
            let end = next_start.load(atomic::Ordering::Relaxed).saturating_add(batches_at_a_time);
            let end = end.min(self.starts.count());
            self.with_workers(&pool, |worker| {
                while let Some(batch) = take_number(&next_start, end) {
                    worker.start(batch)?;
                }
                Ok(())
            })?;
            while let Some(generation) = self.take_generation(&pool)? {
                let generation = Mutex::new(generation);
                self.with_workers(&pool, |worker| worker.trace_generation(&generation))?;
            }
        }
        let mut output = self.output.into_inner().unwrap_or_else(PoisonError::into_inner);
        output.stats.seconds.total = begin.elapsed().as_secs_f64();
        Ok(output)
    }

    /// Lets all threads do something, until one fails.
    fn with_workers(
        &self,
        pool: &rayon::ThreadPool,
        work: impl Fn(&mut Worker) -> Result<(), RenderError> + Sync,
    ) -> Result<(), RenderError> {
        let outcomes = pool.broadcast(|_| {
            let mut worker = Worker::new(self);
            let outcome = work(&mut worker);
            worker.flush();
            outcome.inspect_err(|_| self.is_stopped.store(true, atomic::Ordering::Relaxed))
        });
        outcomes.into_iter().collect()
    }

    /// The rays that wait, sorted; `None` if there are none.
    fn take_generation(&self, pool: &rayon::ThreadPool) -> Result<Option<SortedRays<Waiting>>, RenderError> {
        let begin = Instant::now();
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        if next.is_empty() {
            return Ok(None);
        }
        let store = &mut *next;
        let sorted = pool.install(|| store.take_sorted()).map_err(|e| self.scratch_error(e))?;
        let mut output = self.output.lock().unwrap_or_else(PoisonError::into_inner);
        output.stats.seconds.sort += begin.elapsed().as_secs_f64() * pool.current_num_threads() as f64;
        Ok(Some(sorted))
    }

    fn scratch_error(&self, source: std::io::Error) -> RenderError {
        RenderError::Scratch { folder: self.folder.to_owned(), source }
    }
}

/// The next number below `end`.
fn take_number(next: &AtomicU64, end: u64) -> Option<u64> {
    next.try_update(atomic::Ordering::Relaxed, atomic::Ordering::Relaxed, |n| (n < end).then_some(n + 1)).ok()
}

/// A thread that traces and shades. The arrays are kept from batch to batch.
struct Worker<'a> {
    job: &'a Job<'a>,
    batch: Vec<Waiting>,
    rays: Vec<Ray>,
    paths: Vec<WaitingPath>,
    hits: Vec<Hit>,
    surfaces: Vec<Surface>,
    shadow_rays: Vec<Ray>,
    lights: Vec<PendingLight>,
    occluded: Vec<bool>,
    /// What shading asks for.
    next: Vec<Waiting>,
    next_rays: Vec<Ray>,
    points: Vec<Option<Vec3>>,
    deposits: Deposits,
    stats: RenderStats,
}

impl<'a> Worker<'a> {
    fn new(job: &'a Job<'a>) -> Worker<'a> {
        Worker {
            job,
            batch: Vec::new(),
            rays: Vec::new(),
            paths: Vec::new(),
            hits: Vec::new(),
            surfaces: Vec::new(),
            shadow_rays: Vec::new(),
            lights: Vec::new(),
            occluded: Vec::new(),
            next: Vec::new(),
            next_rays: Vec::new(),
            points: Vec::new(),
            deposits: Deposits::default(),
            stats: RenderStats::default(),
        }
    }

    /// Begins the paths of a batch and traces their camera rays.
    fn start(&mut self, batch: u64) -> Result<(), RenderError> {
        let job = self.job;
        if job.is_stopped.load(atomic::Ordering::Relaxed) {
            return Ok(());
        }
        let begin = Instant::now();
        (self.rays.clear(), self.paths.clear());
        for packet in job.starts.packets(batch) {
            self.generate(packet);
        }
        self.stats.primary += self.rays.len() as u64;
        self.stats.seconds.generate += begin.elapsed().as_secs_f64();
        self.find_hits(World::intersect_camera_batch)?;
        self.shade();
        self.hand_on()
    }

    fn generate(&mut self, packet: CameraPacket) {
        let Job { params, camera, starts, .. } = self.job;
        for ([x, y], sample) in starts.of_packet(packet) {
            let pixel = y * params.width + x;
            self.deposits.begin_sample(pixel);
            let (ray, path) = camera_path(params, camera, [x, y], sample, pixel);
            self.rays.push(ray);
            self.paths.push(WaitingPath::new(&path));
        }
    }

    /// Traces rays of a generation until none are left.
    fn trace_generation(&mut self, generation: &Mutex<SortedRays<Waiting>>) -> Result<(), RenderError> {
        let job = self.job;
        while !job.is_stopped.load(atomic::Ordering::Relaxed) {
            let begin = Instant::now();
            self.batch.clear();
            let mut rays = generation.lock().unwrap_or_else(PoisonError::into_inner);
            rays.next(BATCH_RAYS, &mut self.batch).map_err(|e| job.scratch_error(e))?;
            drop(rays);
            if self.batch.is_empty() {
                return Ok(());
            }
            self.divide();
            self.stats.seconds.sort += begin.elapsed().as_secs_f64();
            self.resolve_shadows()?;
            self.find_hits(World::intersect_batch)?;
            self.shade();
            self.hand_on()?;
        }
        Ok(())
    }

    /// Divides a batch into rays of the two kinds.
    fn divide(&mut self) {
        (self.rays.clear(), self.paths.clear(), self.shadow_rays.clear(), self.lights.clear());
        for &Waiting { ray, path, is_shadow } in &self.batch {
            if is_shadow != 0 {
                self.shadow_rays.push(ray);
                self.lights.push(PendingLight { pixel: path.pixel, contribution: path.throughput });
            } else {
                self.rays.push(ray);
                self.paths.push(path);
            }
        }
    }

    fn resolve_shadows(&mut self) -> Result<(), OpenError> {
        let begin = Instant::now();
        self.occluded.clear();
        self.occluded.resize(self.shadow_rays.len(), false);
        self.job.world.occluded_batch(&self.shadow_rays, &mut self.occluded)?;
        for (light, _) in self.lights.iter().zip(&self.occluded).filter(|&(_, &occluded)| !occluded) {
            self.deposits.add(light.pixel, light.contribution);
        }
        self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        Ok(())
    }

    fn find_hits(
        &mut self,
        intersect: fn(&(dyn World + 'a), &[Ray], &mut [Hit]) -> Result<(), OpenError>,
    ) -> Result<(), OpenError> {
        let begin = Instant::now();
        self.hits.clear();
        self.hits.resize(self.rays.len(), Hit::MISS);
        self.surfaces.resize(self.rays.len(), Surface::default());
        intersect(self.job.world, &self.rays, &mut self.hits)?;
        self.job.world.surface_batch(&self.hits, &mut self.surfaces)?;
        self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        Ok(())
    }

    /// Shades what rays hit.
    fn shade(&mut self) {
        let begin = Instant::now();
        let RenderParams { width, seed, .. } = *self.job.params;
        let answers = self.rays.iter().zip(&self.paths).zip(self.hits.iter().zip(&self.surfaces));
        let next = std::cell::RefCell::new(&mut self.next);
        let mut shadow = |ray, PendingLight { pixel, contribution }| {
            let path = WaitingPath { pixel, throughput: contribution, ..WaitingPath::zeroed() };
            next.borrow_mut().push(Waiting { ray, path, is_shadow: 1 });
        };
        let mut out = ShadeOutput { deposits: &mut self.deposits, shadow: &mut shadow };
        for ((ray, path), (hit, surface)) in answers {
            let mut path = path.path(width, seed);
            let hit = SurfaceInteraction::new(self.job.materials, ray, hit, surface);
            let goes_on = self.job.shader.shade(&mut path, ray, hit.as_ref(), &mut out);
            path.distance += hit.map_or(0.0, |hit| hit.distance);
            if let Some(ray) = goes_on {
                let path = WaitingPath::new(&path);
                next.borrow_mut().push(Waiting { ray, path, is_shadow: 0 });
            }
        }
        self.stats.seconds.shade += begin.elapsed().as_secs_f64();
    }

    /// Gives the rays that shading asked for to the next generation, with their keys. Those that cannot hit anything end
    /// here.
    fn hand_on(&mut self) -> Result<(), RenderError> {
        let job = self.job;
        let shadow = self.next.iter().map(|ray| u64::from(ray.is_shadow)).sum::<u64>();
        self.stats.shadow += shadow;
        self.stats.secondary += self.next.len() as u64 - shadow;
        if let Some(hit_points) = job.hit_points {
            let begin = Instant::now();
            self.next_rays.clear();
            self.next_rays.extend(self.next.iter().map(|waiting| waiting.ray));
            hit_points.find(&self.next_rays, &mut self.points);
            self.stats.seconds.approximate += begin.elapsed().as_secs_f64();
            self.end_those_that_miss();
        }
        let begin = Instant::now();
        let point = |i: usize| self.points.get(i).copied().flatten().unwrap_or_default();
        let keyed = self.next.iter().enumerate().map(|(i, next)| (job.keys.key(&next.ray, point(i)), *next));
        let keyed: Vec<(u64, Waiting)> = keyed.collect();
        let mut store = job.next.lock().unwrap_or_else(PoisonError::into_inner);
        store.extend(keyed.into_iter()).map_err(|e| job.scratch_error(e))?;
        drop(store);
        self.next.clear();
        self.points.clear();
        self.stats.seconds.sort += begin.elapsed().as_secs_f64();
        if self.deposits.len() > MOST_DEPOSITS {
            self.flush();
        }
        Ok(())
    }

    /// Ends rays without a hit point: they miss.
    fn end_those_that_miss(&mut self) {
        let RenderParams { width, seed, .. } = *self.job.params;
        let Worker { next, points, deposits, job, .. } = self;
        let mut place = 0;
        next.retain(|waiting| {
            place += 1;
            let can_hit = points[place - 1].is_some();
            if !can_hit && waiting.is_shadow != 0 {
                deposits.add(waiting.path.pixel, waiting.path.throughput);
            } else if !can_hit {
                let mut path = waiting.path.path(width, seed);
                let mut shadow = |_, _| unreachable!("nothing was hit");
                let mut out = ShadeOutput { deposits, shadow: &mut shadow };
                _ = job.shader.shade(&mut path, &waiting.ray, None, &mut out);
            }
            can_hit
        });
        points.retain(Option::is_some);
    }

    /// Puts what was gathered into the film.
    fn flush(&mut self) {
        let mut output = self.job.output.lock().unwrap_or_else(PoisonError::into_inner);
        self.deposits.flush(&mut output.film);
        output.stats.add(&std::mem::take(&mut self.stats));
        let RenderStats { primary, shadow, secondary, .. } = output.stats;
        let samples_total = u64::from(self.job.params.width)
            * u64::from(self.job.params.height)
            * u64::from(self.job.params.spp);
        (self.job.progress)(RenderProgress {
            samples_done: primary,
            samples_total,
            rays: primary + shadow + secondary,
        });
    }
}
