//! A pack of which some pages are in memory as a world: pages come when rays need them.

use crate::process_limit::ProcessLimit;
use crate::traced::{emitters, surface_of};
use crate::world::{Emitter, Progress, Surface, Tile, World};
use glam::Vec3;
use raystrips_extmem::BlockBuffer;
use raystrips_geom::{Aabb, Hit, Ray, scene::SceneDesc};
use raystrips_tracer::{
    AttributeView, Buffered, Cursor, Loan, OpenError, PageId, PagePool, PageView, Parked, RayBuffer,
    VisitTracer, locate_in, page_of, placed, placed_attributes,
};
use std::cell::Cell;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Rays that are traced with what is in memory before what they need is read.
const BATCH_RAYS: usize = 4096;
/// Part of the pages in memory that are brought at a time: more would drive out what other rays need.
const LOADED_PART: usize = 32;
/// Part of the pages in memory that may be held while surfaces are looked up.
const HELD_PART: usize = 8;
/// How long to wait for visits to end when all pages are being looked at.
const PATIENCE: Duration = Duration::from_micros(200);

/// A pack of which some pages are in memory. [`render_queued`](crate::render_queued) lets rays wait for pages; as a
/// [`World`] it reads what a batch of rays needs, in the order in which they need it.
pub struct PagedWorld {
    pool: PagePool,
    emitters: Vec<Emitter>,
    /// Of the process, if it has one that is kept here.
    limit: Option<ProcessLimit>,
    /// Nanoseconds, of all threads.
    waited: AtomicU64,
}

/// Rays of a batch, by their numbers.
type Numbered = RayBuffer<u32>;

impl PagedWorld {
    /// Takes over `pool`.
    pub fn new(pool: PagePool) -> PagedWorld {
        let emitters = emitters(&pool.pack().emitters);
        PagedWorld { pool, emitters, limit: None, waited: AtomicU64::new(0) }
    }

    /// The same, whose pages make room where the process holds more than `bytes` while [`World::bring`] brings others; half
    /// of their memory at most.
    #[must_use]
    pub fn within(self, bytes: u64) -> PagedWorld {
        PagedWorld { limit: Some(ProcessLimit::new(bytes, &self.pool)), ..self }
    }

    /// The pages.
    pub fn pool(&self) -> &PagePool {
        &self.pool
    }

    /// The surface that was hit, which is in this page.
    pub(crate) fn surface(&self, page: &PageView, hit: &Hit) -> Result<Surface, OpenError> {
        let (found, id) = (locate_in(page, hit), page_of(hit));
        let block = self.pool.attributes(id)?;
        let first = self.pool.pack().directory[id as usize].first_triangle;
        let corners = AttributeView::new(&block).map(|view| view.triangle((found.triangle - first) as usize));
        Ok(match self.pool.pack().instances.get(hit.instance as usize) {
            Some(instance) => {
                let corners = corners.map(|corners| placed_attributes(instance, corners));
                surface_of(&placed(instance, &found), corners)
            }
            None => surface_of(&found, corners),
        })
    }

    /// How long threads waited for pages that rays of a batch needed, in sum; without what [`World::bring`] took.
    pub fn waited(&self) -> Duration {
        Duration::from_nanos(self.waited.load(Ordering::Relaxed))
    }

    /// Traces `rays`, which [`VisitTracer`] does with what is in memory, until `trace` set none aside.
    fn answer(
        &self,
        rays: &[Ray],
        mut trace: impl FnMut(&mut VisitTracer, &Numbered, &mut SetAside),
    ) -> Result<(), OpenError> {
        rays.chunks(BATCH_RAYS)
            .enumerate()
            .try_for_each(|(i, batch)| self.answer_batch(batch, i * BATCH_RAYS, &mut trace))
    }

    /// The same for a batch, whose rays are numbered from `first` on.
    fn answer_batch(
        &self,
        rays: &[Ray],
        first: usize,
        trace: &mut impl FnMut(&mut VisitTracer, &Numbered, &mut SetAside),
    ) -> Result<(), OpenError> {
        let mut left = Numbered::default();
        rays.iter().enumerate().for_each(|(i, ray)| left.push(*ray, (first + i) as u32));
        let mut aside = SetAside::default();
        let mut buffer = BlockBuffer::default();
        loop {
            let visit = self.pool.visit();
            trace(&mut VisitTracer::new(&visit), &left, &mut aside);
            left.clear();
            drop(visit);
            if aside.pages.is_empty() {
                return Ok(());
            }
            let begin = Instant::now();
            aside
                .pages
                .iter()
                .take(self.most_brought())
                .try_for_each(|&page| self.load(page, &mut buffer))?;
            self.count_wait(begin);
            for page in aside.pages.drain(..) {
                left.append(aside.rays.get_mut(&page).expect("rays wait for it"));
            }
            aside.rays.clear();
        }
    }

