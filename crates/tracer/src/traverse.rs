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

/// A subtree that waits, and where the ray is inside its box.
#[derive(Clone, Copy, Debug, Default)]
struct Waiting<Child> {
    tnear: f32,
    tfar: f32,
    /// Node that holds `child`.
    node: Child,
    child: Child,
}

/// Subtrees that wait, the nearest of each node on top.
#[derive(Debug)]
struct Stack<Child> {
    /// Of the greatest length that the scene can need.
    slots: Vec<Waiting<Child>>,
    len: usize,
}

impl<Child: Copy + Default + PartialEq> Stack<Child> {
    fn for_depth(depth: usize) -> Stack<Child> {
        Stack { slots: vec![Waiting::default(); depth * (LANES - 1) + 1], len: 0 }
    }

    /// The nearest waiting subtree that is met before `limit`.
    #[inline(always)]
    fn pop(&mut self, limit: f32) -> Option<Waiting<Child>> {
        while self.len > 0 {
            self.len -= 1;
            let here = self.slots[self.len];
            if here.tnear <= limit {
                return Some(here);
            }
        }
        None
    }

    /// Takes in `new` behind those above `first` that are nearer.
    #[inline(always)]
    fn insert(&mut self, first: usize, new: Waiting<Child>) {
        let mut place = self.len;
        self.len += 1;
        while place > first && self.slots[place - 1].tnear < new.tnear {
            self.slots[place] = self.slots[place - 1];
            place -= 1;
        }
        self.slots[place] = new;
    }

    /// The nearest of the children that were hit; the others wait.
    #[inline(always)]
    fn nearest_child(
        &mut self,
        hits: &BoxHits,
        node: Child,
        children: &[Child; LANES],
        empty: Child,
    ) -> Option<Waiting<Child>> {
        let waiting =
            |i: usize| Waiting { tnear: hits.tnear[i], tfar: hits.tfar[i], node, child: children[i] };
        let mut mask = hits.mask;
        if mask == 0 {
            return None;
        }
        let mut nearest = waiting(mask.trailing_zeros() as usize);
        // Inverted boxes of unused places are met where the slack is larger than the node; they come last.
        if nearest.child == empty {
            return None;
        }
        mask &= mask - 1;
        let first = self.len;
        while mask != 0 {
            let mut new = waiting(mask.trailing_zeros() as usize);
            mask &= mask - 1;
            if new.child == empty {
                break;
            }
            if new.tnear < nearest.tnear {
                std::mem::swap(&mut new, &mut nearest);
            }
            self.insert(first, new);
        }
        Some(nearest)
    }
}

/// The memory of a traversal, kept from ray to ray.
#[derive(Debug)]
pub(crate) struct Stacks {
    top: Stack<u32>,
    page: Stack<u16>,
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
    let stack = &mut stacks.top;
    stack.len = 0;
    let mut next = Some(Waiting { tnear: ray.tnear, tfar: ray.tfar, node: 0, child: 0 });
    while let Some(here) = next {
        next = if here.child & TopNode::ENTRY == 0 {
            let node = &nodes[here.child as usize];
            let hits = test_boxes(s, &node.boxes, &ray, &slack, here.tnear, best.hit.t);
            stack.nearest_child(&hits, here.child, &node.child, TopNode::EMPTY)
        } else {
            let entry = scene.top_entry(here.child & !TopNode::ENTRY);
            best.locator = Locator::page(entry.page);
            let page = scene.page(entry.page);
            trace_page(s, &page, entry.node as u16, here.tnear, &ray, &mut stacks.page, &mut best);
            if best.done() {
                break;
            }
            None
        };
        next = next.or_else(|| stack.pop(best.hit.t));
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
    stack: &mut Stack<u16>,
    best: &mut Best<ANY>,
) {
    let nodes = page.nodes();
    let slack = Slack::below(&nodes[usize::from(root)].boxes, ray);
    let mut current = None;
    stack.len = 0;
    let mut next = Some(Waiting { tnear: entry, tfar: ray.tfar, node: root, child: root });
    while let Some(here) = next {
        next = if here.child & WideNode::LEAF == 0 {
            let node = &nodes[usize::from(here.child)];
            let hits = test_boxes(s, &node.boxes, ray, &slack, here.tnear, best.hit.t);
            stack.nearest_child(&hits, here.child, &node.child, WideNode::EMPTY)
        } else {
            let boxes = &nodes[usize::from(here.node)].boxes;
            let cluster = match current {
                Some((number, cluster)) if number == boxes.cluster => cluster,
                _ => page.cluster(usize::from(boxes.cluster)),
            };
            current = Some((boxes.cluster, cluster));
            let offset = here.child & !WideNode::LEAF;
            let strip = cluster.strip(usize::from(offset));
            best.locator = best.locator.with_strip(boxes.cluster, offset);
            let range = (here.tnear, here.tfar);
            test_strip(s, ray, || RayGrid::new(boxes, ray, &slack), &strip, cluster.points(), range, best);
            if best.done() {
                return;
            }
            None
        };
        next = next.or_else(|| stack.pop(best.hit.t));
    }
}
