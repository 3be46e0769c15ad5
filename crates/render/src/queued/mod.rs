//! Pictures of scenes that are larger than memory: paths wait for pages in queues, and are shaded and go on in whatever
//! order pages come. Every random number and every sum is independent of that order, so the picture is the one that
//! [`render`](crate::render()) makes.

mod set_aside;
mod waiting;
mod worker;

use crate::{
    integrator::Shader,
    material::Materials,
    paged::PagedWorld,
    params::{RenderError, RenderParams},
    process_limit::ProcessLimit,
    render::{Part, RenderOutput, Watch, with_shader},
    starts::Starts,
    unfinished::Unfinished,
};
use raystrips_extmem::BlockBuffer;
use raystrips_reorder::{Limits, PageQueues};
use raystrips_tracer::{OpenError, PagePool, Runs};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use waiting::{RAY_BYTES, Waiting};
use worker::Worker;

/// The visits of all threads, and reads ahead of them, may hold one in so many of the pages in memory.
const HELD_PARTS: u64 = 4;
/// Most reads under way: a disk works on several at a time.
const MOST_READERS: u64 = 8;
/// Memory for what they read.
const READ_BUFFER_BYTES: u64 = 2 << 20;
/// Runs of pages that are read or have come while no thread goes on with their rays.
const READ_AHEAD: u64 = 64;
/// Queues are served together up to so many rays, so that each step of the tracer has many.
const SERVE_RAYS: usize = 16384;
/// How long a reader waits for visits to end when all pages are being looked at.
const PATIENCE: Duration = Duration::from_micros(200);

/// Bytes that [`render_queued`] takes for each page of the pack, at about.
pub const QUEUED_PAGE_BYTES: u64 = size_of::<Waiting>() as u64 + 32;

/// Bytes that each thread of [`render_queued`] takes beside pages and waiting rays.
pub const QUEUED_THREAD_BYTES: u64 = 14 << 20;

/// Which pages are read next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Schedule {
    /// Those that most rays wait for.
    #[default]
    Longest,
    /// Those for which the most rays wait by the bytes that are not in memory (Pharr et al. 1997).
    Benefit,
}

/// What paging is to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueueParams {
    /// Paths are started while the rays that wait take less than this; it is taken from the memory of the pages.
    pub ray_bytes: u64,
    /// Pages go, beyond that, while the process holds more than this.
    pub process_bytes: u64,
    /// Neighboring pages up to this size are read together: where a disk has to seek, that is what takes time.
    pub read_bytes: u64,
    /// Which are read next.
    pub schedule: Schedule,
}

/// Renders a picture of a scene of which some pages are in memory, from where it was left until it is finished or `watch`
/// wants a pause.
///
/// # Errors
/// Where the size, the samples or the camera are of no use, no threads can be started, or a page cannot be read or is
/// damaged.
pub fn render_queued(
    world: &PagedWorld,
    params: &RenderParams,
    paging: &QueueParams,
    begin: Unfinished,
    watch: &Watch,
) -> Result<Unfinished, RenderError> {
    with_shader(world, params, begin, watch, &|part| {
        let Part { params, shader, materials, begin, watch } = part;
        let frame_bytes = PagePool::frame_bytes(world.pool().pack());
        // Pages of a read that the pool cannot hold with some others would drive each other out.
        let read_bytes = paging.read_bytes.min(world.pool().capacity() as u64 * frame_bytes / HELD_PARTS);
        let pages_a_read = (read_bytes / frame_bytes).max(1);
        let limits = Limits {
            // Each may become as many.
            start: paging.ray_bytes as usize / (RAY_BYTES * shader.most_branches()),
            serve: SERVE_RAYS,
            read_ahead: (world.pool().capacity() as u64 / HELD_PARTS / pages_a_read).clamp(1, READ_AHEAD)
                as usize,
        };
        let runs = Runs::new(&world.pool().pack().directory, read_bytes);
        let starts = Starts::new(params);
        let job = Job {
            world,
            params,
            shader,
            materials,
            queues: PageQueues::new(runs.len(), begin.next.min(starts.count())..starts.count(), limits),
            runs,
            limit: ProcessLimit::new(paging.process_bytes, world.pool()),
            starts,
            schedule: paging.schedule,
            readers: (READ_BUFFER_BYTES / paging.read_bytes.max(1)).clamp(1, MOST_READERS) as usize,
            most_held: 0,
            output: Mutex::new(begin.output),
            error: Mutex::new(None),
            watch,
        };
        job.run()
    })
}

/// Ends the work of all threads when one panics: they would wait for it.
struct EndOnPanic<'a>(&'a PageQueues<Waiting>);

impl Drop for EndOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.stop();
        }
    }
}

/// What all threads share.
struct Job<'a> {
    world: &'a PagedWorld,
    params: &'a RenderParams,
    shader: &'a dyn Shader,
    materials: &'a Materials,
    queues: PageQueues<Waiting>,
    runs: Runs,
    limit: ProcessLimit,
    starts: Starts,
    schedule: Schedule,
    readers: usize,
    /// Pages that a visit may hold.
    most_held: usize,
    output: Mutex<RenderOutput>,
    error: Mutex<Option<OpenError>>,
    watch: &'a Watch<'a>,
}

impl Job<'_> {
    fn run(mut self) -> Result<Unfinished, RenderError> {
        let begin = Instant::now();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.params.threads).build()?;
        let held = self.world.pool().capacity() / HELD_PARTS as usize;
        self.most_held = (held / pool.current_num_threads()).max(1);
        std::thread::scope(|scope| {
            (0..self.readers).for_each(|_| drop(scope.spawn(|| self.read_pages())));
            pool.broadcast(|_| {
                let _end = EndOnPanic(&self.queues);
                if let Err(error) = Worker::new(&self).run() {
                    self.fail(error);
                }
            });
        });
        if let Some(error) = self.error.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error.into());
        }
        let mut output = self.output.into_inner().unwrap_or_else(PoisonError::into_inner);
        output.stats.seconds.total += begin.elapsed().as_secs_f64();
        let next = self.queues.next_start();
        Ok(Unfinished { output, next, is_finished: next == self.starts.count() })
    }

    fn next_read(&self) -> Option<u32> {
        let pool = self.world.pool();
        match self.schedule {
            Schedule::Longest => self.queues.next_read(),
            Schedule::Benefit => {
                self.queues.next_read_by_benefit(|run| pool.absent_bytes(self.runs.pages(run)))
            }
        }
    }

    /// Ends the work of all threads.
    fn fail(&self, error: OpenError) {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.queues.stop();
    }

    /// Reads pages until all is done.
    fn read_pages(&self) {
        let _end = EndOnPanic(&self.queues);
        let mut buffer = BlockBuffer::default();
        while let Some(run) = self.next_read() {
            match self.world.pool().load(self.runs.pages(run), &mut buffer) {
                Ok(true) => self.queues.arrived(run),
                Ok(false) => {
                    self.queues.put_back(run);
                    std::thread::sleep(PATIENCE);
                }
                Err(error) => return self.fail(error),
            }
        }
    }
}
