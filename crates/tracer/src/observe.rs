//! What rays read of a pack, for simulations of caches.

use crate::kernel::Tracer;
use crate::pages::Pages;
use crate::scene::Scene;
use crate::simd::portable::Portable;
use crate::walk::{Step, Walk};
use raystrips_geom::{Hit, Ray};
use raystrips_pack::{Instance, PageId, PageView, TopEntry, TopNode};
use std::cell::RefCell;

/// What is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// The hierarchy above the pages.
    Upper,
    /// The hierarchy in the pages, down to their strips.
    Lower,
    /// References of strips.
    Strips,
    /// Vertices.
    Vertices,
}

impl Part {
    /// All of them.
    pub const ALL: [Part; 4] = [Part::Upper, Part::Lower, Part::Strips, Part::Vertices];
}

/// Bytes that were read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// What they are.
    pub part: Part,
    /// Of pages where they are in the file, of what is above the pages where they are in memory of their own, from 2^48 on.
    pub place: u64,
    /// How many.
    pub bytes: u64,
}

/// Where the hierarchy above the pages begins.
const UPPER_PLACE: u64 = 1 << 48;

impl Tracer<'_> {
    /// The same as [`Tracer::intersect`] with portable instructions; tells what it reads, step by step. Of strips of
    /// several windows it tells the whole, although it looks into parts.
    pub fn intersect_observed(&mut self, ray: &Ray, observer: &mut dyn FnMut(Access)) -> Hit {
        observed::<false>(self.scene(), ray, observer)
    }

    /// The same as [`Tracer::occluded`], in the same way.
    pub fn occluded_observed(&mut self, ray: &Ray, observer: &mut dyn FnMut(Access)) -> bool {
        observed::<true>(self.scene(), ray, observer).is_hit()
    }
}

fn observed<const ANY: bool>(scene: &Scene, ray: &Ray, observer: &mut dyn FnMut(Access)) -> Hit {
    if !ray.is_valid() {
        return Hit::MISS;
    }
    let observer = RefCell::new(observer);
    let tell = |access| (observer.borrow_mut())(access);
    let pages = Observed { scene, tell: &tell };
    let mut walk = Walk::<ANY>::idle(pages);
    walk.begin(Portable, pages, ray);
    walk.finish(Portable, pages).expect("all pages of a scene are in memory");
    walk.hit()
}

/// A scene whose readers are observed.
#[derive(Clone, Copy)]
struct Observed<'s, 'o> {
    scene: &'s Scene,
    tell: &'o dyn Fn(Access),
}

impl<'s> Pages<'s> for Observed<'s, '_> {
    fn top_nodes(self) -> &'s [TopNode] {
        self.scene.top_nodes()
    }

    fn top_entry(self, i: u32) -> TopEntry {
        self.scene.top_entry(i)
    }

    fn page(self, id: PageId) -> Option<PageView<'s>> {
        Some(self.scene.page(id))
    }

    fn instances(self) -> &'s [Instance] {
        Pages::instances(self.scene)
    }

    fn condition(self) -> f32 {
        Pages::condition(self.scene)
    }

    fn parent(self, link: u32) -> u32 {
        Pages::parent(self.scene, link)
    }

    fn some_page(self) -> PageView<'s> {
        self.scene.page(0)
    }

    fn opacity(self, geometry: u32) -> f32 {
        self.scene.opacity(geometry)
    }

    fn before_step<const ANY: bool>(self, walk: &Walk<'s, ANY>) {
        let number = walk.link() & !TopNode::KIND;
        match walk.step() {
            Step::TOP => self.top_node(number),
            Step::INSTANCE => {
                let pack = self.scene.pack();
                let before = size_of_val(&pack.top_nodes[..]) + size_of_val(&pack.top_entries[..]);
                self.upper::<Instance>(before, number);
                self.top_node(pack.instances[number as usize].root);
            }
            Step::ENTER => {
                self.upper::<TopEntry>(size_of_val(self.top_nodes()), number);
                let TopEntry { page, node } = self.top_entry(number);
                let reader = PageReader { observed: self, page, view: self.scene.page(page) };
                reader.read(Part::Lower, bytemuck::bytes_of(reader.view.header()));
                reader.node(node as usize);
            }
            Step::NODE => self.reader(walk).node(number as usize),
            Step::STRIP => {
                self.reader(walk).strip((number >> 16 & 0xFF) as usize, (number & 0xFFFF) as usize)
            }
            _ => (),
        }
    }
}

impl<'s, 'o> Observed<'s, 'o> {
    fn top_node(self, number: u32) {
        self.upper::<TopNode>(0, number);
    }

    /// Record number `number` of a list that so many bytes are before.
    fn upper<T>(self, before: usize, number: u32) {
        let bytes = size_of::<T>() as u64;
        let place = UPPER_PLACE + before as u64 + u64::from(number) * bytes;
        (self.tell)(Access { part: Part::Upper, place, bytes });
    }

    fn reader<const ANY: bool>(self, walk: &Walk<'s, ANY>) -> PageReader<'s, 'o> {
        let page = walk.page();
        PageReader { observed: self, page, view: self.scene.page(page) }
    }
}

/// Tells what is read of a page.
struct PageReader<'s, 'o> {
    observed: Observed<'s, 'o>,
    page: PageId,
    view: PageView<'s>,
}

impl PageReader<'_, '_> {
    fn node(&self, number: usize) {
        self.read(Part::Lower, bytemuck::bytes_of(&self.view.nodes()[number]));
    }

    fn strip(&self, cluster: usize, number: usize) {
        let cluster = self.view.cluster(cluster);
        self.read(Part::Lower, bytemuck::bytes_of(cluster.vertex_code()));
        let strip = self.view.strip(number);
        self.read(Part::Strips, strip.heads());
        if let Some(strand) = strip.strand() {
            self.read(Part::Lower, bytemuck::bytes_of(cluster.strand_code()));
            return self.read(Part::Vertices, cluster.pair(strand));
        }
        self.read(Part::Strips, strip.refs());
        let stride = usize::from(cluster.vertex_code().stride);
        for &vertex in strip.refs() {
            self.read(Part::Vertices, &cluster.vertex_bytes()[usize::from(vertex) * stride..][..stride]);
        }
    }

    fn read(&self, part: Part, bytes: &[u8]) {
        let page_begin = bytemuck::bytes_of(self.view.header()).as_ptr().addr();
        let in_page = (bytes.as_ptr().addr() - page_begin) as u64;
        let place = self.observed.scene.pack().directory[self.page as usize].offset + in_page;
        (self.observed.tell)(Access { part, place, bytes: bytes.len() as u64 });
    }
}
