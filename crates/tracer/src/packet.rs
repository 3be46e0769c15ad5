//! Packets: rays from one point in nearly one direction, such as the camera rays of a block of pixels.
//!
//! All rays of a packet go down the hierarchy together. A node is tested once for the whole packet, with intervals
//! (Boulos et al. 2006), then each box that is met against its rays, eight at a time. Where few of them stay
//! active (Lauterbach et al. 2007, section 5.2) these go on as single rays. Strips are decoded once for all rays.
//! Which strips a ray is tested against may differ from what it does alone, the hit cannot.

use crate::boxes::{Planes, RayGrid};
use crate::opacity;
use crate::pages::Pages;
use crate::prepared::PreparedRay;
use crate::scene::Locator;
use crate::simd::{LANES, Simd};
use crate::strip::{StripHits, test_long_strip};
use crate::walk::{Best, Step, Walk, first_link, slack_in};
use crate::window::Candidates;
use raystrips_geom::{Hit, Ray};
use raystrips_pack::layout::{TopNode, WIDTH};
use raystrips_pack::{PageId, PageView, WindowHead};

/// Most rays of a packet: a bit each.
pub const PACKET: usize = 64;
/// This many active rays or fewer go on alone.
const FEW: u32 = 1;

/// A subtree that waits for some rays.
#[derive(Clone, Copy, Default)]
struct Waiting {
    /// Before this no ray enters it.
    tnear: f32,
    link: u32,
    /// Which rays.
    active: u64,
}

/// The memory of packets, kept from one to the next.
pub(crate) struct Packet {
    rays: Vec<PreparedRay>,
    best: Vec<Best<false>>,
    /// Inverse directions by axis; of rays that are not there, those of the first.
    inv_dir: [[f32; PACKET]; 3],
    tnear: [f32; PACKET],
    /// Up to where hits still matter; negative infinity for rays that are not there.
    limit: [f32; PACKET],
    /// The greatest of them.
    farthest: f32,
    interval: Interval,
    stack: Vec<Waiting>,
    candidates: Candidates,
}

impl Packet {
    pub fn new() -> Packet {
        Packet {
            rays: Vec::with_capacity(PACKET),
            best: Vec::with_capacity(PACKET),
            inv_dir: [[0.0; PACKET]; 3],
            tnear: [0.0; PACKET],
            limit: [f32::NEG_INFINITY; PACKET],
            farthest: f32::NEG_INFINITY,
            interval: Interval { least: [0.0; 3], greatest: [0.0; 3] },
            stack: Vec::new(),
            candidates: Candidates::NONE,
        }
    }

