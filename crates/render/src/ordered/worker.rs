//! A thread that traces and shades the rays of a generation.

use super::reader::Reader;
use super::underway::{Answer, Underway};
use super::{Job, Waiting};
use crate::{
    deposits::Deposits,
    integrator::follow,
    interaction::Seen,
    params::{RenderError, RenderParams},
    render::{RenderProgress, RenderStats},
    shadow,
    waiting_path::WaitingPath,
    wave::{Path, PendingLight, ShadeOutput},
    world::Surface,
};
use glam::Vec3;
use raystrips_geom::{Hit, Ray};
use raystrips_reorder::SortedRays;
use raystrips_tracer::OpenError;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Rays that a thread takes, or shades, at a time.
const BATCH_RAYS: usize = 2048;
/// Reads under way while rays go on.
const READS_AHEAD: usize = 1;
/// Rays that shading may ask for before they are handed on.
const MOST_NEXT: usize = 4 * BATCH_RAYS;
/// Deposits that a worker gathers before it asks for the film.
const MOST_DEPOSITS: usize = 1 << 14;

/// A thread that traces and shades. The arrays are kept from batch to batch.
pub(super) struct Worker<'a> {
    job: &'a Job<'a>,
    batch: Vec<Waiting>,
    /// Of the generation that is traced.
    underway: Underway,
    /// Rays with their hits, to be shaded.
    answers: Vec<Answer>,
    hits: Vec<Hit>,
    surfaces: Vec<Surface>,
    /// What shading asks for.
    next: Vec<Waiting>,
    /// The same while they go ahead.
    ahead: Underway,
    next_rays: Vec<Ray>,
    points: Vec<Option<Vec3>>,
    deposits: Deposits,
    stats: RenderStats,
}

