//! Makes the bytes of a page.

use crate::PackError;
use crate::layout::*;
use crate::manifest::ByteCounts;
use crate::strand_pairs::StoredStrands;
use crate::strip_record::{
    PLACE_BYTES, SPLIT_BYTES, SPLIT_PLANE_STEP, SplitNode, WINDOW_RECORD_BYTES, push_long, push_window,
};
use crate::vertices::{VERTEX_REACH, VertexCode};
use glam::Vec3;
use raystrips_geom::strip::PlaneSplit;
use raystrips_geom::{Aabb, Frame, PageGrid, RadiusCode, Subgrid};

/// A strip to be stored.
#[derive(Clone, Debug)]
pub struct StripParts<'a> {
    /// Vertices of the cluster.
    pub refs: &'a [u8],
    /// Turn bits, a byte a window.
    pub turns: &'a [u8],
    /// Tree over the windows, in pre-order.
    pub splits: &'a [PlaneSplit],
    /// Geometry of all of it.
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
        /// Place of the first strip in the cluster.
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

/// Collects nodes and clusters, then lays them out as a page. A page is one of triangles or one of strands.
#[derive(Default)]
pub struct PageBuilder<'a> {
    nodes: Vec<Option<Node>>,
    /// Those of triangles; there are none where there are strands.
    clusters: Vec<Cluster<'a>>,
    strands: Vec<&'a StoredStrands>,
    strip_count: usize,
    radius_code: RadiusCode,
    frame: Option<Frame>,
}

/// A finished page.
pub struct BuiltPage {
    /// What goes into the file.
    pub bytes: Vec<u8>,
    /// Triangles and segments of strands.
    pub triangle_count: u32,
    /// Segments of strands alone.
    pub segment_count: u32,
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
    /// A page whose strands, if it has any, have their radii in this code. The boxes of its nodes are given as seen from
    /// `frame`, if there is one.
    pub fn new(radius_code: RadiusCode, frame: Option<Frame>) -> PageBuilder<'a> {
        PageBuilder { radius_code, frame, ..PageBuilder::default() }
    }

    /// Adds a cluster of triangles and gives its number.
    ///
    /// # Panics
    /// If there are no or too many vertices or strips, or too many clusters, or there are strands.
    pub fn cluster(&mut self, vertices: &'a [Vec3], strips: Vec<StripParts<'a>>) -> u8 {
        let count = vertices.len();
        assert!((1..=MAX_CLUSTER_VERTICES).contains(&count), "{count} vertices in a cluster");
        assert!(self.strands.is_empty(), "triangles and strands in one page");
        let number = self.number_cluster(strips.len());
        self.clusters.push(Cluster { vertices, strips });
        number
    }

    /// Adds a cluster of strands and gives its number.
    ///
    /// # Panics
    /// If there are too many windows or clusters, or there are triangles.
    pub fn strands(&mut self, strands: &'a StoredStrands) -> u8 {
        assert!(self.clusters.is_empty(), "triangles and strands in one page");
        let number = self.number_cluster(strands.windows.len());
        self.strands.push(strands);
        number
    }

    /// The number of the next cluster, of so many strips.
    fn number_cluster(&mut self, strips: usize) -> u8 {
        assert!(strips > 0, "no strips in a cluster");
        self.strip_count += strips;
        assert!(self.strip_count <= MAX_PAGE_STRIPS, "too many strips in a page");
        let number = self.clusters.len() + self.strands.len();
        assert!(number < MAX_PAGE_CLUSTERS, "too many clusters in a page");
        number as u8
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
        let grid = match self.frame {
            Some(_) => PageGrid::covering_around_zero(&bounds),
            None => PageGrid::covering(&bounds),
        };
        let mut counts = ByteCounts::default();
        let has_strands = !self.strands.is_empty();
        let strips = self.clusters.iter().flat_map(|c| &c.strips);
        let max_windows = match has_strands {
            true => 0,
            false => strips.map(|s| s.turns.len()).max().unwrap_or(0).max(1),
        };
        let cluster_count = self.clusters.len() + self.strands.len();
        let radius_code = if has_strands { self.radius_code } else { RadiusCode::default() };
        let headers_end = size_of::<PageHeader>() + size_of::<ClusterHeader>() * cluster_count;
        let body = match max_windows {
            0 => write_strands(&self.strands, headers_end, &mut counts)?,
            _ => write_clusters(&self.clusters, headers_end, (max_windows > 1, grid), &mut counts)?,
        };
        let nodes_offset = (headers_end + body.bytes.len()).next_multiple_of(size_of::<WideNode>());
        let stored: Vec<WideNode> = nodes.iter().map(|node| node.on_grid(grid, &body.headers)).collect();
        let header = PageHeader {
            last_node: (nodes.len() - 1) as u16,
            cluster_count: body.headers.len() as u16,
            triangle_count: body.triangle_count,
            first_triangle,
            grid_origin: self.frame.map_or(grid.origin, |frame| frame.origin).to_array(),
            grid_exponent: grid.exponent,
            max_windows: max_windows as u8,
            strip_count: self.strip_count as u32,
            nodes_offset: nodes_offset as u32,
            radius_base: radius_code.base,
            radius_shift: radius_code.shift,
            turn: self.frame.map_or([0.0; 4], |frame| frame.turn),
        };
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        bytes.extend_from_slice(bytemuck::cast_slice(&body.headers));
        bytes.extend_from_slice(&body.bytes);
        bytes.resize(nodes_offset, 0);
        bytes.extend_from_slice(bytemuck::cast_slice(&stored));
        if !has_strands {
            let reach = body.headers.iter().map(|h| h.offset as usize + VERTEX_REACH).max().unwrap_or(0);
            bytes.resize(bytes.len().max(reach), 0);
        }
        counts.nodes = size_of_val(&stored[..]) as u64;
        counts.page_overhead = bytes.len() as u64
            - counts.nodes
            - counts.vertices
            - counts.materials
            - counts.indices
            - counts.strip_trees;
        Ok(BuiltPage {
            bytes,
            triangle_count: body.triangle_count,
            segment_count: if has_strands { body.triangle_count } else { 0 },
            node_count: stored.len() as u32,
            strip_count: self.strip_count as u64,
            cluster_count: cluster_count as u64,
            counts,
        })
    }
}