    /// Goes on with rays whose next page is in memory.
    fn advance<T: Copy>(
        &self,
        rays: &[Ray],
        progress: &mut [Progress<T>],
        answer: impl Fn(Hit) -> T,
        trace: impl FnOnce(&mut VisitTracer, Buffered<u32>),
    ) {
        let mut moving = Numbered::default();
        for ((errand, &ray), progress) in (0..).zip(rays).zip(&*progress) {
            match *progress {
                Progress::Stopped(page, _) if !self.pool.has(page) => {}
                Progress::Waits(place) | Progress::Stopped(_, place) => {
                    moving.push_parked(&Parked { errand, ray, place });
                }
                Progress::Ended(_) => {}
            }
        }
        if moving.is_empty() {
            return;
        }
        let progress = Cell::from_mut(progress).as_slice_of_cells();
        let visit = self.pool.visit();
        let buffered = Buffered {
            rays: &moving,
            cursor: &mut Cursor::default(),
            most: usize::MAX,
            done: &mut |i, _, hit| progress[i as usize].set(Progress::Ended(answer(hit))),
            aside: &mut |page, ray| progress[ray.errand as usize].set(Progress::Stopped(page, ray.place)),
        };
        trace(&mut VisitTracer::new(&visit), buffered);
    }

    fn most_brought(&self) -> usize {
        (self.pool.capacity() / LOADED_PART).max(1)
    }

    /// Brings a page.
    fn load(&self, page: PageId, buffer: &mut BlockBuffer) -> Result<(), OpenError> {
        while !self.pool.load(&[page], buffer)? {
            std::thread::sleep(PATIENCE);
        }
        Ok(())
    }

    fn count_wait(&self, begin: Instant) {
        self.waited.fetch_add(begin.elapsed().as_nanos() as u64, Ordering::Relaxed);
    }
}

/// Rays that wait for pages, and these in the order in which they were needed.
#[derive(Default)]
struct SetAside {
    pages: Vec<PageId>,
    rays: HashMap<PageId, Numbered>,
}

impl SetAside {
    fn of(&mut self, page: PageId) -> &mut Numbered {
        self.rays.entry(page).or_insert_with(|| {
            self.pages.push(page);
            Numbered::default()
        })
    }
}

impl World for PagedWorld {
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError> {
        self.answer(rays, |tracer, left, aside| {
            tracer.intersect(Buffered {
                rays: left,
                cursor: &mut Cursor::default(),
                most: usize::MAX,
                done: &mut |i, _, hit| hits[i as usize] = hit,
                aside: &mut |page, ray| aside.of(page).push_parked(&ray),
            });
        })
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) -> Result<(), OpenError> {
        self.answer(rays, |tracer, left, aside| {
            tracer.occluded(Buffered {
                rays: left,
                cursor: &mut Cursor::default(),
                most: usize::MAX,
                done: &mut |i, _, hit| occluded[i as usize] = hit.is_hit(),
                aside: &mut |page, ray| aside.of(page).push_parked(&ray),
            });
        })
    }

    fn pages_at_a_time(&self) -> Option<usize> {
        Some(self.most_brought())
    }

    fn intersect_ahead(&self, rays: &[Ray], progress: &mut [Progress<Hit>]) -> Result<(), OpenError> {
        self.advance(rays, progress, |hit| hit, |tracer, rays| tracer.intersect(rays));
        Ok(())
    }

    fn occluded_ahead(&self, rays: &[Ray], progress: &mut [Progress<bool>]) -> Result<(), OpenError> {
        self.advance(rays, progress, |hit| hit.is_hit(), |tracer, rays| tracer.occluded(rays));
        Ok(())
    }

    fn bring(&self, pages: &[PageId]) -> Result<(), OpenError> {
        if let Some(limit) = &self.limit {
            limit.keep(&self.pool, 0);
        }
        let mut buffer = BlockBuffer::default();
        pages.iter().try_for_each(|&page| self.load(page, &mut buffer))
    }

    fn surface_batch(&self, hits: &[Hit], surfaces: &mut [Surface]) -> Result<(), OpenError> {
        let mut buffer = BlockBuffer::default();
        let most_held = self.pool.capacity() / HELD_PART;
        let mut visit = self.pool.visit();
        for (hit, surface) in hits.iter().zip(surfaces).filter(|(hit, _)| hit.is_hit()) {
            if visit.len() > most_held {
                visit = self.pool.visit();
            }
            loop {
                if let Some(page) = visit.page(page_of(hit)) {
                    *surface = self.surface(&page, hit)?;
                    break;
                }
                visit = self.pool.visit();
                let begin = Instant::now();
                self.load(page_of(hit), &mut buffer)?;
                self.count_wait(begin);
            }
        }
        Ok(())
    }

    fn bounds(&self) -> Aabb {
        let manifest = &self.pool.pack().manifest;
        Aabb { min: Vec3::from_array(manifest.bounds_min), max: Vec3::from_array(manifest.bounds_max) }
    }

    fn description(&self) -> &SceneDesc {
        &self.pool.pack().manifest.scene
    }

    fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    fn tile(&self, tile: u64) -> Result<Tile<'_>, OpenError> {
        Ok(Tile::Shared(self.pool.tile(tile)?))
    }

    fn lend(&self, bytes: u64) -> Option<Loan> {
        self.pool.lend(bytes)
    }
}