    /// Traces up to [`PACKET`] rays together. False, and nothing done, where they have not all the same origin and
    /// signs of direction, and in scenes with instances: what an instance shows is seen by few rays of a packet, and to take
    /// the packet there costs more than that saves.
    ///
    /// # Errors
    /// A page that they need and that is not in memory; nothing is known of any hit then.
    #[inline(always)]
    pub fn trace<'s, S: Simd>(
        s: S,
        pages: impl Pages<'s>,
        packet: &mut Packet,
        single: &mut Walk<'s, false>,
        rays: &[Ray],
        hits: &mut [Hit],
    ) -> Result<bool, PageId> {
        if !is_coherent(rays) || !pages.instances().is_empty() {
            return Ok(false);
        }
        packet.begin(rays);
        packet.descend(s, pages, single)?;
        for (hit, best) in hits.iter_mut().zip(&packet.best) {
            *hit = if best.hit.is_hit() { best.hit } else { Hit::MISS };
        }
        Ok(true)
    }

    /// Traces the rays with which the packet began.
    #[inline(always)]
    fn descend<'s, S: Simd>(
        &mut self,
        s: S,
        pages: impl Pages<'s>,
        single: &mut Walk<'s, false>,
    ) -> Result<(), PageId> {
        let slack = slack_in(s, pages, Hit::NO_INSTANCE, &self.rays[0]);
        self.interval = Interval::of(&self.inv_dir);
        let mut page: PageId = 0;
        let mut view = pages.some_page();
        let everyone = u64::MAX >> (PACKET - self.rays.len());
        self.stack.clear();
        self.stack.push(Waiting { tnear: 0.0, link: TopNode::NODE, active: everyone });
        self.farthest = self.farthest_limit(s);
        while let Some(here) = self.stack.pop() {
            if here.tnear > self.farthest {
                continue;
            }
            // Turned boxes are for single rays: a packet keeps together along the axes of the scene.
            let is_in_turned_page =
                matches!(Step::of(here.link), Step::NODE | Step::STRIP) && view.header().is_turned();
            if here.active.count_ones() <= FEW || is_in_turned_page {
                self.go_on_alone(s, pages, single, (page, view), &here)?;
                self.farthest = self.farthest_limit(s);
                continue;
            }
            let number = (here.link & 0xFFFF) as usize;
            match Step::of(here.link) {
                Step::TOP => {
                    let node = &pages.top_nodes()[(here.link & !TopNode::KIND) as usize];
                    let planes = Planes::of_top_node(s, node, &slack, &self.rays[0]);
                    self.push(s, &planes, here.active, node.child_count(), |i| node.child[i]);
                }
                Step::ENTER => {
                    let entry = pages.top_entry(here.link & !TopNode::KIND);
                    page = entry.page;
                    view = pages.page(page).ok_or(page)?;
                    self.best.iter_mut().for_each(|best| best.locator = Locator::page(page));
                    self.stack.push(Waiting { link: entry.node, ..here });
                }
                Step::NODE => {
                    let node = &view.nodes()[number];
                    let planes = Planes::of_page_node(s, node, view.header(), &self.rays[0]);
                    let first = first_link(node);
                    let link = |i: usize| first + i as u32;
                    self.push(s, &planes, here.active, node.child_count(), link);
                }
                _ => {
                    self.test_strip(s, pages, &view, &here);
                    self.farthest = self.farthest_limit(s);
                }
            }
        }
        Ok(())
    }

    /// Single rays through what waits.
    #[inline(always)]
    fn go_on_alone<'s, S: Simd>(
        &mut self,
        s: S,
        pages: impl Pages<'s>,
        single: &mut Walk<'s, false>,
        page: (PageId, PageView<'s>),
        here: &Waiting,
    ) -> Result<(), PageId> {
        for i in bits(here.active) {
            single.resume(s, pages, &self.rays[i], self.best[i].hit, page, here.link);
            single.finish(s, pages)?;
            self.best[i].hit = single.best();
            self.limit[i] = self.best[i].hit.t;
        }
        Ok(())
    }

    /// Tests a strip of the page against the active rays.
    #[inline(always)]
    fn test_strip<'s, S: Simd>(&mut self, s: S, pages: impl Pages<'s>, page: &PageView, here: &Waiting) {
        let cluster = page.cluster((here.link >> 16 & 0xFF) as usize);
        let number = (here.link & 0xFFFF) as usize;
        let is_long = page.header().max_windows > 1;
        if let Some([head, refs @ ..]) = page.window_record(number) {
            self.candidates.decode(s, WindowHead(*head), refs, &cluster);
        } else if let Some(strand) = page.strand(number) {
            self.candidates.decode_strand(s, strand, &cluster);
        }
        for i in bits(here.active) {
            let (ray, best) = (&self.rays[i], &mut self.best[i]);
            best.locator = best.locator.with_strip(here.link & 0xFF_FFFF);
            if !is_long {
                self.candidates.test(s, ray);
                let head = self.candidates.head;
                self.candidates.meet(s, ray, |hit| {
                    if !head.is_strand() || opacity::stops(pages, &cluster, number, ray, &hit) {
                        best.hit(head, false, 0, hit);
                    }
                });
            } else {
                let grid = RayGrid::of_page(s, page.header(), ray);
                test_long_strip(s, ray, &grid, &cluster, &page.strip(number), best);
            }
            self.limit[i] = best.hit.t;
        }
    }

    fn begin(&mut self, rays: &[Ray]) {
        self.rays.clear();
        self.best.clear();
        self.rays.extend(rays.iter().map(PreparedRay::new));
        self.best.extend(rays.iter().map(|ray| Best::new(ray.tfar)));
        for i in 0..PACKET {
            let ray = self.rays.get(i).unwrap_or(&self.rays[0]);
            (0..3).for_each(|axis| self.inv_dir[axis][i] = ray.inv_dir[axis]);
            self.tnear[i] = ray.tnear;
            self.limit[i] = rays.get(i).map_or(f32::NEG_INFINITY, |ray| ray.tfar);
        }
    }

    /// Up to where hits still matter for any ray.
    #[inline(always)]
    fn farthest_limit<S: Simd>(&self, s: S) -> f32 {
        let mut farthest = s.splat(f32::NEG_INFINITY);
        for eight in self.limit.as_chunks().0 {
            farthest = s.max(s.load(eight), farthest);
        }
        s.store(farthest).into_iter().fold(f32::NEG_INFINITY, f32::max)
    }

    /// Puts the children of a node that active rays meet on the stack, the nearest on top.
    #[inline(always)]
    fn push<S: Simd>(
        &mut self,
        s: S,
        planes: &Planes<S::F>,
        active: u64,
        count: usize,
        link: impl Fn(usize) -> u32,
    ) {
        let (tnear, mask) = self.interval.slabs(s, planes, self.farthest);
        let Planes { lo: [x0, y0, z0], hi: [x1, y1, z1] } = *planes;
        let (lo, hi) = ([s.store(x0), s.store(y0), s.store(z0)], [s.store(x1), s.store(y1), s.store(z1)]);
        let first = self.stack.len();
        for i in bits(u64::from(mask) & ((1 << count) - 1)).map(|i| i % WIDTH) {
            let active = active
                & self.rays_that_meet(s, [lo[0][i], lo[1][i], lo[2][i]], [hi[0][i], hi[1][i], hi[2][i]]);
            if active != 0 {
                let new = Waiting { tnear: tnear[i], link: link(i), active };
                let behind = self.stack[first..].iter().take_while(|w| w.tnear >= new.tnear).count();
                self.stack.insert(first + behind, new);
            }
        }
    }

    /// The rays that meet the box with these planes.
    #[inline(always)]
    fn rays_that_meet<S: Simd>(&self, s: S, lo: [f32; 3], hi: [f32; 3]) -> u64 {
        let eights = |all: &[f32; PACKET], k: usize| all.as_chunks::<LANES>().0[k];
        let mut met = 0;
        for k in 0..PACKET / LANES {
            let (mut tnear, mut tfar) = (s.load(&eights(&self.tnear, k)), s.load(&eights(&self.limit, k)));
            for axis in 0..3 {
                let inv_dir = s.load(&eights(&self.inv_dir[axis], k));
                let (lo, hi) = (s.mul(s.splat(lo[axis]), inv_dir), s.mul(s.splat(hi[axis]), inv_dir));
                tnear = s.max(s.min(lo, hi), tnear);
                tfar = s.min(s.max(lo, hi), tfar);
            }
            met |= u64::from(s.le(tnear, tfar)) << (LANES * k);
        }
        met
    }
}

