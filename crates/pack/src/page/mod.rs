//! A page: the nodes of one or more trees, the clusters of strips below them, and the vertices of those.
//!
//! Nothing in a page refers to anything outside of it, so one read brings all that a ray needs there.

pub mod builder;
pub mod check;

use crate::layout::{ClusterHeader, GeometryRun, PageHeader, WideNode};
use crate::strip_record::StripView;
use glam::Vec3;

/// The parts of a page, in place. Bytes must have passed [`crate::check_page`]: accessors of parts that such
/// bytes always have do not return errors.
#[derive(Clone, Copy)]
pub struct PageView<'a> {
    bytes: &'a [u8],
    nodes: &'a [WideNode],
    clusters: &'a [ClusterHeader],
    first_triangle: u64,
}

/// A cluster, in place.
#[derive(Clone, Copy)]
pub struct ClusterView<'a> {
    runs: &'a [GeometryRun],
    strips: &'a [u8],
    points: &'a [f32],
    first_triangle: u64,
}

impl<'a> PageView<'a> {
    /// Splits a page into its parts; says what is missing where it is too short or not aligned to 4 bytes.
    #[inline]
    pub fn new(bytes: &'a [u8]) -> Result<PageView<'a>, &'static str> {
        let (head, rest) =
            bytes.split_at_checked(size_of::<PageHeader>()).ok_or("shorter than its header")?;
        let header: PageHeader = bytemuck::pod_read_unaligned(head);
        let (nodes, rest) = rest
            .split_at_checked(usize::from(header.node_count) * size_of::<WideNode>())
            .ok_or("shorter than its nodes")?;
        let clusters = rest
            .get(..usize::from(header.cluster_count) * size_of::<ClusterHeader>())
            .ok_or("shorter than its cluster table")?;
        Ok(PageView {
            bytes,
            nodes: bytemuck::try_cast_slice(nodes).map_err(|_| "not aligned in memory")?,
            clusters: bytemuck::try_cast_slice(clusters).map_err(|_| "not aligned in memory")?,
            first_triangle: header.first_triangle,
        })
    }

    /// Nodes; children come after their parents.
    #[inline]
    pub fn nodes(&self) -> &'a [WideNode] {
        self.nodes
    }

    /// Number of clusters.
    pub fn cluster_count(&self) -> usize {
        self.clusters.len()
    }

    /// Cluster `i`, or what is wrong with it.
    #[inline]
    pub fn try_cluster(&self, i: usize) -> Result<ClusterView<'a>, &'static str> {
        let header = self.clusters.get(i).ok_or("no such cluster")?;
        let runs_bytes = (usize::from(header.last_run) + 1) * size_of::<GeometryRun>();
        let vertices_bytes = (usize::from(header.last_vertex) + 1) * size_of::<Vec3>();
        let blob = self.bytes.get(header.offset as usize..).ok_or("cluster beyond the end of the page")?;
        let vertices_begin = runs_bytes + usize::from(header.strip_bytes);
        let points = blob.get(vertices_begin - size_of::<f32>()..vertices_begin + vertices_bytes);
        let (runs, strips) = blob.split_at_checked(runs_bytes).ok_or("geometry runs cut off")?;
        let strips = strips.get(..usize::from(header.strip_bytes)).ok_or("strips cut off")?;
        let first_triangle = self.first_triangle.checked_add(u64::from(header.first_triangle));
        Ok(ClusterView {
            runs: bytemuck::try_cast_slice(runs).map_err(|_| "geometry runs not aligned")?,
            strips,
            points: bytemuck::try_cast_slice(points.ok_or("vertices cut off")?)
                .map_err(|_| "vertices not aligned")?,
            first_triangle: first_triangle.ok_or("triangle number beyond 64 bits")?,
        })
    }

    /// Cluster `i` of a checked page.
    ///
    /// # Panics
    /// If the page was not checked or has no such cluster.
    #[inline]
    pub fn cluster(&self, i: usize) -> ClusterView<'a> {
        self.try_cluster(i).expect("a checked page has this cluster")
    }
}

impl<'a> ClusterView<'a> {
    /// The strip at `offset`.
    ///
    /// # Panics
    /// If the page was not checked or no strip begins there.
    #[inline]
    pub fn strip(&self, offset: usize) -> StripView<'a> {
        StripView::at(self.strips, offset).expect("a checked cluster has this strip")
    }

    /// Every strip with the place where it begins.
    pub fn strips(&self) -> impl Iterator<Item = (usize, StripView<'a>)> + use<'a> {
        let strips = self.strips;
        let mut offset = 0;
        std::iter::from_fn(move || {
            let strip = StripView::at(strips, offset)?;
            let begin = offset;
            offset += strip.record_bytes();
            Some((begin, strip))
        })
    }

    /// Bytes of the strips, with padding.
    pub fn strip_bytes(&self) -> &'a [u8] {
        self.strips
    }

    /// Vertices that strips refer to.
    #[inline]
    pub fn vertices(&self) -> &'a [Vec3] {
        bytemuck::cast_slice(&self.points[1..])
    }

    /// The coordinates of the vertices, after one word that means nothing: a kernel may read each vertex with
    /// the word before it, four words at once.
    #[inline]
    pub fn points(&self) -> &'a [f32] {
        self.points
    }

    /// Bytes of runs, strips and vertices in the page.
    pub(crate) fn byte_count(&self) -> usize {
        size_of_val(self.runs) + self.strips.len() + size_of_val(self.vertices())
    }

    /// Geometry runs.
    pub fn runs(&self) -> &'a [GeometryRun] {
        self.runs
    }

    /// Number of the cluster's first triangle in the pack.
    pub fn first_triangle(&self) -> u64 {
        self.first_triangle
    }

    /// Place in the cluster of triangle `i` of the strip at `offset`.
    pub fn triangle_index(&self, offset: usize, i: usize) -> usize {
        self.strips().take_while(|(begin, _)| *begin < offset).map(|(_, s)| s.triangle_count()).sum::<usize>()
            + i
    }

    /// Geometry of the cluster's triangle `index`.
    pub fn geometry(&self, index: usize) -> u32 {
        let run = self.runs.iter().find(|run| index < run.end as usize);
        run.expect("the last run of a checked cluster ends at its last triangle").geometry
    }
}