impl Node {
    fn on_grid(&self, page: PageGrid, clusters: &[ClusterHeader]) -> WideNode {
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
            Children::Strips { cluster, first } => {
                let first = clusters[usize::from(cluster)].first_strip + first;
                (first, cluster, count | WideNode::STRIPS)
            }
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
        let code = VertexCode::of(self.vertices);
        let begin = out.len();
        code.encode(self.vertices, out);
        out.resize(begin + code.byte_count(), 0);
        counts.vertices += code.byte_count() as u64;
        let runs = GeometryRun::of(self.strips.iter().map(|s| (s.geometry, s.refs.len() - 2)));
        write_runs(&runs, (code, self.strips.len()), out, counts)
    }
}

/// Appends the runs of a cluster of so many strips, and gives its header but for where all that is.
fn write_runs(
    runs: &[GeometryRun],
    (code, strips): (VertexCode, usize),
    out: &mut Vec<u8>,
    counts: &mut ByteCounts,
) -> Result<ClusterHeader, PackError> {
    out.extend_from_slice(bytemuck::cast_slice(runs));
    counts.materials += size_of_val(runs) as u64;
    let too_large = |_| PackError::TooLarge("more triangles in a cluster than 16 bits can tell".into());
    Ok(ClusterHeader {
        offset: 0,
        first_triangle: 0,
        triangle_count: u16::try_from(runs[runs.len() - 1].end).map_err(too_large)?,
        first_strip: 0,
        strip_count: strips as u16,
        run_count: runs.len() as u16,
        code,
    })
}

/// Clusters as stored.
struct Body {
    /// What follows the headers.
    bytes: Vec<u8>,
    headers: Vec<ClusterHeader>,
    triangle_count: u32,
}