/// Sizes of directions whose products with distances in a scene are finite.
const SIZES: std::ops::Range<f32> = 1e-12..1e12;

/// True for rays with the same finite origin and the same signs of direction.
fn is_coherent(rays: &[Ray]) -> bool {
    let Some(first) = rays.first() else { return false };
    let signs = first.dir.is_negative_bitmask();
    let fits = |ray: &Ray| {
        ray.is_valid()
            && ray.org == first.org
            && ray.dir.is_negative_bitmask() == signs
            && ray.tnear >= 0.0
            && SIZES.contains(&ray.dir.abs().max_element())
    };
    rays.len() <= PACKET && rays.iter().all(fits)
}

/// Least and greatest inverse direction of a packet, by axis.
struct Interval {
    least: [f32; 3],
    greatest: [f32; 3],
}

impl Interval {
    fn of(inv_dir: &[[f32; PACKET]; 3]) -> Interval {
        let fold =
            |f: fn(f32, f32) -> f32| [0, 1, 2].map(|i| inv_dir[i].iter().copied().fold(inv_dir[i][0], f));
        Interval { least: fold(f32::min), greatest: fold(f32::max) }
    }

    /// Before what distance no ray enters each box, and which boxes some ray may meet before `limit`.
    #[inline(always)]
    fn slabs<S: Simd>(&self, s: S, planes: &Planes<S::F>, limit: f32) -> ([f32; LANES], u32) {
        let (mut tnear, mut tfar) = (s.splat(0.0), s.splat(limit));
        for axis in 0..3 {
            let (least, greatest) = (s.splat(self.least[axis]), s.splat(self.greatest[axis]));
            let (lo, hi) = (planes.lo[axis], planes.hi[axis]);
            let (a, b) = (s.mul(lo, least), s.mul(lo, greatest));
            let (c, d) = (s.mul(hi, least), s.mul(hi, greatest));
            tnear = s.max(s.min(s.min(a, b), s.min(c, d)), tnear);
            tfar = s.min(s.max(s.max(a, b), s.max(c, d)), tfar);
        }
        (s.store(tnear), s.le(tnear, tfar))
    }
}

/// The places of the bits that are set.
#[inline(always)]
fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (place < 64).then_some(place)
    })
}
