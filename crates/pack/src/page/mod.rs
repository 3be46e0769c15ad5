//! A page: the nodes of one or more trees, the clusters of strips below them, and the vertices of those.
//!
//! Nothing in a page refers to anything outside of it, so one read brings all that a ray needs there.

pub mod builder;
pub mod check;

use crate::layout::{ClusterHeader, GeometryRun, PageHeader, WideNode};
use crate::strand_code::{PAIR_SLACK, StrandCode, StrandPoints};
use crate::strand_record::{STRAND_RECORD_BYTES, StrandView};
use crate::strip_record::{PLACE_BYTES, StripView, WINDOW_RECORD_BYTES};
use crate::vertices::{VERTEX_REACH, VertexCode};
use glam::Vec3;
use raystrips_geom::{PageGrid, RadiusCode, Segment};
use std::ops::Range;

/// Alignment of pages in memory, so that a node is one cache line.
pub const PAGE_ALIGNMENT: usize = align_of::<WideNode>();

/// The parts of a page, in place. Bytes must have passed [`crate::check_page`]: accessors of parts that such
/// bytes always have do not return errors.
#[derive(Clone, Copy)]
pub struct PageView<'a> {
    bytes: &'a [u8],
    header: &'a PageHeader,
    nodes: &'a [WideNode],
    clusters: &'a [ClusterHeader],
}

/// A cluster, in place.
#[derive(Clone, Copy)]
pub struct ClusterView<'a> {
    page: PageView<'a>,
    header: &'a ClusterHeader,
}

impl<'a> PageView<'a> {
    /// Splits a page into its parts; says what is missing where it is too short or not aligned to
    /// [`PAGE_ALIGNMENT`].
    #[inline]
    pub fn new(bytes: &'a [u8]) -> Result<PageView<'a>, &'static str> {
        let not_aligned = |_| "not aligned in memory";
        let head = bytes.get(..size_of::<PageHeader>()).ok_or("shorter than its header")?;
        let header: &PageHeader = bytemuck::try_from_bytes(head).map_err(not_aligned)?;
        let clusters = bytes[size_of::<PageHeader>()..]
            .get(..usize::from(header.cluster_count) * size_of::<ClusterHeader>())
            .ok_or("shorter than its cluster table")?;
        let nodes = bytes
            .get(header.nodes_offset as usize..)
            .and_then(|rest| rest.get(..(usize::from(header.last_node) + 1) * size_of::<WideNode>()))
            .ok_or("shorter than its nodes")?;
        Ok(PageView {
            bytes,
            header,
            nodes: bytemuck::try_cast_slice(nodes).map_err(not_aligned)?,
            clusters: bytemuck::try_cast_slice(clusters).map_err(not_aligned)?,
        })
    }

