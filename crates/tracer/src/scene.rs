//! A pack that is ready to be traced.

use crate::placed::{placed, placed_attributes};
use glam::Vec3;
use raystrips_geom::scene::SceneDesc;
use raystrips_geom::{Aabb, Attributes, Hit, Shape};
use raystrips_pack::{
    ClusterView, Emitter, GeometryBounds, Instance, Manifest, Pack, PageId, PageView, ProxyKind, StripView,
    TopEntry, TopNode,
};
use raystrips_paging::{OpenError, PageTable};
use std::path::Path;

/// A pack that is ready to be traced. Shared by all threads.
pub struct Scene {
    pages: PageTable,
    has_opacity: bool,
}

/// What was hit, in the words of the input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResolvedHit {
    /// Geometry: index into [`SceneDesc::geometries`].
    pub geometry: u32,
    /// Number of the triangle or segment in the input if the pack keeps ids, else in the pack.
    pub triangle: u64,
    /// The triangle, wound as in the input; if the pack keeps ids, also beginning with the input's first corner. Or the
    /// segment of a strand.
    pub shape: Shape,
    /// Weight of the second corner, or the share of the segment before the hit.
    pub u: f32,
    /// Weight of the third corner; 0 on a segment.
    pub v: f32,
    /// By how much more than elsewhere the next ray may take the triangle to be beside its place: 0 but in instances, where
    /// rays are rounded once more.
    pub error: f32,
}

/// Where a triangle is: page, cluster, strip, triangle of the strip, from high to low bits. Ascends with the
/// triangle's number in the pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Locator(pub u64);

impl Locator {
    #[inline(always)]
    pub fn page(page: PageId) -> Locator {
        Locator(u64::from(page) << 32)
    }

    /// `strip`: number of the cluster, eight bits, and of the strip in it, sixteen.
    #[inline(always)]
    pub fn with_strip(self, strip: u32) -> Locator {
        Locator(self.0 & !0xFFFF_FFFF | u64::from(strip) << 8)
    }

    #[inline(always)]
    pub fn with_triangle(self, triangle: usize) -> Locator {
        Locator(self.0 & !0xFF | triangle as u64)
    }

    pub fn page_id(self) -> PageId {
        self.parts().0
    }

    fn parts(self) -> (PageId, usize, usize, usize) {
        let part = |shift: u32, mask: u64| (self.0 >> shift & mask) as usize;
        (part(32, 0xFFFF_FFFF) as PageId, part(24, 0xFF), part(8, 0xFFFF), part(0, 0xFF))
    }
}

impl Scene {
    /// Opens the pack at `path` and checks all of it.
    pub fn open(path: &Path) -> Result<Scene, OpenError> {
        Ok(Scene { pages: PageTable::open(path)?, has_opacity: false })
    }

    /// Opens a proxy in the pack at `path` and checks all of it; `None` if there is none of the kind.
    pub fn open_proxy(path: &Path, kind: ProxyKind) -> Result<Option<Scene>, OpenError> {
        Ok(PageTable::open_proxy(path, kind)?.map(|pages| Scene { pages, has_opacity: false }))
    }

    /// The same scene, but that partly opaque strands let rays pass, by chance. What decides is the same for equal rays.
    #[must_use]
    pub fn with_opacity(self) -> Scene {
        Scene { has_opacity: true, ..self }
    }

    /// Boxes of the geometries of the pack; none if it has none.
    pub fn geometry_bounds(&self) -> &[GeometryBounds] {
        &self.pages.pack().geometry_bounds
    }

    /// The resident part of the pack.
    pub fn pack(&self) -> &Pack {
        self.pages.pack()
    }

    /// Numbers and names of the pack.
    pub fn manifest(&self) -> &Manifest {
        &self.pages.pack().manifest
    }

    /// Materials, geometries, lights and cameras; positions are those of the pack.
    pub fn description(&self) -> &SceneDesc {
        &self.manifest().scene
    }

    /// Box around all triangles.
    pub fn bounds(&self) -> Aabb {
        let manifest = self.manifest();
        Aabb { min: Vec3::from_array(manifest.bounds_min), max: Vec3::from_array(manifest.bounds_max) }
    }

    /// Bytes of all pages.
    pub fn page_bytes(&self) -> u64 {
        self.pages.pack().directory.iter().map(|page| u64::from(page.bytes)).sum()
    }

    /// Emissive triangles.
    pub fn emitters(&self) -> &[Emitter] {
        &self.pages.pack().emitters
    }

    /// What a hit of this scene is.
    ///
    /// # Panics
    /// If `hit` is a miss or of another scene.
    pub fn resolve(&self, hit: &Hit) -> ResolvedHit {
        let here = locate_in(&self.pages.page(page_of(hit)), hit);
        self.placed(
            hit,
            match self.original_id(here.triangle) {
                Some((id, first_corner)) => ResolvedHit { triangle: id, ..rotate(here, first_corner) },
                None => here,
            },
        )
    }

