//! Rays that wait for pages: little memory for each, since that is what decides how many may wait, and so for how many
//! rays a page is read.

use bytemuck::{Pod, Zeroable};
use raystrips_geom::{Hit, Ray};
use raystrips_pack::TopNode;

/// Where a ray is on its way, above the pages. What it has still to look into follows from that, since the subtrees of a
/// node are looked into in an order that depends on the ray alone.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Place {
    /// The hit so far, [`Hit::MISS`] if there is none.
    pub(crate) best: Hit,
    /// What is next: a link of a [`TopNode`].
    pub(crate) link: u32,
    /// The instance that it is in, or [`Hit::NO_INSTANCE`].
    pub(crate) instance: u32,
}

impl Place {
    /// Of a ray that has not looked into anything.
    pub const BEGINNING: Place = Place { best: Hit::MISS, link: TopNode::NODE, instance: Hit::NO_INSTANCE };
}

/// A ray on its way.
#[derive(Debug)]
pub(crate) struct WaitingRay<'a> {
    pub ray: &'a Ray,
    pub place: Place,
}

/// Rays that wait, each with an errand: what is to be done with its hit.
#[derive(Debug)]
pub struct RayBuffer<E> {
    records: Vec<Record<E>>,
    /// Of those rays that have a hit.
    hits: Vec<Hit>,
    /// Of those rays that are in one.
    instances: Vec<u32>,
}

/// A ray that cannot go on before a page is in memory.
#[derive(Clone, Copy, Debug)]
pub struct Parked<E> {
    /// What is to be done with its hit.
    pub errand: E,
    /// From its beginning.
    pub ray: Ray,
    /// Where it is.
    pub place: Place,
}

/// A place in a [`RayBuffer`], from its beginning on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cursor {
    pub(crate) next: usize,
    /// Where the hits of the next rays begin.
    hit: usize,
    /// Where their instances begin.
    instance: usize,
}

#[derive(Clone, Copy, Debug)]
struct Record<E> {
    errand: E,
    ray: Ray,
    /// What is next, with [`HAS_HIT`] and [`IN_INSTANCE`].
    link: u32,
}

/// The bit of a link that no kind of child has.
const HAS_HIT: u32 = 1 << 31;
/// What makes an entry in an instance of an entry: the bits of both, an instance itself, nobody waits for.
const IN_INSTANCE: u32 = TopNode::INSTANCE;

impl<E> Default for RayBuffer<E> {
    fn default() -> RayBuffer<E> {
        RayBuffer { records: Vec::new(), hits: Vec::new(), instances: Vec::new() }
    }
}

impl<E: Copy> RayBuffer<E> {
    /// Adds a ray that is at its beginning. Rays that are not [valid](Ray::is_valid) miss.
    pub fn push(&mut self, ray: Ray, errand: E) {
        self.records.push(Record { errand, ray, link: TopNode::NODE });
    }

    /// Adds a ray that is on its way.
    pub fn push_parked(&mut self, parked: &Parked<E>) {
        let &Parked { errand, ray, place: Place { best, mut link, instance } } = parked;
        if instance != Hit::NO_INSTANCE {
            link |= IN_INSTANCE;
            self.instances.push(instance);
        }
        if best.is_hit() {
            link |= HAS_HIT;
            self.hits.push(best);
        }
        self.records.push(Record { errand, ray, link });
    }

    /// Makes room for so many rays more, in little more memory than they need.
    pub fn reserve(&mut self, rays: usize) {
        reserve(&mut self.records, rays);
    }

    /// Takes over all of `other`, in little more memory than it needs.
    pub fn append(&mut self, other: &mut RayBuffer<E>) {
        reserve(&mut self.records, other.records.len());
        self.records.append(&mut other.records);
        reserve(&mut self.hits, other.hits.len());
        self.hits.append(&mut other.hits);
        reserve(&mut self.instances, other.instances.len());
        self.instances.append(&mut other.instances);
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
        self.hits.clear();
        self.instances.clear();
    }

    /// Bytes of memory that it takes.
    pub fn bytes(&self) -> usize {
        self.records.capacity() * size_of::<Record<E>>()
            + self.hits.capacity() * size_of::<Hit>()
            + self.instances.capacity() * size_of::<u32>()
    }

    /// Rays from `cursor` on.
    pub fn left(&self, cursor: &Cursor) -> usize {
        self.records.len() - cursor.next
    }

    /// The ray at `cursor`, which moves on.
    pub(crate) fn take_next(&self, cursor: &mut Cursor) -> Option<(E, WaitingRay<'_>)> {
        let &Record { errand, ref ray, mut link } = self.records.get(cursor.next)?;
        cursor.next += 1;
        let mut best = Hit::MISS;
        if link & HAS_HIT != 0 {
            best = self.hits[cursor.hit];
            cursor.hit += 1;
        }
        link &= !HAS_HIT;
        let mut instance = Hit::NO_INSTANCE;
        if link & TopNode::KIND == IN_INSTANCE {
            instance = self.instances[cursor.instance];
            cursor.instance += 1;
            link = link & !TopNode::KIND | TopNode::ENTRY;
        }
        Some((errand, WaitingRay { ray, place: Place { best, link, instance } }))
    }

    pub(crate) fn ray(&self, i: usize) -> (E, Ray) {
        (self.records[i].errand, self.records[i].ray)
    }
}

/// Makes room for `more` at the end of `records`, which grows by a quarter at least: doubling would leave a quarter of the
/// memory unused.
fn reserve<T>(records: &mut Vec<T>, more: usize) {
    if records.len() + more > records.capacity() {
        records.reserve_exact(more + records.len() / 4);
    }
}
