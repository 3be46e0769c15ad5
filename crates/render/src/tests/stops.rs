//! Rays that stop for what is not in memory give the picture that they give where all is.

use crate::{
    ordered::{OrderParams, render_ordered},
    params::{RenderError, RenderParams},
    render::Watch,
    testing::{BruteWorld, cornell_box, render_quietly},
    unfinished::Unfinished,
    world::{Emitter, Progress, Surface, World},
};
use raystrips_geom::{Aabb, Hit, Ray, scene::SceneDesc};
use raystrips_reorder::{Curve, Ordering};
use raystrips_tracer::{OpenError, PackError, PageId, Place};
use std::collections::VecDeque;
use std::sync::Mutex;

/// Pages of which a ray needs one, and how many of them are in memory at a time: all that two workers ask for.
const PAGES: u32 = 7;
const IN_MEMORY: usize = 4;

/// A world in which every ray needs one of a few pages.
struct FewPages {
    world: BruteWorld,
    /// Those that came last.
    in_memory: Mutex<VecDeque<PageId>>,
    /// Whether this page cannot be read.
    damaged: Option<PageId>,
    stops: Mutex<u64>,
}

impl FewPages {
    fn go_on<T: Copy>(&self, rays: &[Ray], progress: &mut [Progress<T>], answer: impl Fn(&Ray) -> T) {
        let in_memory = self.in_memory.lock().unwrap();
        for (ray, progress) in rays.iter().zip(progress) {
            let page = ray.dir.x.to_bits() % PAGES;
            *progress = match *progress {
                Progress::Ended(_) => continue,
                _ if in_memory.contains(&page) => Progress::Ended(answer(ray)),
                _ => Progress::Stopped(page, Place::BEGINNING),
            };
            *self.stops.lock().unwrap() += u64::from(matches!(progress, Progress::Stopped(..)));
        }
    }

    fn hit(&self, ray: &Ray) -> Hit {
        let mut hits = [Hit::MISS];
        self.world.intersect_batch(&[*ray], &mut hits).unwrap();
        hits[0]
    }
}

impl World for FewPages {
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError> {
        self.world.intersect_batch(rays, hits)
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) -> Result<(), OpenError> {
        self.world.occluded_batch(rays, occluded)
    }

    fn pages_at_a_time(&self) -> Option<usize> {
        Some(1)
    }

    fn intersect_ahead(&self, rays: &[Ray], progress: &mut [Progress<Hit>]) -> Result<(), OpenError> {
        self.go_on(rays, progress, |ray| self.hit(ray));
        Ok(())
    }

    fn occluded_ahead(&self, rays: &[Ray], progress: &mut [Progress<bool>]) -> Result<(), OpenError> {
        self.go_on(rays, progress, |ray| self.hit(ray).is_hit());
        Ok(())
    }

    fn bring(&self, pages: &[PageId]) -> Result<(), OpenError> {
        if pages.iter().any(|&page| self.damaged == Some(page)) {
            return Err(OpenError { path: "few.rsp".into(), source: PackError::NotAPack });
        }
        let mut in_memory = self.in_memory.lock().unwrap();
        in_memory.extend(pages);
        let gone = in_memory.len().saturating_sub(IN_MEMORY);
        in_memory.drain(..gone);
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

fn params() -> RenderParams {
    RenderParams { width: 60, height: 40, spp: 2, threads: 2, ..RenderParams::default() }
}

fn few_pages(damaged: Option<PageId>) -> FewPages {
    FewPages { world: cornell_box(), in_memory: Mutex::default(), damaged, stops: Mutex::default() }
}

fn render_sorted(world: &FewPages) -> Result<Unfinished, RenderError> {
    let order = OrderParams {
        ordering: Ordering::Origin,
        curve: Curve::Z,
        buffer_bytes: 1 << 20,
        scratch: None,
        hit_points: None,
    };
    let watch = Watch { is_due: &|| false, progress: &|_| {} };
    render_ordered(world, &params(), &order, Unfinished::new(&params()), &watch)
}

#[test]
fn rays_that_stop_give_the_same_picture() {
    let whole = render_quietly(&cornell_box(), &params());
    let world = few_pages(None);
    let stopped = render_sorted(&world).unwrap().into_output();
    assert!(stopped.film == whole.film);
    let counts = |output: &crate::RenderOutput| [output.stats.shadow, output.stats.secondary];
    assert_eq!(counts(&stopped), counts(&whole));
    assert!(*world.stops.lock().unwrap() > 1000);
}

#[test]
fn a_page_that_cannot_be_read_ends_the_work() {
    assert!(matches!(render_sorted(&few_pages(Some(3))), Err(RenderError::Page(_))));
}
