//! A thread that traces and shades.

use super::Job;
use super::set_aside::SetAside;
use super::waiting::{Answer, Waiting};
use crate::{
    deposits::Deposits,
    integrator::follow,
    interaction::Seen,
    params::RenderParams,
    render::{RenderProgress, RenderStats},
    shadow,
    starts::CameraPacket,
    waiting_path::WaitingPath,
    wave::{Path, PendingLight, ShadeOutput},
};
use raystrips_geom::{Hit, Ray};
use raystrips_reorder::{Amount, Work};
use raystrips_tracer::{Buffered, Cursor, OpenError, PACKET, RayBuffer, Visit, VisitTracer, page_of};
use std::cell::RefCell;
use std::sync::PoisonError;
use std::time::Instant;

/// Rays traced in a visit, at about: to begin one takes some time.
const VISIT_RAYS: usize = 32768;
/// Rays between looks at how many pages a visit holds.
const STEP_RAYS: usize = 2048;
/// Rays that shading may ask for before they are traced, and rays that are set aside before they are put into queues.
const MOST_NEXT: usize = 1 << 14;
const MOST_ASIDE: usize = 1 << 15;
/// Memory that a worker keeps for the next work.
const KEPT_BYTES: usize = 2 << 20;
/// A packet of camera rays is traced together this many times at most; absent pages end that.
const MOST_ATTEMPTS: u32 = 4;
/// Deposits that a worker gathers before it asks for the film.
const MOST_DEPOSITS: usize = 1 << 14;

/// A thread that traces and shades.
pub(super) struct Worker<'a> {
    job: &'a Job<'a>,
    current: Rays,
    /// Those that wait for what came of them to be done.
    suspended: Vec<Rays>,
    answers: Vec<Answer>,
    packets: Vec<CameraPacket>,
    /// Those of a packet.
    rays: Vec<Ray>,
    paths: Vec<WaitingPath>,
    /// Rays that shading asks for.
    next: RayBuffer<WaitingPath>,
    next_shadow: RayBuffer<PendingLight>,
    /// Rays that cannot go on here.
    set_aside: SetAside,
    /// The work as it came.
    served: Amount,
    deposits: Deposits,
    stats: RenderStats,
}

/// Rays that are traced, and how far that has come.
#[derive(Default)]
struct Rays {
    closest: RayBuffer<WaitingPath>,
    closest_cursor: Cursor,
    shadow: RayBuffer<PendingLight>,
    shadow_cursor: Cursor,
}

impl Rays {
    fn new(closest: RayBuffer<WaitingPath>, shadow: RayBuffer<PendingLight>) -> Rays {
        Rays { closest, shadow, ..Rays::default() }
    }

    /// How many are left.
    fn left(&self) -> usize {
        self.closest.left(&self.closest_cursor) + self.shadow.left(&self.shadow_cursor)
    }
}

