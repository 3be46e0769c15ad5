//! Pictures of scenes that are larger than memory: paths wait for pages in queues, and are shaded and go on in whatever
//! order pages come. Every random number and every sum is independent of that order, so the picture is the one that
//! [`render`](crate::render()) makes.

use crate::{
    camera::CameraRays,
    deposits::Deposits,
    film::Film,
    integrator::Shader,
    interaction::SurfaceInteraction,
    material::Materials,
    params::{RenderError, RenderParams},
    render::{RenderOutput, RenderProgress, RenderStats, Setting, camera_rays},
    traced::{PagedWorld, surface_of},
    wave::{Path, PendingLight, ShadeOutput, TILE_EXTENT, Tile, camera_path},
};
use raystrips_geom::{Hit, Ray};
use raystrips_reorder::{PageQueues, Parcel, Work};
use raystrips_tracer::{
    Buffered, Cursor, OpenError, PageId, RayBuffer, Visit, VisitTracer, locate_in, page_of,
};
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Paths started at a time.
const BATCH: u64 = 4096;
/// Rays traced in a visit, at about: to begin one takes some time.
const VISIT_RAYS: usize = 8192;
/// Rays between looks at how many pages a visit holds.
const STEP_RAYS: usize = 1024;
/// Part of the pages in memory that the visits of all threads may hold.
const HELD_PART: f64 = 0.25;
/// Reads under way: a disk works on several at a time.
const READERS: usize = 8;
/// Deposits that a worker gathers before it asks for the film.
const MOST_DEPOSITS: usize = 1 << 14;
/// Paths are started while what waits takes less than this part of the memory for rays: each path may come to wait with
/// some shadow rays as well.
const START_PART: usize = 2;
/// How long a reader waits for visits to end when all pages are being looked at.
const PATIENCE: Duration = Duration::from_micros(200);

/// Bytes that each thread of [`render_queued`] takes beside pages and waiting rays.
pub const QUEUED_THREAD_BYTES: u64 = 8 << 20;

/// A ray that has its hit.
#[derive(Clone, Copy)]
struct Answer {
    path: Path,
    ray: Ray,
    hit: Hit,
}

/// What waits for a page.
#[derive(Default)]
struct Waiting {
    closest: RayBuffer<Path>,
    shadow: RayBuffer<PendingLight>,
    /// Hits in the page, whose surface is needed.
    hits: Vec<Answer>,
}

impl Parcel for Waiting {
    fn append(&mut self, other: &mut Waiting) {
        self.closest.append(&mut other.closest);
        self.shadow.append(&mut other.shadow);
        self.hits.append(&mut other.hits);
    }

    fn bytes(&self) -> usize {
        self.closest.bytes() + self.shadow.bytes() + self.hits.capacity() * size_of::<Answer>()
    }
}

/// Renders a picture of a scene of which some pages are in memory. `ray_bytes` is for rays that wait. `progress` is called
/// now and then, by one thread at a time.
///
/// # Errors
/// Where the size, the samples or the camera are of no use, no threads can be started, or a page cannot be read or is
/// damaged.
pub fn render_queued(
    world: &PagedWorld,
    params: &RenderParams,
    ray_bytes: u64,
    progress: &(dyn Fn(RenderProgress) + Sync),
) -> Result<RenderOutput, RenderError> {
    let setting =
        Setting { description: world.description(), bounds: world.bounds(), emitters: world.emitters() };
    setting.run(params, |shader, materials| {
        let pages = world.pool().pack().directory.len();
        let starts = Starts::new(params);
        let film = Film::new(params.width, params.height, params.aovs);
        let job = Job {
            world,
            params,
            shader,
            materials,
            camera: camera_rays(params, world.description(), &world.bounds())?,
            queues: PageQueues::new(pages, starts.count(), ray_bytes as usize / START_PART, READERS),
            starts,
            most_held: 0,
            output: Mutex::new(RenderOutput { film, stats: RenderStats::default() }),
            error: Mutex::new(None),
            progress,
        };
        job.run()
    })
}

/// The samples of a picture, in batches of neighbors.
struct Starts {
    tiles: Vec<Tile>,
    spp: u64,
    /// Batches of a whole tile.
    per_tile: u64,
}

impl Starts {
    fn new(params: &RenderParams) -> Starts {
        let tiles = Tile::cover(params.width, params.height);
        let spp = u64::from(params.spp);
        let per_tile = (u64::from(TILE_EXTENT * TILE_EXTENT) * spp).div_ceil(BATCH);
        Starts { tiles, spp, per_tile }
    }