    /// The beginning of the page.
    #[inline(always)]
    pub fn header(&self) -> &'a PageHeader {
        self.header
    }

    /// Nodes; children come after their parents.
    #[inline(always)]
    pub fn nodes(&self) -> &'a [WideNode] {
        self.nodes
    }

    /// The grid on which nodes have their origins.
    pub fn grid(&self) -> PageGrid {
        self.header.grid()
    }

    /// Number of clusters.
    pub fn cluster_count(&self) -> usize {
        self.clusters.len()
    }

    /// Cluster `i` of a checked page.
    ///
    /// # Panics
    /// If there is no such cluster.
    #[inline(always)]
    pub fn cluster(&self, i: usize) -> ClusterView<'a> {
        ClusterView { page: *self, header: &self.clusters[i] }
    }

    /// Number of strips.
    pub fn strip_count(&self) -> usize {
        self.header.strip_count as usize
    }

    /// Strip number `i` of a checked page.
    ///
    /// # Panics
    /// If the page was not checked or there is no such strip.
    #[inline(always)]
    pub fn strip(&self, i: usize) -> StripView<'a> {
        self.try_strip(i).expect("a checked page has this strip")
    }

    #[inline(always)]
    fn try_strip(&self, i: usize) -> Option<StripView<'a>> {
        match self.header.max_windows {
            0 => Some(StripView::strand_window(self.strand_record(i)?)),
            1 => StripView::single(self.bytes.get(i * WINDOW_RECORD_BYTES..)?),
            _ => StripView::long(self.bytes.get(self.long_place(i)?..)?),
        }
    }

    /// Where the record of strip `i` begins in a page with strips of several windows.
    fn long_place(&self, i: usize) -> Option<usize> {
        let place = self.bytes.get(self.places_offset() + PLACE_BYTES * i..)?.first_chunk()?;
        Some(u32::from_le_bytes(*place) as usize)
    }

    /// The record of window `i` of a page of strands.
    #[inline(always)]
    pub(crate) fn strand_record(&self, i: usize) -> Option<&'a [u8; STRAND_RECORD_BYTES]> {
        self.bytes.get(self.places_offset() + STRAND_RECORD_BYTES * i..)?.first_chunk()
    }

    /// Window `i`, if this is a page of strands.
    #[inline(always)]
    pub fn strand(&self, i: usize) -> Option<StrandView> {
        if self.header.holds_strands() { self.strand_record(i).map(StrandView::of) } else { None }
    }

    /// Where the table of places begins, which pages with strips of several windows have, or that of windows of strands.
    #[inline(always)]
    fn places_offset(&self) -> usize {
        size_of_val(self.header) + size_of_val(self.clusters)
    }

    /// What records of strips lie in from number 0 on, and the bytes of each: a kernel may ask for them ahead of time.
    #[inline(always)]
    pub fn records(&self) -> (&'a [u8], usize) {
        match self.header.holds_strands() {
            true => (&self.bytes[self.places_offset()..], STRAND_RECORD_BYTES),
            false => (self.bytes, WINDOW_RECORD_BYTES),
        }
    }

    /// The record of strip number `i` where all strips have one window; `None` where they have more, or where there
    /// is no such strip.
    #[inline(always)]
    pub fn window_record(&self, i: usize) -> Option<&'a [u8; WINDOW_RECORD_BYTES]> {
        let begin = i * WINDOW_RECORD_BYTES;
        let record = self.bytes.get(begin..begin + WINDOW_RECORD_BYTES)?;
        if self.header.max_windows == 1 { record.first_chunk() } else { None }
    }

    /// Cluster `i`, or what is wrong with its extent.
    fn try_cluster(&self, i: usize) -> Result<ClusterView<'a>, &'static str> {
        let header = self.clusters.get(i).ok_or("no such cluster")?;
        let begin = header.offset as usize;
        let blob = self.bytes.get(begin..).ok_or("cut off")?;
        let cluster = self.cluster(i);
        let least = match self.header.holds_strands() {
            true => cluster.byte_count() + PAIR_SLACK,
            false => cluster.byte_count().max(VERTEX_REACH),
        };
        if begin.is_multiple_of(4) && blob.len() >= least { Ok(cluster) } else { Err("cut off") }
    }
}

impl<'a> ClusterView<'a> {
    /// Numbers of its strips.
    pub fn strip_numbers(&self) -> Range<usize> {
        let first = usize::from(self.header.first_strip);
        first..first + usize::from(self.header.strip_count)
    }

    /// Its strips, by number.
    pub fn strips(&self) -> impl Iterator<Item = StripView<'a>> + use<'a> {
        let page = self.page;
        self.strip_numbers().map(move |i| page.strip(i))
    }