impl<'a> Worker<'a> {
    pub fn new(job: &'a Job<'a>) -> Worker<'a> {
        Worker {
            job,
            current: Rays::default(),
            suspended: Vec::new(),
            answers: Vec::new(),
            packets: Vec::new(),
            rays: Vec::new(),
            paths: Vec::new(),
            next: RayBuffer::default(),
            next_shadow: RayBuffer::default(),
            set_aside: SetAside::default(),
            served: Amount::default(),
            deposits: Deposits::default(),
            stats: RenderStats::default(),
        }
    }

    pub fn run(&mut self) -> Result<(), OpenError> {
        let queues = &self.job.queues;
        while let Some(work) = self.wait_for_work() {
            self.begin(work);
            let mut is_at_work = true;
            while is_at_work {
                let visit = self.job.world.pool().visit();
                let mut tracer = VisitTracer::new(&visit);
                let mut left = VISIT_RAYS;
                while left > 0 && is_at_work && visit.len() < self.job.most_held {
                    left = left.saturating_sub(self.step(&visit, &mut tracer, STEP_RAYS)?);
                    if self.is_done() {
                        self.finish();
                        let work = queues.try_next_work();
                        is_at_work = work.is_some();
                        work.into_iter().for_each(|work| self.begin(work));
                    }
                }
            }
            self.flush();
        }
        Ok(())
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
        self.served = Amount::default();
        match work {
            Work::Start(number) => self.start(number),
            Work::Serve(waiting) => {
                self.served = Amount::of(&waiting);
                let Waiting { closest, shadow, hits, packets } = waiting;
                self.current = Rays::new(closest, shadow);
                (self.answers, self.packets) = (hits, packets);
            }
        }
        if self.next.bytes() + self.next_shadow.bytes() > KEPT_BYTES {
            (self.next, self.next_shadow) = Default::default();
        }
    }

    /// Ends the work.
    fn finish(&mut self) {
        self.put_set_aside();
        self.job.queues.finish(self.served);
    }

    /// Puts what cannot go on into queues.
    fn put_set_aside(&mut self) {
        let Job { queues, runs, limit, world, .. } = self.job;
        self.set_aside.sort(|page| runs.of(page));
        queues.put(self.set_aside.by_run());
        self.set_aside.clear();
        limit.keep(world.pool(), queues.bytes());
    }

    /// Begins the paths of a batch.
    fn start(&mut self, batch: u64) {
        let Job { params, starts, watch, queues, .. } = self.job;
        if (watch.is_due)() {
            queues.close();
        }
        self.current = Rays::default();
        self.packets.extend(starts.packets(batch));
        for ([x, y], _) in self.packets.iter().flat_map(|&packet| starts.of_packet(packet)) {
            self.deposits.begin_sample(y * params.width + x);
            self.stats.primary += 1;
        }
    }

    /// Traces some packets of camera rays, about `most` rays. Those that do not keep together, or that met absent pages
    /// too often, go on as single rays.
    fn trace_packets(&mut self, tracer: &mut VisitTracer, most: usize) {
        let Job { params, shader, starts, .. } = self.job;
        for _ in 0..most.div_ceil(PACKET) {
            let Some(mut packet) = self.packets.pop() else { return };
            let begin = Instant::now();
            let paths = starts.of_packet(packet).map(|([x, y], sample)| {
                let (ray, path) = shader.begin([x, y], sample, y * params.width + x);
                (ray, WaitingPath::new(&path))
            });
            self.rays.clear();
            self.paths.clear();
            self.rays.extend(paths.map(|(ray, path)| {
                self.paths.push(path);
                ray
            }));
            self.stats.seconds.generate += begin.elapsed().as_secs_f64();
            let begin = Instant::now();
            let mut hits = [Hit::MISS; PACKET];
            let hits = &mut hits[..self.rays.len()];
            let rays = self.rays.iter().zip(&self.paths);
            packet.attempts += 1;
            match tracer.intersect_packet(&self.rays, hits) {
                Ok(true) => self.answers.extend(rays.zip(hits).map(|((&ray, &path), hit)| Answer {
                    path,
                    ray,
                    hit: *hit,
                })),
                Err(page) if packet.attempts < MOST_ATTEMPTS => self.set_aside.packets.push((page, packet)),
                Ok(false) | Err(_) => rays.for_each(|(&ray, &path)| self.next.push(ray, path)),
            }
            self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        }
    }

    /// Traces some of the rays, about `most` of each kind, and shades what they find. Tells how many they were.
    fn step<'v>(
        &mut self,
        visit: &'v Visit<'v>,
        tracer: &mut VisitTracer<'v>,
        most: usize,
    ) -> Result<usize, OpenError> {
        if self.current.left() == 0 || self.next.len() + self.next_shadow.len() > MOST_NEXT {
            self.turn_to_next();
        }
        if self.set_aside.rays() > MOST_ASIDE {
            self.put_set_aside();
        }
        let before = self.current.left();
        let begin = Instant::now();
        let Worker { set_aside, deposits, answers, current, .. } = self;
        tracer.occluded(Buffered {
            rays: &current.shadow,
            cursor: &mut current.shadow_cursor,
            most,
            done: &mut |light, _, hit| {
                if !hit.is_hit() {
                    deposits.add(light.pixel, light.contribution);
                }
            },
            aside: &mut |page, ray| set_aside.shadow.push((page, ray)),
        });
        tracer.intersect(Buffered {
            rays: &current.closest,
            cursor: &mut current.closest_cursor,
            most,
            done: &mut |path, ray, hit| answers.push(Answer { path, ray, hit }),
            aside: &mut |page, ray| set_aside.closest.push((page, ray)),
        });
        self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        let after = self.current.left();
        self.trace_packets(tracer, most);
        Ok(before - after + self.shade(visit)?)
    }

    /// Goes on with what shading asked for, before what is left: so that it does not become more than a few thousand rays.
    fn turn_to_next(&mut self) {
        if self.next.is_empty() && self.next_shadow.is_empty() {
            self.current = self.suspended.pop().unwrap_or_default();
            return;
        }
        let (next, next_shadow) = (std::mem::take(&mut self.next), std::mem::take(&mut self.next_shadow));
        let before = std::mem::replace(&mut self.current, Rays::new(next, next_shadow));
        if before.left() > 0 {
            self.suspended.push(before);
        } else {
            // Their memory serves once more.
            (self.next, self.next_shadow) = (before.closest, before.shadow);
            self.next.clear();
            self.next_shadow.clear();
        }
    }

    /// Shades answers whose surfaces are in memory, as long as not too many rays come of it. Tells how many they were.
    fn shade<'v>(&mut self, visit: &'v Visit<'v>) -> Result<usize, OpenError> {
        let begin = Instant::now();
        let Job { world, materials, shader, params, .. } = *self.job;
        let &RenderParams { width, seed, .. } = params;
        let Worker { answers, next, next_shadow, deposits, set_aside, stats, .. } = self;
        let next = RefCell::new(next);
        let go_on = |ray, path: &Path| next.borrow_mut().push(ray, WaitingPath::new(path));
        let (mut shadows, mut branches) = (0, 0);
        // Where surfaces are see-through, shadow rays go on as paths do.
        let are_see_through = materials.are_see_through();
        let mut shadow = |ray, light| {
            shadows += 1;
            match are_see_through {
                true => go_on(ray, &shadow::path(light)),
                false => next_shadow.push(ray, light),
            }
        };
        let mut branch = |ray, path: &Path| {
            branches += 1;
            go_on(ray, path);
        };
        let mut out = ShadeOutput { deposits, shadow: &mut shadow, branch: &mut branch };
        let before = answers.len();
        while next.borrow().len() < MOST_NEXT
            && let Some(answer) = answers.pop()
        {
            let Answer { path, ray, hit } = &answer;
            let surface = if hit.is_hit() {
                let Some(page) = visit.page(page_of(hit)) else {
                    set_aside.hits.push((page_of(hit), answer));
                    continue;
                };
                world.surface(&page, hit)?
            } else {
                Default::default()
            };
            let mut path = path.path(width, seed);
            let hit = Seen { world, materials, ray, path: &path }.surface(hit, &surface)?;
            path.widen(hit.as_ref());
            if let Some(ray) = follow(shader, &mut path, ray, hit.as_ref(), &mut out) {
                stats.count(&path);
                go_on(ray, &path);
            }
        }
        stats.shadow += shadows;
        stats.secondary += branches;
        stats.seconds.shade += begin.elapsed().as_secs_f64();
        let answered = before - answers.len();
        if self.deposits.len() > MOST_DEPOSITS {
            self.flush();
        }
        Ok(answered)
    }

    /// True if nothing is left to be traced here.
    fn is_done(&self) -> bool {
        self.current.left() == 0
            && self.suspended.is_empty()
            && self.answers.is_empty()
            && self.next.is_empty()
            && self.next_shadow.is_empty()
            && self.packets.is_empty()
    }

    /// Puts what was gathered into the film.
    fn flush(&mut self) {
        let mut output = self.job.output.lock().unwrap_or_else(PoisonError::into_inner);
        self.deposits.flush(&mut output.film);
        output.stats.add(&std::mem::take(&mut self.stats));
        (self.job.watch.progress)(RenderProgress::of(&output.stats, self.job.params));
    }
}
