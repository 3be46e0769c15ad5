//! A ray on its way through a scene, one step at a time.
//!
//! A walk goes down the nodes above the pages, then those of each page it enters. To enter an instance it moves into the
//! coordinates of what that shows, where distances along the ray stay what they are, and goes down from the root there.
//! Between two steps everything it needs is in it, so that one thread can take many walks by turns ([`crate::stream`]).

use crate::boxes::{RayGrid, page_slabs, top_slabs, top_slack};
use crate::opacity;
use crate::pages::Pages;
use crate::placed;
use crate::prepared::PreparedRay;
use crate::rays::{Place, WaitingRay};
use crate::scene::Locator;
use crate::simd::{LANES, Simd, greatest_key};
use crate::stream::Stopped;
use crate::strip::{StripHits, test_long_strip};
use crate::window::{Candidates, WindowHit};
use raystrips_geom::strip::{WINDOW_TRIANGLES, strip_is_reversed};
use raystrips_geom::{Hit, Ray};
use raystrips_pack::layout::{MAX_DEPTH, TopNode, WIDTH, WideNode};
use raystrips_pack::{PageId, PageView, WindowHead};

/// What a walk does next: the three highest bits of what waits, its *link*. The bits below say where.
pub(crate) struct Step;

impl Step {
    /// Test the boxes of a node of the page; 16 bits are its number.
    pub const NODE: usize = 0;
    /// Test the boxes of a node above the pages.
    pub const TOP: usize = Step::of(TopNode::NODE);
    /// Enter a page.
    pub const ENTER: usize = Step::of(TopNode::ENTRY);
    /// Enter an instance.
    pub const INSTANCE: usize = Step::of(TopNode::INSTANCE);
    /// Test a strip of the page; eight bits are the number of its cluster, 16 its own.
    pub const STRIP: usize = 4;
    /// Leave an instance, where all that is to be looked into has been.
    pub const LEAVE: usize = 5;
    /// Nothing: the walk is over.
    pub const DONE: usize = 6;
    /// Kinds of steps.
    pub const COUNT: usize = 7;

    #[inline(always)]
    pub const fn of(link: u32) -> usize {
        (link >> 29) as usize
    }
}

const DONE_LINK: u32 = (Step::DONE as u32) << 29;
const STRIP_LINK: u32 = (Step::STRIP as u32) << 29;
const LEAVE_LINK: u32 = (Step::LEAVE as u32) << 29;

/// Subtrees that wait, the nearest of each node on top; at the bottom the end of the walk.
#[derive(Debug)]
struct Stack {
    len: usize,
    keys: [u32; Stack::SLOTS],
    links: [u32; Stack::SLOTS],
}

impl Stack {
    /// Each level above the pages, also in instances, and in a page, whose depths are checked apart, leaves at most one
    /// less than the width of a node; the last one is written as a whole. Beside that there are the ends of the walk and
    /// of an instance.
    const SLOTS: usize = 2 * MAX_DEPTH * (WIDTH - 1) + LANES + 2;

    fn new() -> Stack {
        let mut stack = Stack { len: 1, keys: [0; Stack::SLOTS], links: [0; Stack::SLOTS] };
        stack.links[0] = DONE_LINK;
        stack
    }

    /// Takes away the nearest waiting subtree that is met before the limit.
    #[inline(always)]
    fn pop(&mut self, greatest_key: u32) -> u32 {
        loop {
            self.len -= 1;
            if self.keys[self.len] <= greatest_key {
                return self.links[self.len];
            }
        }
    }

    #[inline(always)]
    fn push(&mut self, key: u32, link: u32) {
        self.keys[self.len] = key;
        self.links[self.len] = link;
        self.len += 1;
    }

    /// Room for the boxes of a node.
    #[inline(always)]
    fn room(&mut self) -> (&mut [u32; LANES], &mut [u32; LANES]) {
        let keys = (&mut self.keys[self.len..self.len + LANES]).try_into();
        let links = (&mut self.links[self.len..self.len + LANES]).try_into();
        (keys.expect("eight of eight"), links.expect("eight of eight"))
    }
}

/// A ray on its way. With `ANY`, the first hit ends the walk.
pub(crate) struct Walk<'s, const ANY: bool> {
    ray: PreparedRay,
    best: Best<ANY>,
    /// What is next.
    link: u32,
    page: PageView<'s>,
    page_grid: RayGrid,
    top_slack: [f32; LANES],
    waiting: Stack,
    /// In an instance, the ray outside of it.
    outside: PreparedRay,
}

