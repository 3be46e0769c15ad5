//! Rays that wait for pages.

use raystrips_geom::{Hit, Ray};
use raystrips_pack::TopNode;

/// A subtree above the pages that a ray has not looked into yet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Subtree {
    /// Where the ray enters it, as a key.
    pub key: u32,
    pub link: u32,
}

/// A ray on its way, set aside above the pages.
#[derive(Debug)]
pub(crate) struct WaitingRay<'a> {
    pub ray: &'a Ray,
    /// The hit so far; a distance without a triangle is up to where one would matter.
    pub best: Hit,
    /// What is next.
    pub link: u32,
    /// What waits behind `link`, the nearest last.
    pub subtrees: &'a [Subtree],
}

/// Rays that wait, each with an errand: what is to be done with its hit.
#[derive(Debug)]
pub struct RayBuffer<E> {
    records: Vec<Record<E>>,
    /// Of all rays, one after the other.
    subtrees: Vec<Subtree>,
}

/// A place in a [`RayBuffer`], from its beginning on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cursor {
    pub(crate) next: usize,
    /// Where the subtrees of the next one begin.
    subtree: usize,
}

#[derive(Debug)]
struct Record<E> {
    errand: E,
    ray: Ray,
    best: Hit,
    link: u32,
    subtree_count: u32,
}

impl<E> Default for RayBuffer<E> {
    fn default() -> RayBuffer<E> {
        RayBuffer { records: Vec::new(), subtrees: Vec::new() }
    }
}

impl<E: Copy> RayBuffer<E> {
    /// Adds a ray that is at its beginning. Rays that are not [valid](Ray::is_valid) miss.
    pub fn push(&mut self, ray: Ray, errand: E) {
        let best = Hit { t: ray.tfar, ..Hit::MISS };
        self.records.push(Record { errand, ray, best, link: TopNode::NODE, subtree_count: 0 });
    }

    /// Adds a ray that is on its way.
    pub(crate) fn push_waiting(
        &mut self,
        (errand, ray): (E, Ray),
        best: Hit,
        (link, subtrees): (u32, impl Iterator<Item = Subtree>),
    ) {
        let before = self.subtrees.len();
        self.subtrees.extend(subtrees);
        let subtree_count = (self.subtrees.len() - before) as u32;
        self.records.push(Record { errand, ray, best, link, subtree_count });
    }

    /// Takes over all of `other`.
    pub fn append(&mut self, other: &mut RayBuffer<E>) {
        self.records.append(&mut other.records);
        self.subtrees.append(&mut other.subtrees);
    }

    /// Rays in it.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Removes all.
    pub fn clear(&mut self) {
        self.records.clear();
        self.subtrees.clear();
    }

    /// Bytes of memory that it takes.
    pub fn bytes(&self) -> usize {
        self.records.capacity() * size_of::<Record<E>>() + self.subtrees.capacity() * size_of::<Subtree>()
    }

    /// Rays from `cursor` on.
    pub fn left(&self, cursor: &Cursor) -> usize {
        self.records.len() - cursor.next
    }

    /// The ray at `cursor`, which moves on.
    pub(crate) fn take_next(&self, cursor: &mut Cursor) -> Option<(E, WaitingRay<'_>)> {
        let Record { errand, ray, best, link, subtree_count } = self.records.get(cursor.next)?;
        let end = cursor.subtree + *subtree_count as usize;
        let subtrees = &self.subtrees[cursor.subtree..end];
        *cursor = Cursor { next: cursor.next + 1, subtree: end };
        Some((*errand, WaitingRay { ray, best: *best, link: *link, subtrees }))
    }

    pub(crate) fn ray(&self, i: usize) -> (E, Ray) {
        (self.records[i].errand, self.records[i].ray)
    }
}
