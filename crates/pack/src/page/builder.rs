//! Makes the bytes of a page.

use crate::PackError;
use crate::layout::*;
use crate::manifest::ByteCounts;
use crate::strip_record::{PLACE_BYTES, SPLIT_BYTES, SPLIT_PLANE_STEP, SplitNode, push_long, push_window};
use crate::vertices::{VERTEX_REACH, VertexCode};
use glam::Vec3;
use raystrips_geom::strip::PlaneSplit;
use raystrips_geom::{Aabb, PageGrid, Subgrid};

/// A strip to be stored.
#[derive(Clone, Debug)]
pub struct StripParts<'a> {
    /// Vertices of the cluster.
    pub refs: &'a [u8],
    /// Turn bits, a byte a window.
    pub turns: &'a [u8],
    /// Tree over the windows, in pre-order.
    pub splits: &'a [PlaneSplit],
    /// Geometry of its triangles.
    pub geometry: u32,
}

/// What the children of a node are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Children {
    /// Nodes of the page from this number on.
    Nodes(u16),
    /// Strips of a cluster.
    Strips {
        /// Number of the cluster.
        cluster: u8,
        /// Number of the first strip.
        first: u16,
    },
}

/// A node to be stored.
#[derive(Clone, Debug)]
struct Node {
    bounds: Vec<Aabb>,
    children: Children,
}

/// A cluster to be stored.
struct Cluster<'a> {
    vertices: &'a [Vec3],
    strips: Vec<StripParts<'a>>,
}

/// Collects nodes and clusters, then lays them out as a page.
#[derive(Default)]
pub struct PageBuilder<'a> {
    nodes: Vec<Option<Node>>,
    clusters: Vec<Cluster<'a>>,
    strip_count: usize,
}

/// A finished page.
pub struct BuiltPage {
    /// What goes into the file.
    pub bytes: Vec<u8>,
    /// Triangles.
    pub triangle_count: u32,
    /// Nodes.
    pub node_count: u32,
    /// Strips.
    pub strip_count: u64,
    /// Clusters.
    pub cluster_count: u64,
    /// Where the bytes went; padding to [`ALIGNMENT`] is not in it.
    pub counts: ByteCounts,
}

impl<'a> PageBuilder<'a> {
    /// Adds a cluster and gives its number and that of its first strip.
    ///
    /// # Panics
    /// If there are no or too many vertices or strips, or too many clusters.
    pub fn cluster(&mut self, vertices: &'a [Vec3], strips: Vec<StripParts<'a>>) -> (u8, u16) {
        let count = vertices.len();
        assert!((1..=MAX_CLUSTER_VERTICES).contains(&count), "{count} vertices in a cluster");
        assert!(!strips.is_empty(), "no strips in a cluster");
        assert!(self.clusters.len() < MAX_PAGE_CLUSTERS, "too many clusters in a page");
        let first_strip = self.strip_count;
        self.strip_count += strips.len();
        assert!(self.strip_count <= MAX_PAGE_STRIPS, "too many strips in a page");
        self.clusters.push(Cluster { vertices, strips });
        ((self.clusters.len() - 1) as u8, first_strip as u16)
    }

    /// Makes room for `count` nodes one after the other and gives the number of the first.
    ///
    /// # Panics
    /// If there are more nodes than a page can number.
    pub fn reserve_nodes(&mut self, count: usize) -> u16 {
        let first = self.nodes.len();
        assert!(first + count <= MAX_PAGE_NODES, "too many nodes in a page");
        self.nodes.resize(first + count, None);
        first as u16
    }

    /// Says what node `number` is: its children are in `bounds`.
    pub fn set_node(&mut self, number: u16, bounds: Vec<Aabb>, children: Children) {
        assert!((1..=WIDTH).contains(&bounds.len()), "{} children", bounds.len());
        if let Children::Nodes(first) = children {
            debug_assert!(first > number, "children come after their parents");
        }
        self.nodes[usize::from(number)] = Some(Node { bounds, children });
    }

    /// Lays out the page whose first triangle has number `first_triangle` in the pack.
    ///
    /// # Panics
    /// If there is no node, or one that was reserved was not set.
    pub fn finish(self, first_triangle: u64) -> Result<BuiltPage, PackError> {
        let set = |n: Option<Node>| n.expect("every node that was reserved is set");
        let nodes: Vec<Node> = self.nodes.into_iter().map(set).collect();
        let bounds = nodes.iter().flat_map(|n| &n.bounds).fold(Aabb::EMPTY, |all, b| all.union(*b));
        let grid = PageGrid::covering(&bounds);
        let mut counts = ByteCounts::default();
        let strips = self.clusters.iter().flat_map(|c| &c.strips);
        let (strip_records, max_windows) = strip_records(strips, self.strip_count, grid, &mut counts);
        let blobs_begin = size_of::<PageHeader>() + size_of::<ClusterHeader>() * self.clusters.len();
        let mut headers: Vec<ClusterHeader> = Vec::with_capacity(self.clusters.len());
        let mut blobs = Vec::new();
        let (mut triangles, mut strips) = (0, 0);
        for cluster in &self.clusters {
            let offset = (blobs_begin + blobs.len()) as u32;
            let header = cluster.write(&mut blobs, &mut counts)?;
            headers.push(ClusterHeader {
                offset,
                first_triangle: triangles,
                first_strip: strips as u16,
                ..header
            });
            triangles += u32::from(header.triangle_count);
            strips += cluster.strips.len();
        }
        let nodes_offset = (blobs_begin + blobs.len()).next_multiple_of(size_of::<WideNode>());
        let header = PageHeader {
            last_node: (nodes.len() - 1) as u16,
            cluster_count: headers.len() as u16,
            triangle_count: triangles,
            first_triangle,
            grid_origin: grid.origin.to_array(),
            grid_exponent: grid.exponent,
            max_windows,
            strip_count: self.strip_count as u32,
            strip_bytes: strip_records.len() as u32,
            nodes_offset: nodes_offset as u32,
            reserved: [0; 5],
        };
        let stored: Vec<WideNode> = nodes.iter().map(|node| node.on_grid(grid)).collect();
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        bytes.extend_from_slice(bytemuck::cast_slice(&headers));
        bytes.append(&mut blobs);
        bytes.resize(nodes_offset, 0);
        bytes.extend_from_slice(bytemuck::cast_slice(&stored));
        bytes.extend_from_slice(&strip_records);
        let reach = headers.iter().map(|h| h.offset as usize + VERTEX_REACH).max().unwrap_or(0);
        bytes.resize(bytes.len().max(reach), 0);
        counts.nodes = size_of_val(&stored[..]) as u64;
        counts.page_overhead = bytes.len() as u64
            - counts.nodes
            - counts.vertices
            - counts.materials
            - counts.indices
            - counts.strip_trees;
        Ok(BuiltPage {
            bytes,
            triangle_count: triangles,
            node_count: stored.len() as u32,
            strip_count: self.strip_count as u64,
            cluster_count: self.clusters.len() as u64,
            counts,
        })
    }
}

