//! Rays that a worker has under way: they go on as far as what is in memory lets them, and stop where they need more.

use super::Waiting;
use crate::{
    deposits::Deposits,
    waiting_path::WaitingPath,
    wave::PendingLight,
    world::{Progress, World},
};
use raystrips_geom::{Hit, Ray};
use raystrips_tracer::{OpenError, PageId, Place};
use std::collections::HashSet;

/// Rays of paths and shadow rays.
#[derive(Default)]
pub(super) struct Underway {
    closest: Rays<WaitingPath, Hit>,
    shadow: Rays<PendingLight, bool>,
}

/// A ray of a path that has its hit.
pub(super) struct Answer {
    pub ray: Ray,
    pub path: WaitingPath,
    pub hit: Hit,
}

impl Underway {
    /// Adds a ray.
    pub fn push(&mut self, Waiting { ray, path, is_shadow, place }: Waiting) {
        match is_shadow {
            0 => self.closest.push(ray, path, Progress::Waits(place)),
            _ => {
                let light = PendingLight { pixel: path.pixel, contribution: path.throughput };
                self.shadow.push(ray, light, Progress::Waits(place));
            }
        }
    }

    /// How many rays.
    pub fn len(&self) -> usize {
        self.closest.rays.len() + self.shadow.rays.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Goes on with all of them. Those that come to their ends leave: light that arrives goes to `deposits`, rays of paths with
    /// their hits to `answers`.
    pub fn advance(
        &mut self,
        world: &dyn World,
        deposits: &mut Deposits,
        answers: &mut Vec<Answer>,
    ) -> Result<(), OpenError> {
        let Underway { closest, shadow } = self;
        world.occluded_ahead(&shadow.rays, &mut shadow.progress)?;
        shadow.take_ended(|_, light, is_occluded| {
            if !is_occluded {
                deposits.add(light.pixel, light.contribution);
            }
        });
        world.intersect_ahead(&closest.rays, &mut closest.progress)?;
        closest.take_ended(|ray, path, hit| answers.push(Answer { ray, path, hit }));
        Ok(())
    }

    /// The pages for which rays have stopped: those of shadow rays, then those of paths, of each kind those of the rays that
    /// are here for the longest first.
    pub fn wanted(&self) -> Vec<PageId> {
        let mut seen = HashSet::new();
        let pages = self.shadow.wanted().chain(self.closest.wanted());
        pages.filter(|&page| seen.insert(page)).collect()
    }

    /// Takes all rays out, each with the place where it stopped.
    pub fn drain_into(&mut self, waiting: &mut Vec<Waiting>) {
        self.shadow.drain(|ray, light, place| waiting.push(Waiting { place, ..Waiting::shadow(ray, light) }));
        self.closest.drain(|ray, path, place| waiting.push(Waiting { ray, path, is_shadow: 0, place }));
    }
}

/// Rays of one kind, each with its errand and how far it has come.
struct Rays<E, T> {
    rays: Vec<Ray>,
    errands: Vec<E>,
    progress: Vec<Progress<T>>,
}

impl<E, T> Default for Rays<E, T> {
    fn default() -> Rays<E, T> {
        Rays { rays: Vec::new(), errands: Vec::new(), progress: Vec::new() }
    }
}

impl<E: Copy, T: Copy> Rays<E, T> {
    fn push(&mut self, ray: Ray, errand: E, progress: Progress<T>) {
        self.rays.push(ray);
        self.errands.push(errand);
        self.progress.push(progress);
    }

    fn take_ended(&mut self, mut ended: impl FnMut(Ray, E, T)) {
        let mut left = 0;
        for i in 0..self.rays.len() {
            let (ray, errand, progress) = (self.rays[i], self.errands[i], self.progress[i]);
            match progress {
                Progress::Ended(answer) => ended(ray, errand, answer),
                _ => {
                    (self.rays[left], self.errands[left], self.progress[left]) = (ray, errand, progress);
                    left += 1;
                }
            }
        }
        self.rays.truncate(left);
        self.errands.truncate(left);
        self.progress.truncate(left);
    }

    fn wanted(&self) -> impl Iterator<Item = PageId> {
        self.progress.iter().filter_map(|progress| match *progress {
            Progress::Stopped(page, _) => Some(page),
            _ => None,
        })
    }

    fn drain(&mut self, mut left: impl FnMut(Ray, E, Place)) {
        // Those that ended were taken out.
        for ((ray, errand), progress) in
            self.rays.drain(..).zip(self.errands.drain(..)).zip(self.progress.drain(..))
        {
            if let Progress::Waits(place) | Progress::Stopped(_, place) = progress {
                left(ray, errand, place);
            }
        }
    }
}