    fn count(&self) -> u64 {
        self.tiles.len() as u64 * self.per_tile
    }

    /// The pixels and numbers of the samples of a batch.
    fn batch(&self, number: u64) -> impl Iterator<Item = ([u32; 2], u32)> {
        let tile = &self.tiles[(number / self.per_tile) as usize];
        let begin = number % self.per_tile * BATCH;
        let end = (begin + BATCH).min(u64::from(tile.width * tile.height) * self.spp);
        (begin..end).map(|sample| {
            let pixel = (sample / self.spp) as u32;
            ([tile.x + pixel % tile.width, tile.y + pixel / tile.width], (sample % self.spp) as u32)
        })
    }
}

/// What all threads share.
struct Job<'a> {
    world: &'a PagedWorld,
    params: &'a RenderParams,
    shader: &'a dyn Shader,
    materials: &'a Materials,
    camera: CameraRays,
    queues: PageQueues<Waiting>,
    starts: Starts,
    /// Pages that a visit may hold.
    most_held: usize,
    output: Mutex<RenderOutput>,
    error: Mutex<Option<OpenError>>,
    progress: &'a (dyn Fn(RenderProgress) + Sync),
}

impl Job<'_> {
    fn run(mut self) -> Result<RenderOutput, RenderError> {
        let begin = Instant::now();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.params.threads).build()?;
        let held = self.world.pool().capacity() as f64 * HELD_PART;
        self.most_held = (held as usize / pool.current_num_threads()).max(1);
        std::thread::scope(|scope| {
            (0..READERS).for_each(|_| drop(scope.spawn(|| self.read_pages())));
            pool.broadcast(|_| Worker::new(&self).run());
        });
        if let Some(error) = self.error.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error.into());
        }
        let mut output = self.output.into_inner().unwrap_or_else(PoisonError::into_inner);
        output.stats.seconds.total = begin.elapsed().as_secs_f64();
        Ok(output)
    }

    /// Reads pages until all is done.
    fn read_pages(&self) {
        while let Some(page) = self.queues.next_read() {
            match self.world.pool().load(page) {
                Ok(true) => self.queues.arrived(page),
                Ok(false) => {
                    self.queues.put_back(page);
                    std::thread::sleep(PATIENCE);
                }
                Err(error) => {
                    self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                    self.queues.stop();
                    return;
                }
            }
        }
    }
}

/// A thread that traces and shades.
struct Worker<'a> {
    job: &'a Job<'a>,
    closest: RayBuffer<Path>,
    closest_cursor: Cursor,
    shadow: RayBuffer<PendingLight>,
    shadow_cursor: Cursor,
    answers: Vec<Answer>,
    /// Rays that shading asks for.
    next: RayBuffer<Path>,
    next_shadow: RayBuffer<PendingLight>,
    /// Rays that cannot go on here.
    set_aside: HashMap<PageId, Waiting>,
    deposits: Deposits,
    stats: RenderStats,
}