impl<'a> Worker<'a> {
    pub fn new(job: &'a Job<'a>) -> Worker<'a> {
        Worker {
            job,
            batch: Vec::new(),
            underway: Underway::default(),
            answers: Vec::new(),
            hits: Vec::new(),
            surfaces: Vec::new(),
            next: Vec::new(),
            ahead: Underway::default(),
            next_rays: Vec::new(),
            points: Vec::new(),
            deposits: Deposits::default(),
            stats: RenderStats::default(),
        }
    }

    /// Begins the paths of a batch and traces their camera rays.
    pub fn start(&mut self, batch: u64) -> Result<(), RenderError> {
        let Job { params, shader, starts, world, is_stopped, .. } = self.job;
        if is_stopped.load(Ordering::Relaxed) {
            return Ok(());
        }
        let begin = Instant::now();
        self.next_rays.clear();
        for ([x, y], sample) in starts.packets(batch).flat_map(|packet| starts.of_packet(packet)) {
            let pixel = y * params.width + x;
            self.deposits.begin_sample(pixel);
            let (ray, path) = shader.begin([x, y], sample, pixel);
            self.next_rays.push(ray);
            self.answers.push(Answer { ray, path: WaitingPath::new(&path), hit: Hit::MISS });
        }
        self.stats.primary += self.answers.len() as u64;
        self.stats.seconds.generate += begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        self.hits.clear();
        self.hits.resize(self.next_rays.len(), Hit::MISS);
        world.intersect_camera_batch(&self.next_rays, &mut self.hits)?;
        self.answers.iter_mut().zip(&self.hits).for_each(|(answer, hit)| answer.hit = *hit);
        self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        self.shade()
    }

    /// Traces rays of a generation until none are left. So many are under way at a time that those which need the same page
    /// find each other.
    pub fn trace_generation(&mut self, generation: &Mutex<SortedRays<Waiting>>) -> Result<(), RenderError> {
        let world = self.job.world;
        std::thread::scope(|scope| {
            let mut reader = world.pages_at_a_time().map(|most| (Reader::spawn(scope, world), most));
            while !self.job.is_stopped.load(Ordering::Relaxed) {
                let has_more = self.take_rays(generation)?;
                if self.underway.is_empty() {
                    break;
                }
                let begin = Instant::now();
                self.underway.advance(world, &mut self.deposits, &mut self.answers)?;
                self.stats.seconds.trace += begin.elapsed().as_secs_f64();
                self.shade()?;
                if let Some((reader, most)) = &mut reader {
                    self.bring(reader, *most, has_more)?;
                }
            }
            Ok(())
        })
    }

    /// Asks for pages that rays have stopped for. While some of them are read, rays that need others go on, and those that
    /// were just begun if there `are_more`.
    fn bring(&mut self, reader: &mut Reader, most: usize, are_more: bool) -> Result<(), OpenError> {
        let has_asked = reader.ask(self.underway.wanted(), most);
        let begin = Instant::now();
        let has_nothing_else = !has_asked && !are_more && reader.outstanding() > 0;
        if reader.outstanding() > READS_AHEAD || has_nothing_else {
            reader.wait()?;
        }
        self.stats.seconds.wait += begin.elapsed().as_secs_f64();
        Ok(())
    }

    /// Takes the next rays in place of those that have ended, and tells whether there were any. When a generation has been handed
    /// out while some of its rays have stopped, what came of it by then goes on with these: few rays would need as many pages as
    /// many. Where none can stop generations stay apart.
    fn take_rays(&mut self, generation: &Mutex<SortedRays<Waiting>>) -> Result<bool, RenderError> {
        let begin = Instant::now();
        let before = self.underway.len();
        let may_follow = before > 0 && self.job.world.pages_at_a_time().is_some();
        while let room @ 1.. = self.job.rays_underway - self.underway.len() {
            let mut rays = generation.lock().unwrap_or_else(PoisonError::into_inner);
            rays.next(room.min(BATCH_RAYS), &mut self.batch).map_err(|e| self.job.scratch_error(e))?;
            if self.batch.is_empty() {
                let following = if may_follow { self.job.take_generation()? } else { None };
                let Some(following) = following else { break };
                *rays = following;
            }
            drop(rays);
            self.batch.drain(..).for_each(|ray| self.underway.push(ray));
        }
        self.stats.seconds.sort += begin.elapsed().as_secs_f64();
        Ok(self.underway.len() > before)
    }

    /// Shades all answers, also those of what comes of them as far as these need nothing that is not in memory, and hands
    /// on what does.
    fn shade(&mut self) -> Result<(), RenderError> {
        let most = BATCH_RAYS.div_ceil(self.job.shader.most_branches());
        while !self.answers.is_empty() {
            self.shade_some(self.answers.len().saturating_sub(most))?;
            if self.answers.is_empty() || self.next.len() >= MOST_NEXT {
                self.count_next();
                if self.job.world.pages_at_a_time().is_some() {
                    self.go_ahead()?;
                }
                self.hand_on()?;
            }
        }
        // Of shadow rays alone there are deposits, too.
        if self.deposits.len() > MOST_DEPOSITS {
            self.flush();
        }
        Ok(())
    }

    /// Shades the answers from number `first` on.
    fn shade_some(&mut self, first: usize) -> Result<(), OpenError> {
        let begin = Instant::now();
        let Job { world, materials, shader, params, .. } = *self.job;
        let RenderParams { width, seed, .. } = *params;
        let are_see_through = materials.are_see_through();
        self.hits.clear();
        self.hits.extend(self.answers[first..].iter().map(|answer| answer.hit));
        self.surfaces.resize(self.hits.len(), Surface::default());
        world.surface_batch(&self.hits, &mut self.surfaces)?;
        self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        let next = std::cell::RefCell::new(&mut self.next);
        let mut shadow = |ray, light: PendingLight| {
            next.borrow_mut().push(match are_see_through {
                true => Waiting::new(ray, &shadow::path(light)),
                false => Waiting::shadow(ray, light),
            });
        };
        let go_on = |ray, path: &Path| next.borrow_mut().push(Waiting::new(ray, path));
        let mut branch = go_on;
        let mut out = ShadeOutput { deposits: &mut self.deposits, shadow: &mut shadow, branch: &mut branch };
        for (Answer { ray, path, hit }, surface) in self.answers.drain(first..).zip(&self.surfaces) {
            let mut path = path.path(width, seed);
            let hit = Seen { world, materials, ray: &ray, path: &path }.surface(&hit, surface)?;
            path.widen(hit.as_ref());
            let goes_on = follow(shader, &mut path, &ray, hit.as_ref(), &mut out);
            if let Some(ray) = goes_on {
                go_on(ray, &path);
            }
        }
        self.stats.seconds.shade += begin.elapsed().as_secs_f64();
        Ok(())
    }

    fn count_next(&mut self) {
        let is_shadow = |ray: &&Waiting| ray.is_shadow != 0 || ray.path.is_shadow();
        let shadow = self.next.iter().filter(is_shadow).count() as u64;
        self.stats.shadow += shadow;
        self.stats.secondary += self.next.len() as u64 - shadow;
    }

    /// Goes on with the rays that shading asked for as far as what is in memory lets them. The pages where they begin were in
    /// use just now; when it is their turn these may be gone.
    fn go_ahead(&mut self) -> Result<(), OpenError> {
        let begin = Instant::now();
        self.next.drain(..).for_each(|ray| self.ahead.push(ray));
        self.ahead.advance(self.job.world, &mut self.deposits, &mut self.answers)?;
        self.ahead.drain_into(&mut self.next);
        self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        Ok(())
    }

    /// Gives the rays that are left of those that shading asked for to the next generation, with their keys. Those that
    /// cannot hit anything end here.
    fn hand_on(&mut self) -> Result<(), RenderError> {
        let job = self.job;
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
        let keys: Vec<u64> =
            self.next.iter().enumerate().map(|(i, next)| job.keys.key(&next.ray, point(i))).collect();
        let mut store = job.next.lock().unwrap_or_else(PoisonError::into_inner);
        store.extend(keys.into_iter().zip(self.next.drain(..))).map_err(|e| job.scratch_error(e))?;
        drop(store);
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
        let mut number = 0;
        next.retain(|waiting| {
            number += 1;
            let can_hit = points[number - 1].is_some();
            if !can_hit && waiting.is_shadow != 0 {
                deposits.add(waiting.path.pixel, waiting.path.throughput);
            } else if !can_hit {
                let mut path = waiting.path.path(width, seed);
                let mut shadow = |_, _| unreachable!("nothing was hit");
                let mut branch = |_, _: &Path| unreachable!("nothing was hit");
                let mut out = ShadeOutput { deposits, shadow: &mut shadow, branch: &mut branch };
                _ = follow(job.shader, &mut path, &waiting.ray, None, &mut out);
            }
            can_hit
        });
        points.retain(Option::is_some);
    }

    /// Puts what was gathered into the film.
    pub fn flush(&mut self) {
        let mut output = self.job.output.lock().unwrap_or_else(PoisonError::into_inner);
        self.deposits.flush(&mut output.film);
        output.stats.add(&std::mem::take(&mut self.stats));
        (self.job.watch.progress)(RenderProgress::of(&output.stats, self.job.params));
    }
}
