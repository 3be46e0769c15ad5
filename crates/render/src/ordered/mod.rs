//! Generations of rays, each sorted before it is traced: first the camera rays along a Z-curve over the picture, then all
//! rays that these brought about, then those that came of them (Moon et al. 2010, section 3). Generation, reordering
//! and processing are steps of their own.
//!
//! Where not all is in memory a ray first goes as far as what is there lets it, and waits for its turn with the place that
//! it has come to. The pages where it begins were just in use, and rays that hit near to each other come from everywhere: held
//! back at their beginnings, each would need those pages anew. Pages are read while rays go on that need others, and
//! there is no wait for the last rays of a generation: those of the next one that are there by then go on with them.

mod reader;
mod underway;
mod worker;

use crate::{
    hit_points::HitPoints,
    integrator::Shader,
    material::Materials,
    params::{RenderError, RenderParams},
    render::{Part, RenderOutput, Watch, take_number, with_shader},
    starts::Starts,
    unfinished::Unfinished,
    waiting_path::WaitingPath,
    wave::{Path as LightPath, PendingLight},
    world::World,
};
use bytemuck::{Pod, Zeroable};
use raystrips_geom::Ray;
use raystrips_reorder::{Curve, Keys, Ordering, RayStore, SortedRays};
use raystrips_tracer::Place;
use std::path::Path;
use std::sync::atomic::{self, AtomicBool, AtomicU64};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;
use worker::Worker;

/// In which order rays are traced.
#[derive(Clone, Copy)]
pub struct OrderParams<'a> {
    /// What they are placed by.
    pub ordering: Ordering,
    /// On which curve.
    pub curve: Curve,
    /// Memory for rays that wait.
    pub buffer_bytes: u64,
    /// Where rays go for which that is too little; `None`: paths are begun in such numbers that it is enough, where all is in
    /// memory.
    pub scratch: Option<&'a Path>,
    /// Finds where rays probably hit, for orderings that need that.
    pub hit_points: Option<&'a HitPoints>,
}

/// Renders a picture with rays in the given order, from where it was left until it is finished or `watch` wants a pause.
///
/// # Errors
/// Where the size, the samples or the camera are of no use, no threads can be started, the world cannot answer, or the
/// scratch folder is full.
pub fn render_ordered(
    world: &dyn World,
    params: &RenderParams,
    order: &OrderParams,
    begin: Unfinished,
    watch: &Watch,
) -> Result<Unfinished, RenderError> {
    with_shader(world, params, begin, watch, &|part| {
        let Part { params, shader, materials, begin, watch } = part;
        let temporary = std::env::temp_dir();
        let folder = order.scratch.unwrap_or(&temporary);
        let next = RayStore::new(folder, order.buffer_bytes as usize / STORES);
        let job = Job {
            world,
            params,
            shader,
            materials,
            starts: Starts::new(params),
            keys: Keys::new(order.ordering, order.curve, &world.bounds()),
            hit_points: order.hit_points.filter(|_| order.ordering.needs_hit_points()),
            folder,
            rays_underway: match world.pages_at_a_time() {
                Some(_) => PAGED_RAYS_UNDERWAY,
                None => WHOLE_RAYS_UNDERWAY,
            },
            next: Mutex::new(next),
            output: Mutex::new(begin.output),
            is_stopped: AtomicBool::new(false),
            watch,
        };
        let branches = shader.most_branches();
        let starts_at_a_time = match order.scratch {
            Some(_) => MOST_PATHS / branches as u64,
            None => {
                let path_bytes = branches * RAYS_A_BRANCH * RayStore::<Waiting>::RAY_BYTES;
                order.buffer_bytes / (STORES * path_bytes) as u64
            }
        };
        job.run(begin.next, starts_at_a_time)
    })
}

/// Bytes that each thread of [`render_ordered`] takes beside pages and waiting rays, at about. Pages make room for more
/// ([`PagedWorld::within`](crate::PagedWorld::within)).
pub const ORDERED_THREAD_BYTES: u64 = 14 << 20;

/// Most paths, with their branches, whose generations are traced one after the other; a pause has to wait for them.
const MOST_PATHS: u64 = 1 << 24;

/// Rays of a generation that a thread has under way at a time: those of which a page is read once for all that need it, or
/// what caches hold.
const PAGED_RAYS_UNDERWAY: usize = 1 << 15;
const WHOLE_RAYS_UNDERWAY: usize = 1 << 12;

