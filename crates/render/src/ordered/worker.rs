//! A thread that traces and shades the rays of a generation.

use super::{Job, Waiting};
use crate::{
    deposits::Deposits,
    integrator::follow,
    interaction::Seen,
    params::{RenderError, RenderParams},
    render::{RenderProgress, RenderStats},
    shadow,
    starts::CameraPacket,
    waiting_path::WaitingPath,
    wave::{Path, PendingLight, ShadeOutput},
    world::Surface,
};
use bytemuck::Zeroable;
use glam::Vec3;
use raystrips_geom::{Hit, Ray};
use raystrips_reorder::SortedRays;
use raystrips_tracer::OpenError;
use std::ops::Range;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Rays that a thread takes at a time.
const BATCH_RAYS: usize = 4096;
/// Rays that shading may ask for before they are handed on.
const MOST_NEXT: usize = 4 * BATCH_RAYS;
/// Deposits that a worker gathers before it asks for the film.
const MOST_DEPOSITS: usize = 1 << 14;

/// A thread that traces and shades. The arrays are kept from batch to batch.
pub(super) struct Worker<'a> {
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
    pub fn new(job: &'a Job<'a>) -> Worker<'a> {
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
    pub fn start(&mut self, batch: u64) -> Result<(), RenderError> {
        let job = self.job;
        if job.is_stopped.load(Ordering::Relaxed) {
            return Ok(());
        }
        let begin = Instant::now();
        self.rays.clear();
        self.paths.clear();
        for packet in job.starts.packets(batch) {
            self.generate(packet);
        }
        self.stats.primary += self.rays.len() as u64;
        self.stats.seconds.generate += begin.elapsed().as_secs_f64();
        self.find_hits(true)?;
        self.shade()
    }

    fn generate(&mut self, packet: CameraPacket) {
        let Job { params, shader, starts, .. } = self.job;
        for ([x, y], sample) in starts.of_packet(packet) {
            let pixel = y * params.width + x;
            self.deposits.begin_sample(pixel);
            let (ray, path) = shader.begin([x, y], sample, pixel);
            self.rays.push(ray);
            self.paths.push(WaitingPath::new(&path));
        }
    }

    /// Traces rays of a generation until none are left.
    pub fn trace_generation(&mut self, generation: &Mutex<SortedRays<Waiting>>) -> Result<(), RenderError> {
        let job = self.job;
        while !job.is_stopped.load(Ordering::Relaxed) {
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
            self.find_hits(false)?;
            self.shade()?;
        }
        Ok(())
    }

    /// Divides a batch into rays of the two kinds.
    fn divide(&mut self) {
        self.rays.clear();
        self.paths.clear();
        self.shadow_rays.clear();
        self.lights.clear();
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

    fn find_hits(&mut self, are_camera_rays: bool) -> Result<(), OpenError> {
        let begin = Instant::now();
        self.hits.clear();
        self.hits.resize(self.rays.len(), Hit::MISS);
        self.surfaces.resize(self.rays.len(), Surface::default());
        let world = self.job.world;
        match are_camera_rays {
            true => world.intersect_camera_batch(&self.rays, &mut self.hits)?,
            false => world.intersect_batch(&self.rays, &mut self.hits)?,
        }
        world.surface_batch(&self.hits, &mut self.surfaces)?;
        self.stats.seconds.trace += begin.elapsed().as_secs_f64();
        Ok(())
    }

    /// Shades what rays hit, and hands on what came of it.
    fn shade(&mut self) -> Result<(), RenderError> {
        let most = MOST_NEXT.div_ceil(self.job.shader.most_branches());
        for first in (0..self.rays.len()).step_by(most) {
            self.shade_some(first..self.rays.len().min(first + most))?;
            if self.next.len() >= MOST_NEXT {
                self.hand_on()?;
            }
        }
        // Of shadow rays alone there are deposits, too.
        self.hand_on()
    }

    fn shade_some(&mut self, range: Range<usize>) -> Result<(), OpenError> {
        let begin = Instant::now();
        let Job { world, materials, shader, params, .. } = *self.job;
        let RenderParams { width, seed, .. } = *params;
        let are_see_through = materials.are_see_through();
        let seen = self.rays[range.clone()].iter().zip(&self.paths[range.clone()]);
        let found = self.hits[range.clone()].iter().zip(&self.surfaces[range]);
        let next = std::cell::RefCell::new(&mut self.next);
        let mut shadow = |ray, light: PendingLight| {
            let waiting = if are_see_through {
                Waiting { ray, path: WaitingPath::new(&shadow::path(light)), is_shadow: 0 }
            } else {
                let PendingLight { pixel, contribution } = light;
                let path = WaitingPath { pixel, throughput: contribution, ..WaitingPath::zeroed() };
                Waiting { ray, path, is_shadow: 1 }
            };
            next.borrow_mut().push(waiting);
        };
        let go_on = |ray, path: &Path| {
            next.borrow_mut().push(Waiting { ray, path: WaitingPath::new(path), is_shadow: 0 })
        };
        let mut branch = go_on;
        let mut out = ShadeOutput { deposits: &mut self.deposits, shadow: &mut shadow, branch: &mut branch };
        for ((ray, path), (hit, surface)) in seen.zip(found) {
            let mut path = path.path(width, seed);
            let hit = Seen { world, materials, ray, path: &path }.surface(hit, surface)?;
            path.widen(hit.as_ref());
            let goes_on = follow(shader, &mut path, ray, hit.as_ref(), &mut out);
            if let Some(ray) = goes_on {
                go_on(ray, &path);
            }
        }
        self.stats.seconds.shade += begin.elapsed().as_secs_f64();
        Ok(())
    }

    /// Gives the rays that shading asked for to the next generation, with their keys. Those that cannot hit anything end
    /// here.
    fn hand_on(&mut self) -> Result<(), RenderError> {
        let job = self.job;
        let is_shadow = |ray: &&Waiting| ray.is_shadow != 0 || ray.path.is_shadow();
        let shadow = self.next.iter().filter(is_shadow).count() as u64;
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
