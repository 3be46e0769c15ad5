//! Many walks by turns.
//!
//! One ray is a chain of steps that wait for each other, for memory, and for branches that nobody can foretell.
//! Here a thread has a few dozen walks under way and takes the same kind of step for many of them in a row: the
//! steps of different walks overlap in the processor, the memory of each was asked for a turn ago, and which
//! kind of step comes next is not a branch but a list to append to.

use crate::pages::Pages;
use crate::rays::{Place, WaitingRay};
use crate::simd::Simd;
use crate::walk::{Step, Walk};
use crate::window::Candidates;
use raystrips_geom::{Hit, Ray};
use raystrips_pack::PageId;

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

/// A ray that gets a walk.
pub(crate) enum Start<'a> {
    /// From its beginning.
    Ray(&'a Ray),
    /// From where it was set aside.
    Waiting(WaitingRay<'a>),
}

/// Where a ray stopped on its way.
pub(crate) struct Stopped {
    /// The page that it needs and that is not in memory.
    pub page: PageId,
    pub place: Place,
}

/// Rays to be traced, by their numbers, and what becomes of them.
pub(crate) trait Jobs {
    /// The next ray, which must be [valid](Ray::is_valid).
    fn next(&mut self) -> Option<(usize, Start<'_>)>;

    /// Gets the hit of a ray.
    fn done(&mut self, number: usize, hit: Hit);

    /// Gets a ray that cannot go on.
    fn set_aside(&mut self, number: usize, stopped: Stopped);
}

/// No ray.
const NONE: usize = usize::MAX;

/// Traces the rays of `jobs` with `walks`, [`WALKS`] of them.
#[inline(always)]
pub(crate) fn trace_stream<'s, S: Simd, P: Pages<'s>, const ANY: bool>(
    s: S,
    pages: P,
    walks: &mut [Walk<'s, ANY>; WALKS],
    jobs: &mut dyn Jobs,
) {
    let mut ray_of = [NONE; WALKS];
    let mut lists = [List::EMPTY; Step::COUNT];
    let mut candidates = [Candidates::NONE; WALKS];
    (0..WALKS).for_each(|i| lists[Step::DONE].push(i));
    loop {
        // Nodes are tested whenever there are any; the others when many wait or nothing else is left to do.
        let enough = if lists[Step::NODE].len > 0 { ENOUGH } else { 1 };
        if lists[Step::DONE].len >= enough {
            for i in lists[Step::DONE].take().iter() {
                if ray_of[i] != NONE {
                    jobs.done(ray_of[i], walks[i].hit());
                    ray_of[i] = NONE;
                }
                match jobs.next() {
                    Some((number, Start::Ray(ray))) => {
                        walks[i].begin(s, pages, ray);
                        ray_of[i] = number;
                        lists[Step::TOP].push(i);
                    }
                    Some((number, Start::Waiting(waiting))) => {
                        walks[i].wake(s, pages, &waiting);
                        ray_of[i] = number;
                        lists[walks[i].step()].push(i);
                    }
                    None => {}
                }
            }
        }
        if lists[Step::TOP].len >= enough {
            // What was just stored as a vector is slow to load in parts, so that comes after all nodes.
            let top = lists[Step::TOP].take();
            for i in top.iter() {
                walks[i].step_top(s, pages);
            }
            for i in top.iter() {
                sort_in(s, i, walks, &mut lists);
            }
        }
        if lists[Step::INSTANCE].len >= enough {
            for i in lists[Step::INSTANCE].take().iter() {
                match walks[i].enter_instance(s, pages) {
                    true => lists[Step::TOP].push(i),
                    false => sort_in(s, i, walks, &mut lists),
                }
            }
        }
        if lists[Step::LEAVE].len >= enough {
            for i in lists[Step::LEAVE].take().iter() {
                walks[i].leave_instance(s, pages);
                sort_in(s, i, walks, &mut lists);
            }
        }
        if lists[Step::ENTER].len >= enough {
            for i in lists[Step::ENTER].take().iter() {
                if walks[i].enter(s, pages) {
                    walks[i].prefetch(s);
                    lists[Step::NODE].push(i);
                } else {
                    let number = std::mem::replace(&mut ray_of[i], NONE);
                    jobs.set_aside(number, walks[i].stopped(pages));
                    lists[Step::DONE].push(i);
                }
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
            test_strips(s, pages, walks, &strips, &mut candidates);
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
fn test_strips<'s, S: Simd, const ANY: bool>(
    s: S,
    pages: impl Pages<'s>,
    walks: &mut [Walk<'s, ANY>; WALKS],
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
        walks[i].meet(s, pages, candidates);
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
