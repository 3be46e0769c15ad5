//! Many walks by turns.
//!
//! One ray is a chain of steps that wait for each other, for memory, and for branches that nobody can foretell.
//! Here a thread has a few dozen walks under way and takes the same kind of step for many of them in a row: the
//! steps of different walks overlap in the processor, the memory of each was asked for a turn ago, and which
//! kind of step comes next is not a branch but a list to append to.

use crate::scene::Scene;
use crate::simd::Simd;
use crate::walk::{Step, Walk};
use crate::window::Candidates;
use raystrips_geom::{Hit, Ray};

/// Walks under way.
pub(crate) const WALKS: usize = 32;
/// Walks that wait for a kind of step before it is taken although others could be.
const ENOUGH: usize = WALKS / 4;

/// Walks that wait for the same kind of step.
#[derive(Clone, Copy)]
struct List {
    walks: [u8; WALKS],
    len: usize,
}

impl List {
    const EMPTY: List = List { walks: [0; WALKS], len: 0 };

    #[inline(always)]
    fn push(&mut self, walk: usize) {
        self.walks[self.len] = walk as u8;
        self.len += 1;
    }

    /// Appends `walk` if `condition` holds, without a branch.
    #[inline(always)]
    fn push_if(&mut self, walk: usize, condition: bool) {
        self.walks[self.len % WALKS] = walk as u8;
        self.len += usize::from(condition);
    }

    /// The walks, of which none waits any more.
    #[inline(always)]
    fn take(&mut self) -> List {
        std::mem::replace(self, List { len: 0, ..*self })
    }

    #[inline(always)]
    fn iter(&self) -> impl Iterator<Item = usize> {
        self.walks[..self.len].iter().map(|&i| usize::from(i) % WALKS)
    }
}

/// Rays that wait for a walk, with their numbers. Those that cannot be traced miss at once.
struct Rays<'r> {
    rays: std::iter::Enumerate<std::slice::Iter<'r, Ray>>,
}

impl<'r> Rays<'r> {
    #[inline(always)]
    fn next(&mut self, done: &mut dyn FnMut(usize, Hit)) -> Option<(usize, &'r Ray)> {
        loop {
            match self.rays.next() {
                Some((number, ray)) if !ray.is_valid() => done(number, Hit::MISS),
                next => return next,
            }
        }
    }
}

/// Traces `rays` with `walks`, [`WALKS`] of them, and tells `done` the number of each ray and its hit, in any order.
#[inline(always)]
pub(crate) fn trace_stream<'s, S: Simd, const ANY: bool>(
    s: S,
    scene: &'s Scene,
    walks: &mut [Walk<'s, ANY>; WALKS],
    rays: &[Ray],
    done: &mut dyn FnMut(usize, Hit),
) {
    let mut rays = Rays { rays: rays.iter().enumerate() };
    let mut ray_of = [0; WALKS];
    let mut lists = [List::EMPTY; Step::COUNT];
    let mut candidates = [Candidates::NONE; WALKS];
    for (i, walk) in walks.iter_mut().enumerate() {
        let Some((number, ray)) = rays.next(done) else { break };
        walk.begin(s, scene, ray);
        ray_of[i] = number;
        lists[Step::TOP].push(i);
    }
    loop {
        // Nodes are tested whenever there are any; the others when many wait or nothing else is left to do.
        let enough = if lists[Step::NODE].len > 0 { ENOUGH } else { 1 };
        if lists[Step::DONE].len >= enough {
            for i in lists[Step::DONE].take().iter() {
                done(ray_of[i], walks[i].hit());
                if let Some((number, ray)) = rays.next(done) {
                    walks[i].begin(s, scene, ray);
                    ray_of[i] = number;
                    lists[Step::TOP].push(i);
                }
            }
        }
        if lists[Step::TOP].len >= enough {
            // What was just stored as a vector is slow to load in parts, so that comes after all nodes.
            let top = lists[Step::TOP].take();
            for i in top.iter() {
                walks[i].step_top(s, scene);
            }
            for i in top.iter() {
                sort_in(s, i, walks, &mut lists);
            }
        }
        if lists[Step::ENTER].len >= enough {
            for i in lists[Step::ENTER].take().iter() {
                walks[i].enter(s, scene);
                walks[i].prefetch(s);
                lists[Step::NODE].push(i);
            }
        }
        let nodes = lists[Step::NODE].take();
        for i in nodes.iter() {
            walks[i].step_node(s);
        }
        for i in nodes.iter() {
            sort_in(s, i, walks, &mut lists);
        }
        if lists[Step::STRIP].len >= enough {
            let strips = lists[Step::STRIP].take();
            test_strips(s, walks, &strips, &mut candidates);
            for i in strips.iter() {
                sort_in(s, i, walks, &mut lists);
            }
        }
        if lists.iter().all(|list| list.len == 0) {
            return;
        }
    }
}

/// Tests the strips that walks wait for, each kind of work for all of them before the next.
#[inline(always)]
fn test_strips<S: Simd, const ANY: bool>(
    s: S,
    walks: &mut [Walk<ANY>; WALKS],
    strips: &List,
    candidates: &mut [Candidates; WALKS],
) {
    for i in strips.iter() {
        walks[i].prefetch_vertices(s);
    }
    let mut met = List::EMPTY;
    for i in strips.iter() {
        // What has no candidates gives its place to the next.
        let has_candidates = walks[i].step_strip(s, &mut candidates[met.len % WALKS]);
        met.push_if(i, has_candidates);
    }
    for (i, candidates) in met.iter().zip(candidates) {
        walks[i].meet(s, candidates);
    }
}

/// Chooses the next step of walk number `i` and puts it into the list of that step.
#[inline(always)]
fn sort_in<S: Simd, const ANY: bool>(
    s: S,
    i: usize,
    walks: &mut [Walk<ANY>; WALKS],
    lists: &mut [List; Step::COUNT],
) {
    let next = walks[i].next();
    walks[i].prefetch(s);
    lists[next].push(i);
}
