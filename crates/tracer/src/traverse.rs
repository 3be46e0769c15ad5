//! A ray down the nodes: those above the pages, then those of each page it enters.

use crate::boxes::{BoxHits, RayGrid, Slack, test_boxes};
use crate::prepared::PreparedRay;
use crate::scene::{Locator, Scene};
use crate::simd::{LANES, Simd};
use crate::strip::{StripHits, test_strip};
use crate::window::WindowHit;
use raystrips_geom::strip::strip_is_reversed;
use raystrips_geom::{Hit, Ray};
use raystrips_pack::layout::{TopNode, WideNode};
use raystrips_pack::{PageView, StripView};

/// Subtrees that wait, those met last at the bottom: about, which costs no more than the visits that a later hit
/// makes unnecessary, while sorting would cost a wrong guess of the processor in every other node.
#[derive(Debug)]
struct Stack {
    /// Where the ray enters each.
    tnear: Vec<f32>,
    child: Vec<u32>,
    len: usize,
}

impl Stack {
    fn for_depth(depth: usize) -> Stack {
        let most = depth * (LANES - 1) + 1 + LANES;
        Stack { tnear: vec![0.0; most], child: vec![0; most], len: 0 }
    }

    /// Only `child` waits.
    #[inline(always)]
    fn reset(&mut self, tnear: f32, child: u32) {
        self.tnear[0] = tnear;
        self.child[0] = child;
        self.len = 1;
    }

    /// All lanes are written, of which those that were hit count.
    #[inline(always)]
    fn push<S: Simd>(&mut self, s: S, hits: BoxHits<S>) {
        self.tnear[self.len..self.len + LANES].copy_from_slice(&s.store(hits.tnear));
        self.child[self.len..self.len + LANES].copy_from_slice(&s.store_words(hits.child));
        self.len += hits.count;
    }

    /// The nearest waiting subtree that is met before `limit`.
    #[inline(always)]
    fn pop(&mut self, limit: f32) -> Option<(f32, u32)> {
        while self.len > 0 {
            self.len -= 1;
            let tnear = self.tnear[self.len];
            if tnear <= limit {
                return Some((tnear, self.child[self.len]));
            }
        }
        None
    }
}

/// The memory of a traversal, kept from ray to ray.
#[derive(Debug)]
pub(crate) struct Stacks {
    top: Stack,
    page: Stack,
}

impl Stacks {
    /// Stacks that are large enough for `scene`.
    pub fn for_scene(scene: &Scene) -> Stacks {
        Stacks { top: Stack::for_depth(scene.depth()), page: Stack::for_depth(scene.depth()) }
    }
}

/// The best hit so far. With `ANY`, the first one ends the search.
struct Best<const ANY: bool> {
    hit: Hit,
    locator: Locator,
}

impl<const ANY: bool> Best<ANY> {
    fn done(&self) -> bool {
        ANY && self.hit.is_hit()
    }
}

impl<const ANY: bool> StripHits for Best<ANY> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.hit.t
    }

    #[inline(always)]
    fn hit(&mut self, strip: &StripView, found: WindowHit, entry: f32) {
        // Not before the entry into any box around it: see the crate's second promise.
        let t = if found.t < entry { entry } else { found.t };
        let prim_id = self.locator.with_triangle(found.triangle).0;
        if t < self.hit.t || (t == self.hit.t && prim_id < self.hit.prim_id) {
            let (u, v) = if strip_is_reversed(strip.turns(), found.triangle) {
                (found.v, found.u)
            } else {
                (found.u, found.v)
            };
            self.hit = Hit { t, u, v, prim_id };
        }
    }
}

/// The nearest hit of `ray`; with `ANY`, some hit.
#[inline(always)]
pub(crate) fn trace<S: Simd, const ANY: bool>(s: S, scene: &Scene, stacks: &mut Stacks, ray: &Ray) -> Hit {
    let ray = PreparedRay::new(ray);
    let mut best = Best::<ANY> { hit: Hit { t: ray.tfar, ..Hit::MISS }, locator: Locator(0) };
    let nodes = scene.top_nodes();
    let slack = Slack::below(&nodes[0].boxes, &ray);
    stacks.top.reset(ray.tnear, 0);
    while let Some((tnear, child)) = stacks.top.pop(best.hit.t) {
        if child & TopNode::ENTRY == 0 {
            let node = &nodes[child as usize];
            stacks
                .top
                .push(s, test_boxes(s, &node.boxes, s.words(&node.child), &ray, &slack, tnear, best.hit.t));
        } else if child != TopNode::EMPTY {
            let entry = scene.top_entry(child & !TopNode::ENTRY);
            best.locator = Locator::page(entry.page);
            let page = scene.page(entry.page);
            trace_page(s, &page, entry.node as u16, tnear, &ray, &mut stacks.page, &mut best);
            if best.done() {
                break;
            }
        }
    }
    if best.hit.is_hit() { best.hit } else { Hit::MISS }
}

/// Traces through the subtree at `root` of a page.
#[inline(always)]
fn trace_page<S: Simd, const ANY: bool>(
    s: S,
    page: &PageView,
    root: u16,
    entry: f32,
    ray: &PreparedRay,
    stack: &mut Stack,
    best: &mut Best<ANY>,
) {
    let nodes = page.nodes();
    let slack = Slack::below(&nodes[usize::from(root)].boxes, ray);
    let mut current = None;
    stack.reset(entry, u32::from(root));
    while let Some((tnear, word)) = stack.pop(best.hit.t) {
        // The node that holds the child, and the child.
        let (holder, child) = ((word >> 16) as usize, word as u16);
        if child & WideNode::LEAF == 0 {
            let node = &nodes[usize::from(child)];
            let children = s.half_words(&node.child, child);
            stack.push(s, test_boxes(s, &node.boxes, children, ray, &slack, tnear, best.hit.t));
        } else if child != WideNode::EMPTY {
            let boxes = &nodes[holder].boxes;
            let cluster = match current {
                Some((number, cluster)) if number == boxes.cluster => cluster,
                _ => page.cluster(usize::from(boxes.cluster)),
            };
            current = Some((boxes.cluster, cluster));
            let offset = child & !WideNode::LEAF;
            let strip = cluster.strip(usize::from(offset));
            best.locator = best.locator.with_strip(boxes.cluster, offset);
            test_strip(s, ray, || RayGrid::new(boxes, ray, &slack), &strip, cluster.points(), tnear, best);
            if best.done() {
                return;
            }
        }
    }
}