    /// The same in the words of the pack, whether it keeps ids or not.
    ///
    /// # Panics
    /// If `hit` is a miss or of another scene.
    pub fn locate(&self, hit: &Hit) -> ResolvedHit {
        self.placed(hit, locate_in(&self.pages.page(page_of(hit)), hit))
    }

    fn placed(&self, hit: &Hit, found: ResolvedHit) -> ResolvedHit {
        self.instance(hit).map_or(found, |instance| placed(instance, &found))
    }

    /// The instance that was hit, if it was one.
    pub fn instance(&self, hit: &Hit) -> Option<&Instance> {
        self.pack().instances.get(hit.instance as usize)
    }

    /// The attributes of the corners of what [`Scene::locate`] found, `triangle` being its number; `None` if it has none.
    ///
    /// # Panics
    /// If the triangle is not in the page that was hit.
    pub fn attributes(&self, hit: &Hit, triangle: u64) -> Option<[Attributes; 3]> {
        let page = page_of(hit);
        let first = self.pack().directory[page as usize].first_triangle;
        let corners = self.pages.attributes(page)?.triangle((triangle - first) as usize);
        Some(self.instance(hit).map_or(corners, |instance| placed_attributes(instance, corners)))
    }

    /// A tile of an image.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn tile(&self, tile: u64) -> &[u8] {
        self.pages.tile(tile)
    }

    /// Every triangle of the pack, in its order: geometry and corners. Strands are left out, and what instances show is where it
    /// is in the pack.
    pub fn triangles(&self) -> impl Iterator<Item = (u32, [Vec3; 3])> {
        let pages = (0..self.pages.pack().directory.len()).map(|id| self.pages.page(id as PageId));
        pages.flat_map(|page| (0..page.cluster_count()).map(move |c| page.cluster(c))).flat_map(|cluster| {
            let strips = cluster.strips();
            let shapes =
                strips.flat_map(move |s| (0..s.primitive_count()).map(move |i| shape(&cluster, &s, i)));
            shapes.enumerate().filter_map(move |(i, shape)| match shape {
                Shape::Triangle(corners) => Some((cluster.geometry(i), corners)),
                Shape::Segment(_) => None,
            })
        })
    }

    /// Id in the input of triangle `number` of the pack, and which corner of the input's triangle is first here.
    fn original_id(&self, number: u64) -> Option<(u64, u8)> {
        let width = usize::from(self.manifest().id_bytes);
        let bytes = self.pages.triangle_ids().chunks_exact(width.max(1)).nth(number as usize)?;
        let mut id = [0; 8];
        id[..width].copy_from_slice(bytes);
        let id = u64::from_le_bytes(id);
        Some((id >> 2, (id & 3) as u8))
    }

    pub(crate) fn opacity(&self, geometry: u32) -> f32 {
        if self.has_opacity { self.description().opacity(geometry) } else { 1.0 }
    }

    #[inline(always)]
    pub(crate) fn top_nodes(&self) -> &[TopNode] {
        &self.pages.pack().top_nodes
    }

    #[inline(always)]
    pub(crate) fn top_entry(&self, i: u32) -> TopEntry {
        self.pages.pack().top_entries[i as usize]
    }

    #[inline(always)]
    pub(crate) fn page(&self, id: PageId) -> PageView<'_> {
        self.pages.page(id)
    }
}

/// The page that a hit is in.
///
/// # Panics
/// If `hit` is a miss.
pub fn page_of(hit: &Hit) -> PageId {
    assert!(hit.is_hit(), "a miss is in no page");
    Locator(hit.prim_id).page_id()
}

/// What a hit in this page is, in the words of the pack. Where an instance was hit, [`placed`] tells where that shows it.
///
/// # Panics
/// If the page has no such triangle.
pub fn locate_in(page: &PageView, hit: &Hit) -> ResolvedHit {
    let (_, cluster, strip, triangle) = Locator(hit.prim_id).parts();
    let cluster = page.cluster(cluster);
    let index = cluster.triangle_index(strip, triangle);
    ResolvedHit {
        geometry: cluster.geometry(index),
        triangle: cluster.first_triangle() + index as u64,
        shape: shape(&cluster, &page.strip(strip), triangle),
        u: hit.u,
        v: hit.v,
        error: 0.0,
    }
}

/// Triangle or segment `i` of a strip of the cluster.
fn shape(cluster: &ClusterView, strip: &StripView, i: usize) -> Shape {
    match strip.strand() {
        Some(strand) => Shape::Segment(cluster.segment(strand, i)),
        None => Shape::Triangle(strip.triangle(i).map(|v| cluster.vertex(v))),
    }
}

/// The same hit told by the input's corners, of which number `first_corner` is first in `hit`.
fn rotate(hit: ResolvedHit, first_corner: u8) -> ResolvedHit {
    let Shape::Triangle(corners) = hit.shape else { return hit };
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    // Corner k of the input is corner (k - first_corner) mod 3 here.
    let here = |k: usize| (k + 3 - usize::from(first_corner)) % 3;
    ResolvedHit {
        shape: Shape::Triangle([0, 1, 2].map(|k| corners[here(k)])),
        u: weights[here(1)],
        v: weights[here(2)],
        ..hit
    }
}