impl<'s, const ANY: bool> Walk<'s, ANY> {
    /// A walk that is over.
    pub fn idle(pages: impl Pages<'s>) -> Walk<'s, ANY> {
        let ray = PreparedRay::new(&Ray::new(glam::Vec3::ZERO, glam::Vec3::X));
        Walk {
            ray,
            best: Best::new(f32::INFINITY),
            link: DONE_LINK,
            page: pages.some_page(),
            page_grid: RayGrid::NONE,
            top_slack: [0.0; LANES],
            waiting: Stack::new(),
            outside: ray,
        }
    }

    /// Begins with another ray, which must be [valid](Ray::is_valid): the next step is [`Step::TOP`].
    #[inline(always)]
    pub fn begin<S: Simd>(&mut self, s: S, pages: impl Pages<'s>, ray: &Ray) {
        let prepared = PreparedRay::new(ray);
        // From the ray in registers: what was just stored in parts is slow to load as a whole.
        self.top_slack = slack_in(s, pages, Hit::NO_INSTANCE, &prepared);
        self.ray = prepared;
        self.best = Best::new(ray.tfar);
        self.link = TopNode::NODE;
        self.waiting.len = 1;
    }

    /// Goes on for another ray with what waits at `link` in page number `page`.
    #[inline(always)]
    pub fn resume<S: Simd>(
        &mut self,
        s: S,
        pages: impl Pages<'s>,
        ray: &PreparedRay,
        best: Hit,
        (page, view): (PageId, PageView<'s>),
        link: u32,
    ) {
        self.ray = *ray;
        self.best = Best { hit: best, ..Best::new(best.t) };
        self.best.locator = Locator::page(page);
        self.top_slack = slack_in(s, pages, Hit::NO_INSTANCE, ray);
        self.page = view;
        self.page_grid = RayGrid::of_page(s, self.page.header(), ray);
        self.link = link;
        self.waiting.len = 1;
    }

    /// Goes on for a ray that was set aside above the pages.
    #[inline(always)]
    pub fn wake<S: Simd>(&mut self, s: S, pages: impl Pages<'s>, waiting: &WaitingRay) {
        self.begin(s, pages, waiting.ray);
        let Place { best, link, instance } = waiting.place;
        if link != TopNode::NODE {
            self.recover_stack(s, pages, link, instance);
        }
        self.link = link;
        if best.is_hit() {
            self.best.hit = best;
            self.best.greatest_key = greatest_key(best.t);
        }
    }

    /// Finds again what waits behind `link`: of each node above it, the children that are farther than the one that leads
    /// there. Some may be behind the hit by now; they go when it is their turn.
    #[inline(always)]
    fn recover_stack<S: Simd>(&mut self, s: S, pages: impl Pages<'s>, link: u32, instance: u32) {
        let root = pages.instances().get(instance as usize).map(|instance| TopNode::NODE | instance.root);
        let mut way = [link; MAX_DEPTH + 2];
        let mut len = 1;
        while way[len - 1] != TopNode::NODE {
            way[len] = match way[len - 1] {
                here if Some(here) == root => TopNode::INSTANCE | instance,
                here => TopNode::NODE | pages.parent(here),
            };
            len += 1;
        }
        for step in (1..len).rev() {
            self.link = way[step];
            if self.step() == Step::INSTANCE {
                self.enter_instance(s, pages);
                continue;
            }
            let begin = self.waiting.len;
            self.step_top(s, pages);
            let met = &self.waiting.links[begin..self.waiting.len];
            // Only a ray of another scene would not meet it again.
            let farther = met.iter().position(|&child| child == way[step - 1]).unwrap_or(met.len());
            self.waiting.len = begin + farther;
        }
    }

    /// What is next.
    pub fn link(&self) -> u32 {
        self.link
    }

    /// The page that it is in.
    pub fn page(&self) -> PageId {
        self.best.locator.page_id()
    }

    /// The page that is entered next, when the next step is [`Step::ENTER`].
    #[inline(always)]
    pub fn page_ahead(&self, pages: impl Pages<'s>) -> PageId {
        pages.top_entry(self.link & !TopNode::KIND).page
    }

    /// Takes all steps to the end.
    ///
    /// # Errors
    /// The page that is needed and is not in memory.
    #[inline(always)]
    pub fn finish<S: Simd>(&mut self, s: S, pages: impl Pages<'s>) -> Result<(), PageId> {
        let mut step = Step::of(self.link);
        let mut candidates = Candidates::NONE;
        loop {
            pages.before_step(self);
            match step {
                Step::NODE => self.step_node(s),
                Step::STRIP => {
                    if self.step_strip(s, &mut candidates) {
                        self.meet(s, pages, &candidates);
                    }
                }
                Step::TOP => self.step_top(s, pages),
                Step::INSTANCE => {
                    if self.enter_instance(s, pages) {
                        self.step_top(s, pages);
                    }
                }
                Step::LEAVE => self.leave_instance(s, pages),
                Step::ENTER => {
                    if !self.enter(s, pages) {
                        return Err(self.page_ahead(pages));
                    }
                    self.step_node(s);
                }
                _ => return Ok(()),
            }
            step = self.next();
        }
    }

    /// The kind of the next step.
    #[inline(always)]
    pub fn step(&self) -> usize {
        Step::of(self.link)
    }

    /// Where it stops, when the next step is [`Step::ENTER`] and cannot be taken.
    pub fn stopped(&self, pages: impl Pages<'s>) -> Stopped {
        Stopped {
            page: self.page_ahead(pages),
            place: Place { best: self.hit(), link: self.link, instance: self.best.instance },
        }
    }

    /// What was found, once the walk is over.
    #[inline(always)]
    pub fn hit(&self) -> Hit {
        if self.best.hit.is_hit() { self.best.hit } else { Hit::MISS }
    }

    /// The hit so far; a distance without a triangle is up to where one would matter.
    #[inline(always)]
    pub fn best(&self) -> Hit {
        self.best.hit
    }

    /// [`Step::TOP`].
    #[inline(always)]
    pub fn step_top<S: Simd>(&mut self, s: S, pages: impl Pages<'s>) {
        let node = &pages.top_nodes()[(self.link & !TopNode::KIND) as usize];
        let slabs = top_slabs(s, node, &self.top_slack, &self.ray, self.best.hit.t);
        let links = s.load_words(&node.child);
        self.waiting.len += s.store_sorted(slabs, node.child_count(), links, self.waiting.room());
    }

    /// [`Step::INSTANCE`]: the next step is [`Step::TOP`]. False, and nothing done, if the ray is none there.
    #[inline(always)]
    pub fn enter_instance<S: Simd>(&mut self, s: S, pages: impl Pages<'s>) -> bool {
        let number = self.link & !TopNode::KIND;
        let instance = &pages.instances()[number as usize];
        let Some(local) = placed::local_ray(instance, &self.ray) else { return false };
        self.outside = self.ray;
        self.ray = PreparedRay::new(&local);
        self.top_slack = slack_in(s, pages, number, &self.ray);
        self.best.instance = number;
        // Whatever the limit becomes, the way out is not passed over.
        self.waiting.push(0, LEAVE_LINK);
        self.link = TopNode::NODE | instance.root;
        true
    }

    /// [`Step::LEAVE`].
    #[inline(always)]
    pub fn leave_instance<S: Simd>(&mut self, s: S, pages: impl Pages<'s>) {
        self.ray = self.outside;
        self.top_slack = slack_in(s, pages, Hit::NO_INSTANCE, &self.ray);
        self.best.instance = Hit::NO_INSTANCE;
    }

    /// [`Step::ENTER`]: the next step is [`Step::NODE`]. False, and nothing done, if the page is not in memory.
    #[inline(always)]
    pub fn enter<S: Simd>(&mut self, s: S, pages: impl Pages<'s>) -> bool {
        let entry = pages.top_entry(self.link & !TopNode::KIND);
        let Some(page) = pages.page(entry.page) else { return false };
        self.page = page;
        self.page_grid = RayGrid::of_page(s, self.page.header(), &self.ray);
        self.best.locator = Locator::page(entry.page);
        self.link = entry.node;
        true
    }

    /// [`Step::NODE`].
    #[inline(always)]
    pub fn step_node<S: Simd>(&mut self, s: S) {
        let node = &self.page.nodes()[self.link as usize];
        let slabs = page_slabs(s, node, &self.page_grid, &self.ray, self.best.hit.t);
        let links = s.count_from(first_link(node));
        self.waiting.len += s.store_sorted(slabs, node.child_count(), links, self.waiting.room());
    }

    /// The first part of [`Step::STRIP`]: finds candidates, and whether there are any for the second part.
    #[inline(always)]
    pub fn step_strip<S: Simd>(&self, s: S, candidates: &mut Candidates) -> bool {
        let cluster = self.page.cluster((self.link >> 16 & 0xFF) as usize);
        let number = (self.link & 0xFFFF) as usize;
        if let Some([head, refs @ ..]) = self.page.window_record(number) {
            candidates.find(s, &self.ray, WindowHead(*head), refs, &cluster);
        } else if let Some(strand) = self.page.strand(number) {
            candidates.decode_strand(s, strand, &cluster);
            candidates.test(s, &self.ray);
        } else {
            return true;
        }
        candidates.mask != 0
    }

    /// The second part of [`Step::STRIP`].
    #[inline(always)]
    pub fn meet<S: Simd>(&mut self, s: S, pages: impl Pages<'s>, candidates: &Candidates) {
        let number = (self.link & 0xFFFF) as usize;
        let best = &mut self.best;
        best.locator = best.locator.with_strip(self.link & 0xFF_FFFF);
        let cluster = self.page.cluster((self.link >> 16 & 0xFF) as usize);
        match self.page.header().max_windows {
            0 | 1 => candidates.meet(s, &self.ray, |hit| {
                let head = candidates.head;
                if !head.is_strand() || opacity::stops(pages, &cluster, number, &self.ray, &hit) {
                    best.hit(head, false, 0, hit);
                }
            }),
            _ => {
                let strip = self.page.strip(number);
                test_long_strip(s, &self.ray, &self.page_grid, &cluster, &strip, best);
            }
        }
        if ANY && self.best.hit.is_hit() {
            self.waiting.len = 1;
        }
    }

    /// Chooses the next [`Step`].
    #[inline(always)]
    pub fn next(&mut self) -> usize {
        self.link = self.waiting.pop(self.best.greatest_key);
        Step::of(self.link)
    }

    /// Asks for the memory of the next step if it is a node's or a strip's.
    #[inline(always)]
    pub fn prefetch<S: Simd>(&self, s: S) {
        let nodes: &[u8] = bytemuck::cast_slice(self.page.nodes());
        let number = (self.link & 0xFFFF) as usize;
        // No branch: nobody can foretell which it is.
        let (bytes, size) = match self.link & STRIP_LINK {
            0 => (nodes, size_of::<WideNode>()),
            _ => self.page.records(),
        };
        if let Some(byte) = bytes.get(number * size) {
            s.prefetch(byte);
        }
    }

    /// Asks for the vertices of the strip that is next.
    #[inline(always)]
    pub fn prefetch_vertices<S: Simd>(&self, s: S) {
        let cluster = self.page.cluster((self.link >> 16 & 0xFF) as usize);
        let number = (self.link & 0xFFFF) as usize;
        if let Some([_, refs @ ..]) = self.page.window_record(number) {
            s.prefetch_vertices(cluster.vertex_bytes(), cluster.vertex_code(), refs);
        } else if let Some(strand) = self.page.strand(number) {
            cluster.pair(strand).first().into_iter().for_each(|byte| s.prefetch(byte));
        }
    }
}

/// The slack of nodes above the pages in what an instance shows, or in the scene outside of all.
#[inline(always)]
pub(crate) fn slack_in<'s, S: Simd>(
    s: S,
    pages: impl Pages<'s>,
    instance: u32,
    ray: &PreparedRay,
) -> [f32; LANES] {
    let (root, condition) = match pages.instances().get(instance as usize) {
        Some(instance) => (instance.root, 1.0),
        None => (0, pages.condition()),
    };
    top_slack(s, &pages.top_nodes()[root as usize], ray, condition)
}

/// The link of a node's first child; those of the others count up from there.
#[inline(always)]
pub(crate) fn first_link(node: &WideNode) -> u32 {
    // `first`, `cluster` and `count` are the fourth word: the count goes, the bit that tells strips stays, and is that
    // of [`Step::STRIP`].
    let words: &[u32; 16] = bytemuck::cast_ref(node);
    words[3] & (STRIP_LINK | 0xFF_FFFF)
}

/// The best hit so far.
pub(crate) struct Best<const ANY: bool> {
    pub hit: Hit,
    /// That of its distance.
    greatest_key: u32,
    /// Where the ray is.
    instance: u32,
    pub locator: Locator,
}

impl<const ANY: bool> Best<ANY> {
    #[inline(always)]
    pub fn new(tfar: f32) -> Best<ANY> {
        let hit = Hit { t: tfar, ..Hit::MISS };
        let instance = Hit::NO_INSTANCE;
        Best { hit, greatest_key: greatest_key(tfar), instance, locator: Locator::page(0) }
    }
}

impl<const ANY: bool> StripHits for Best<ANY> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.hit.t
    }

    #[inline(always)]
    fn hit(&mut self, head: WindowHead, reversed: bool, window: usize, found: WindowHit) {
        let prim_id = self.locator.with_triangle(window * WINDOW_TRIANGLES + found.triangle).0;
        let is_before = || (self.instance, prim_id) < (self.hit.instance, self.hit.prim_id);
        if found.t < self.hit.t || (found.t == self.hit.t && is_before()) {
            let reversed =
                !head.is_strand() && reversed != strip_is_reversed(&[head.turns()], found.triangle);
            let (u, v) = if reversed { (found.v, found.u) } else { (found.u, found.v) };
            self.hit = Hit { t: found.t, u, v, instance: self.instance, prim_id };
            self.greatest_key = greatest_key(found.t);
        }
    }
}