    /// Vertex `i` of a cluster of triangles.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn vertex(&self, i: u8) -> Vec3 {
        assert!(i <= self.header.code.last, "no vertex {i}");
        self.header.code.decode(self.vertex_bytes(), usize::from(i))
    }

    /// Segment `i` of a window of a strand of this cluster.
    ///
    /// # Panics
    /// If there is no such segment.
    pub fn segment(&self, strand: StrandView, i: usize) -> Segment {
        let (points, radii) = (self.strand_points(strand), self.radius_code());
        let ends = [i, i + 1];
        Segment {
            ends: ends.map(|k| Vec3::from_array(points.axes.map(|axis| axis[k]))),
            radii: ends.map(|k| radii.decode(points.radii[k])),
        }
    }

    /// The points of a window of a strand of this cluster.
    #[inline(always)]
    pub fn strand_points(&self, strand: StrandView) -> StrandPoints {
        self.strand_code().decode(&self.header.code, self.pair_bytes(), strand)
    }

    /// How pairs of windows of strands are stored.
    #[inline(always)]
    pub fn strand_code(&self) -> &'a StrandCode {
        bytemuck::from_bytes(&self.vertex_bytes()[..size_of::<StrandCode>()])
    }

    /// Pairs of windows of strands, and what follows them in the page, [`PAIR_SLACK`] bytes at least.
    #[inline(always)]
    pub fn pair_bytes(&self) -> &'a [u8] {
        &self.vertex_bytes()[size_of::<StrandCode>()..]
    }

    /// What is stored of the pair of a window.
    #[inline(always)]
    pub fn pair(&self, strand: StrandView) -> &'a [u8] {
        let stride = usize::from(self.header.code.stride);
        &self.pair_bytes()[stride * usize::from(strand.pair)..][..stride]
    }

    /// How radii of strands are stored.
    #[inline(always)]
    pub fn radius_code(&self) -> RadiusCode {
        self.page.header.radius_code()
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        usize::from(self.header.code.last) + 1
    }

    /// How vertices are stored.
    #[inline(always)]
    pub fn vertex_code(&self) -> &'a VertexCode {
        &self.header.code
    }

    /// Vertices as stored, and what follows them in the page, [`VERTEX_REACH`] bytes at least; of strands their
    /// [`StrandCode`] and their pairs.
    #[inline(always)]
    pub fn vertex_bytes(&self) -> &'a [u8] {
        &self.page.bytes[self.header.offset as usize..]
    }

    /// Geometry runs.
    pub fn runs(&self) -> &'a [GeometryRun] {
        let begin = self.header.offset as usize + self.vertex_byte_count();
        let bytes = usize::from(self.header.run_count) * size_of::<GeometryRun>();
        bytemuck::cast_slice(&self.page.bytes[begin..begin + bytes])
    }

    /// Bytes of vertices and runs.
    fn byte_count(&self) -> usize {
        self.vertex_byte_count() + usize::from(self.header.run_count) * size_of::<GeometryRun>()
    }

    /// Bytes of vertices, or of strands, with those up to a multiple of 4.
    #[inline]
    fn vertex_byte_count(&self) -> usize {
        let code = &self.header.code;
        match self.page.header.holds_strands() {
            true => (size_of::<StrandCode>() + (usize::from(code.last) + 1) * usize::from(code.stride))
                .next_multiple_of(4),
            false => code.byte_count(),
        }
    }

    /// Number of the cluster's first triangle in the pack.
    pub fn first_triangle(&self) -> u64 {
        self.page.header.first_triangle + u64::from(self.header.first_triangle)
    }

    /// Place in the cluster of triangle `i` of strip number `strip` of the page.
    pub fn triangle_index(&self, strip: usize, i: usize) -> usize {
        let before = self.strip_numbers().start..strip;
        before.map(|s| self.page.strip(s).primitive_count()).sum::<usize>() + i
    }

    /// Geometry of strip number `strip` of the page.
    #[inline]
    pub fn geometry_of_strip(&self, strip: usize) -> u32 {
        match self.runs() {
            [only] => only.geometry,
            _ => self.geometry(self.triangle_index(strip, 0)),
        }
    }

    /// Geometry of the cluster's triangle `index`.
    pub fn geometry(&self, index: usize) -> u32 {
        let run = self.runs().iter().find(|run| index < run.end as usize);
        run.expect("the last run of a checked cluster ends at its last triangle").geometry
    }
}