impl<'a> Worker<'a> {
    fn new(job: &'a Job<'a>) -> Worker<'a> {
        Worker {
            job,
            closest: RayBuffer::default(),
            closest_cursor: Cursor::default(),
            shadow: RayBuffer::default(),
            shadow_cursor: Cursor::default(),
            answers: Vec::new(),
            next: RayBuffer::default(),
            next_shadow: RayBuffer::default(),
            set_aside: HashMap::new(),
            deposits: Deposits::default(),
            stats: RenderStats::default(),
        }
    }

    fn run(&mut self) {
        let queues = &self.job.queues;
        while let Some(work) = self.wait_for_work() {
            self.begin(work);
            let mut is_at_work = true;
            while is_at_work {
                let visit = self.job.world.pool().visit();
                let mut tracer = VisitTracer::new(&visit);
                let mut left = VISIT_RAYS;
                while left > 0 && is_at_work && visit.len() < self.job.most_held {
                    left = left.saturating_sub(self.step(&visit, &mut tracer, STEP_RAYS));
                    if self.is_done() {
                        queues.finish(self.set_aside.drain());
                        let work = queues.try_next_work();
                        is_at_work = work.is_some();
                        work.into_iter().for_each(|work| self.begin(work));
                    }
                }
            }
            self.flush();
        }
    }

    fn wait_for_work(&mut self) -> Option<Work<Waiting>> {
        let begin = Instant::now();
        let work = self.job.queues.next_work();
        self.stats.seconds.wait += begin.elapsed().as_secs_f64();
        if work.is_none() {
            self.flush();
        }
        work
    }

    fn begin(&mut self, work: Work<Waiting>) {
        match work {
            Work::Start(number) => self.start(number),
            Work::Serve(waiting) => {
                (self.closest, self.shadow, self.answers) = (waiting.closest, waiting.shadow, waiting.hits);
            }
        }
        (self.closest_cursor, self.shadow_cursor) = Default::default();
    }

    /// Begins the paths of a batch.
    fn start(&mut self, number: u64) {
        let begin = Instant::now();
        let Job { params, camera, starts, .. } = self.job;
        self.closest.clear();
        self.shadow.clear();
        for ([x, y], sample) in starts.batch(number) {
            let pixel = y * params.width + x;
            self.deposits.begin_sample(pixel);
            let (ray, path) = camera_path(params, camera, [x, y], sample, pixel);
            self.closest.push(ray, path);
        }
        self.stats.primary += self.closest.len() as u64;
        self.stats.seconds.generate += begin.elapsed().as_secs_f64();
    }

    /// Traces some of the rays, about `most` of each kind, and shades what they find. Tells how many they were.
    fn step<'v>(&mut self, visit: &'v Visit<'v>, tracer: &mut VisitTracer<'v>, most: usize) -> usize {
        if self.closest.left(&self.closest_cursor) + self.shadow.left(&self.shadow_cursor) == 0 {
            self.take_next();
        }
        let before = self.closest.left(&self.closest_cursor) + self.shadow.left(&self.shadow_cursor);
        let begin = Instant::now();
        let Worker { set_aside, deposits, answers, .. } = self;
        tracer.occluded(Buffered {
            rays: &self.shadow,
            cursor: &mut self.shadow_cursor,
            most,
            done: &mut |light, _, hit| {
                if !hit.is_hit() {
                    deposits.add(light.pixel, light.contribution);
                }
            },
            aside: &mut |page, put| put(&mut set_aside.entry(page).or_default().shadow),
        });
        tracer.intersect(Buffered {
            rays: &self.closest,
            cursor: &mut self.closest_cursor,
            most,
            done: &mut |path, ray, hit| answers.push(Answer { path, ray, hit }),
            aside: &mut |page, put| put(&mut set_aside.entry(page).or_default().closest),
        });
        self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        let after = self.closest.left(&self.closest_cursor) + self.shadow.left(&self.shadow_cursor);
        let answered = self.answers.len();
        self.shade(visit);
        before - after + answered
    }

    fn take_next(&mut self) {
        std::mem::swap(&mut self.closest, &mut self.next);
        std::mem::swap(&mut self.shadow, &mut self.next_shadow);
        self.next.clear();
        self.next_shadow.clear();
        (self.closest_cursor, self.shadow_cursor) = Default::default();
    }

    /// Shades the answers whose surfaces are in memory.
    fn shade<'v>(&mut self, visit: &'v Visit<'v>) {
        let begin = Instant::now();
        let Worker { next, next_shadow, deposits, set_aside, .. } = self;
        let before = (next.len(), next_shadow.len());
        let mut shadow = |ray, light| next_shadow.push(ray, light);
        let mut out = ShadeOutput { deposits, shadow: &mut shadow };
        for mut answer in self.answers.drain(..) {
            let Answer { path, ray, hit } = &mut answer;
            let surface = if hit.is_hit() {
                let Some(page) = visit.page(page_of(hit)) else {
                    set_aside.entry(page_of(hit)).or_default().hits.push(answer);
                    continue;
                };
                surface_of(&locate_in(&page, hit))
            } else {
                Default::default()
            };
            let hit = SurfaceInteraction::new(self.job.materials, ray, hit, &surface);
            let goes_on = self.job.shader.shade(path, ray, hit.as_ref(), &mut out);
            path.distance += hit.map_or(0.0, |hit| hit.distance);
            if let Some(ray) = goes_on {
                next.push(ray, *path);
            }
        }
        self.stats.secondary += (self.next.len() - before.0) as u64;
        self.stats.shadow += (self.next_shadow.len() - before.1) as u64;
        self.stats.seconds.shade += begin.elapsed().as_secs_f64();
        if self.deposits.len() > MOST_DEPOSITS {
            self.flush();
        }
    }

    /// True if nothing is left to be traced here.
    fn is_done(&self) -> bool {
        self.closest.left(&self.closest_cursor) + self.shadow.left(&self.shadow_cursor) == 0
            && self.next.is_empty()
            && self.next_shadow.is_empty()
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