/// Writes the clusters of a page, which begin at `begin` there, with a table of places if strips are long.
fn write_clusters(
    clusters: &[Cluster],
    begin: usize,
    (is_long, grid): (bool, PageGrid),
    counts: &mut ByteCounts,
) -> Result<Body, PackError> {
    let mut body = Body { bytes: Vec::new(), headers: Vec::with_capacity(clusters.len()), triangle_count: 0 };
    let mut strip_count = 0;
    if is_long {
        body.bytes.resize(PLACE_BYTES * clusters.iter().map(|c| c.strips.len()).sum::<usize>(), 0);
        counts.indices += body.bytes.len() as u64;
    }
    for cluster in clusters {
        let out = &mut body.bytes;
        let first_strip = if is_long {
            let first = strip_count;
            for strip in &cluster.strips {
                let place = (begin + out.len()) as u32;
                out[PLACE_BYTES * strip_count..][..PLACE_BYTES].copy_from_slice(&place.to_le_bytes());
                push_long_strip(out, strip, grid, counts);
                strip_count += 1;
            }
            first
        } else {
            pad(out, begin, WINDOW_RECORD_BYTES);
            let first = (begin + out.len()) / WINDOW_RECORD_BYTES;
            for strip in &cluster.strips {
                push_window(out, strip.turns[0], strip.refs);
            }
            counts.indices += (WINDOW_RECORD_BYTES * cluster.strips.len()) as u64;
            first
        };
        if first_strip + cluster.strips.len() > MAX_PAGE_STRIPS {
            return Err(PackError::TooLarge("more in a page than 16 bits can tell of its strips".into()));
        }
        pad(out, begin, align_of::<GeometryRun>());
        let offset = (begin + out.len()) as u32;
        let header = cluster.write(out, counts)?;
        let (first_triangle, first_strip) = (body.triangle_count, first_strip as u16);
        body.triangle_count += u32::from(header.triangle_count);
        body.headers.push(ClusterHeader { offset, first_triangle, first_strip, ..header });
    }
    Ok(body)
}

/// Writes the clusters of a page of strands, which begin at `begin` there, behind a table of their windows.
fn write_strands(
    clusters: &[&StoredStrands],
    begin: usize,
    counts: &mut ByteCounts,
) -> Result<Body, PackError> {
    let mut body = Body { bytes: Vec::new(), headers: Vec::with_capacity(clusters.len()), triangle_count: 0 };
    let windows = clusters.iter().flat_map(|strands| &strands.windows);
    body.bytes.extend(windows.flat_map(|window| window.record()));
    counts.indices += body.bytes.len() as u64;
    let mut first_strip = 0;
    for strands in clusters {
        let out = &mut body.bytes;
        pad(out, begin, align_of::<GeometryRun>());
        let offset = (begin + out.len()) as u32;
        out.extend_from_slice(&strands.bytes);
        counts.vertices += strands.bytes.len() as u64;
        pad(out, begin, align_of::<GeometryRun>());
        let header = write_runs(&strands.runs, (strands.code, strands.windows.len()), out, counts)?;
        let first_triangle = body.triangle_count;
        body.triangle_count += u32::from(header.triangle_count);
        body.headers.push(ClusterHeader { offset, first_triangle, first_strip, ..header });
        first_strip = first_strip.wrapping_add(header.strip_count);
    }
    Ok(body)
}

/// Appends zeros until a multiple of `unit` follows, counted from the beginning of the page.
fn pad(out: &mut Vec<u8>, begin: usize, unit: usize) {
    out.resize((begin + out.len()).next_multiple_of(unit) - begin, 0);
}

fn push_long_strip(out: &mut Vec<u8>, strip: &StripParts, grid: PageGrid, counts: &mut ByteCounts) {
    let before = out.len();
    let tree: Vec<SplitNode> = strip.splits.iter().map(|s| split_on_grid(s, grid)).collect();
    push_long(out, &tree, strip.turns, strip.refs);
    let tree_bytes = (tree.len() * SPLIT_BYTES) as u64;
    counts.strip_trees += tree_bytes;
    counts.indices += (out.len() - before) as u64 - tree_bytes;
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
