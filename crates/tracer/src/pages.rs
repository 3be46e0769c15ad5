//! Where walks get their pages from.

use crate::scene::Scene;
use crate::walk::Walk;
use raystrips_pack::{Instance, PageId, PageView, TopEntry, TopNode};
use raystrips_paging::Visit;

/// Pages, all or some of which are in memory for `'s`.
pub(crate) trait Pages<'s>: Copy {
    /// Nodes above the pages.
    fn top_nodes(self) -> &'s [TopNode];

    /// A way into a page.
    fn top_entry(self, i: u32) -> TopEntry;

    /// Page `id`; none if it is not in memory.
    fn page(self, id: PageId) -> Option<PageView<'s>>;

    /// Parts of the scene at places of their own.
    fn instances(self) -> &'s [Instance];

    /// The greatest [condition](Instance::condition) of instances, 1 if there are none.
    fn condition(self) -> f32;

    /// The node above the child with this link.
    fn parent(self, link: u32) -> u32;

    /// Any page, to have one.
    fn some_page(self) -> PageView<'s>;

    /// Opacity of the strands of a geometry, 0 to 1.
    fn opacity(self, geometry: u32) -> f32;

    /// Is told where a walk is before each step that it takes by itself.
    #[inline(always)]
    fn before_step<const ANY: bool>(self, _: &Walk<'s, ANY>) {}
}

impl<'s> Pages<'s> for &'s Scene {
    #[inline(always)]
    fn top_nodes(self) -> &'s [TopNode] {
        Scene::top_nodes(self)
    }

    #[inline(always)]
    fn top_entry(self, i: u32) -> TopEntry {
        Scene::top_entry(self, i)
    }

    #[inline(always)]
    fn page(self, id: PageId) -> Option<PageView<'s>> {
        Some(Scene::page(self, id))
    }

    #[inline(always)]
    fn instances(self) -> &'s [Instance] {
        &self.pack().instances
    }

    #[inline(always)]
    fn condition(self) -> f32 {
        self.pack().condition
    }

    fn parent(self, _: u32) -> u32 {
        unreachable!("no ray waits where all pages are in memory")
    }

    fn some_page(self) -> PageView<'s> {
        Scene::page(self, 0)
    }

    #[inline]
    fn opacity(self, geometry: u32) -> f32 {
        Scene::opacity(self, geometry)
    }
}

impl<'s> Pages<'s> for &'s Visit<'s> {
    #[inline(always)]
    fn top_nodes(self) -> &'s [TopNode] {
        &self.pool().pack().top_nodes
    }

    #[inline(always)]
    fn top_entry(self, i: u32) -> TopEntry {
        self.pool().pack().top_entries[i as usize]
    }

    #[inline(always)]
    fn page(self, id: PageId) -> Option<PageView<'s>> {
        Visit::page(self, id)
    }

    #[inline(always)]
    fn instances(self) -> &'s [Instance] {
        &self.pool().pack().instances
    }

    #[inline(always)]
    fn condition(self) -> f32 {
        self.pool().pack().condition
    }

    #[inline(always)]
    fn parent(self, link: u32) -> u32 {
        self.pool().parent(link)
    }

    fn some_page(self) -> PageView<'s> {
        self.blank()
    }

    #[inline]
    fn opacity(self, geometry: u32) -> f32 {
        self.pool().pack().manifest.scene.opacity(geometry)
    }
}