/// Stores that have rays at a time: of the generation that is traced and of the next.
const STORES: usize = 2;
/// Rays that a path, or a branch of one, has in a generation at most where all is in memory: for lamps, lights without a
/// surface and the sky, and the one that goes on.
const RAYS_A_BRANCH: usize = 4;

/// A ray that waits, with its errand.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Waiting {
    ray: Ray,
    /// Of a shadow ray the pixel and the light are used.
    path: WaitingPath,
    is_shadow: u32,
    /// How far it has come.
    place: Place,
}

impl Waiting {
    /// A ray of a path, at its beginning.
    fn new(ray: Ray, path: &LightPath) -> Waiting {
        Waiting { ray, path: WaitingPath::new(path), is_shadow: 0, place: Place::BEGINNING }
    }

    /// A shadow ray, at its beginning.
    fn shadow(ray: Ray, light: PendingLight) -> Waiting {
        let PendingLight { pixel, contribution } = light;
        let path = WaitingPath { pixel, throughput: contribution, ..WaitingPath::zeroed() };
        Waiting { ray, path, is_shadow: 1, place: Place::BEGINNING }
    }
}

/// What all threads share.
struct Job<'a> {
    world: &'a dyn World,
    params: &'a RenderParams,
    shader: &'a dyn Shader,
    materials: &'a Materials,
    starts: Starts,
    keys: Keys,
    hit_points: Option<&'a HitPoints>,
    folder: &'a Path,
    /// Rays of a generation that a thread has under way at a time.
    rays_underway: usize,
    /// What the next generation is made of.
    next: Mutex<RayStore<Waiting>>,
    output: Mutex<RenderOutput>,
    is_stopped: AtomicBool,
    watch: &'a Watch<'a>,
}

impl Job<'_> {
    /// Renders from a batch of paths on, with about `most` paths at a time.
    fn run(self, first: u64, most: u64) -> Result<Unfinished, RenderError> {
        let begin = Instant::now();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.params.threads).build()?;
        let (next_start, count) = (AtomicU64::new(first.min(self.starts.count())), self.starts.count());
        let batches_at_a_time = (most / Starts::BATCH).max(1);
        let mut is_due = false;
        while next_start.load(atomic::Ordering::Relaxed) < count && !is_due {
            let end = next_start.load(atomic::Ordering::Relaxed).saturating_add(batches_at_a_time);
            let end = AtomicU64::new(end.min(count));
            self.with_workers(&pool, |worker| {
                while let Some(batch) = take_number(&next_start, &end) {
                    worker.start(batch)?;
                    if (self.watch.is_due)() {
                        end.store(0, atomic::Ordering::Relaxed);
                    }
                }
                Ok(())
            })?;
            is_due = end.into_inner() == 0;
            while let Some(generation) = self.take_generation_with(&pool)? {
                let generation = Mutex::new(generation);
                self.with_workers(&pool, |worker| worker.trace_generation(&generation))?;
            }
        }
        let mut output = self.output.into_inner().unwrap_or_else(PoisonError::into_inner);
        output.stats.seconds.total += begin.elapsed().as_secs_f64();
        let next = next_start.into_inner();
        Ok(Unfinished { output, next, is_finished: next == count })
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

    /// The rays that wait, sorted by all threads; `None` if there are none.
    fn take_generation_with(
        &self,
        pool: &rayon::ThreadPool,
    ) -> Result<Option<SortedRays<Waiting>>, RenderError> {
        let begin = Instant::now();
        let generation = pool.install(|| self.take_generation());
        let mut output = self.output.lock().unwrap_or_else(PoisonError::into_inner);
        output.stats.seconds.sort += begin.elapsed().as_secs_f64() * pool.current_num_threads() as f64;
        generation
    }

    /// The rays that wait, sorted; `None` if there are none.
    fn take_generation(&self) -> Result<Option<SortedRays<Waiting>>, RenderError> {
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        if next.is_empty() {
            return Ok(None);
        }
        next.take_sorted().map(Some).map_err(|e| self.scratch_error(e))
    }

    fn scratch_error(&self, source: std::io::Error) -> RenderError {
        RenderError::Scratch { folder: self.folder.to_owned(), source }
    }
}