impl Node {
    fn on_grid(&self, page: PageGrid) -> WideNode {
        let all = self.bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        let grid = Subgrid::covering(page, &all);
        let (mut lo, mut hi) = ([[255; WIDTH]; 3], [[0; WIDTH]; 3]);
        for (i, b) in self.bounds.iter().enumerate() {
            for axis in 0..3 {
                lo[axis][i] = grid.round_down(axis, b.min[axis]);
                hi[axis][i] = grid.round_up(axis, b.max[axis]);
            }
        }
        let count = self.bounds.len() as u8;
        let (first, cluster, count) = match self.children {
            Children::Nodes(first) => (first, 0, count),
            Children::Strips { cluster, first } => (first, cluster, count | WideNode::STRIPS),
        };
        WideNode {
            origin: grid.origin,
            reserved: 0,
            exponent: grid.exponent,
            reserved_too: 0,
            first,
            cluster,
            count,
            lo,
            hi,
        }
    }
}

impl Cluster<'_> {
    /// Appends vertices and runs to `out`, and gives the header but for where all that is.
    fn write(&self, out: &mut Vec<u8>, counts: &mut ByteCounts) -> Result<ClusterHeader, PackError> {
        let runs = self.runs();
        let code = VertexCode::of(self.vertices);
        let begin = out.len();
        code.encode(self.vertices, out);
        out.resize(begin + code.byte_count(), 0);
        out.extend_from_slice(bytemuck::cast_slice(&runs));
        counts.vertices += code.byte_count() as u64;
        counts.materials += size_of_val(&runs[..]) as u64;
        let too_large = |_| PackError::TooLarge("more triangles in a cluster than 16 bits can tell".into());
        Ok(ClusterHeader {
            offset: 0,
            first_triangle: 0,
            triangle_count: u16::try_from(runs[runs.len() - 1].end).map_err(too_large)?,
            first_strip: 0,
            strip_count: self.strips.len() as u16,
            run_count: runs.len() as u16,
            code,
        })
    }

    fn runs(&self) -> Vec<GeometryRun> {
        let mut runs: Vec<GeometryRun> = Vec::new();
        let mut end = 0;
        for strip in &self.strips {
            end += strip.refs.len() as u32 - 2;
            match runs.last_mut() {
                Some(run) if run.geometry == strip.geometry => run.end = end,
                _ => runs.push(GeometryRun { geometry: strip.geometry, end }),
            }
        }
        runs
    }
}

/// The strips as stored, and the most windows of one.
fn strip_records<'a>(
    strips: impl Iterator<Item = &'a StripParts<'a>> + Clone,
    count: usize,
    grid: PageGrid,
    counts: &mut ByteCounts,
) -> (Vec<u8>, u8) {
    let max_windows = strips.clone().map(|s| s.turns.len()).max().unwrap_or(0);
    let mut records = Vec::new();
    if max_windows == 1 {
        strips.for_each(|strip| push_window(&mut records, strip.turns[0], strip.refs));
    } else {
        records.resize(PLACE_BYTES * count, 0);
        for (i, strip) in strips.enumerate() {
            let place = records.len() as u32;
            records[PLACE_BYTES * i..][..PLACE_BYTES].copy_from_slice(&place.to_le_bytes());
            let tree: Vec<SplitNode> = strip.splits.iter().map(|s| split_on_grid(s, grid)).collect();
            push_long(&mut records, &tree, strip.turns, strip.refs);
            counts.strip_trees += (tree.len() * SPLIT_BYTES) as u64;
        }
    }
    counts.indices += records.len() as u64 - counts.strip_trees;
    (records, max_windows as u8)
}

fn split_on_grid(split: &PlaneSplit, grid: PageGrid) -> SplitNode {
    let axis = usize::from(split.axis);
    SplitNode {
        axis: split.axis,
        reversed: split.reversed,
        lower_max: grid.round_up(axis, split.lower_max).div_ceil(SPLIT_PLANE_STEP),
        upper_min: grid.round_down(axis, split.upper_min) / SPLIT_PLANE_STEP,
    }
}
