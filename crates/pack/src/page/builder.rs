//! Makes the bytes of a page.

use crate::PackError;
use crate::layout::*;
use crate::manifest::ByteCounts;
use crate::strip_record::{SPLIT_BYTES, SplitNode, push_strip};
use glam::Vec3;
use raystrips_geom::Aabb;
use raystrips_geom::strip::PlaneSplit;

/// A strip to be stored.
#[derive(Clone, Copy, Debug)]
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

/// Collects nodes and clusters, then lays them out as a page.
#[derive(Default)]
pub struct PageBuilder {
    nodes: Vec<WideNode>,
    clusters: Vec<ClusterBuilder>,
}

#[derive(Default)]
struct ClusterBuilder {
    runs: Vec<GeometryRun>,
    strips: Vec<u8>,
    vertices: Vec<Vec3>,
    strip_count: u64,
    split_count: u64,
    triangle_count: u32,
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

impl PageBuilder {
    /// Begins a cluster and gives its number.
    ///
    /// # Panics
    /// If there are no or too many vertices, or too many clusters.
    pub fn cluster(&mut self, vertices: Vec<Vec3>) -> u8 {
        assert!(
            (1..=MAX_CLUSTER_VERTICES).contains(&vertices.len()),
            "{} vertices in a cluster",
            vertices.len()
        );
        assert!(self.clusters.len() < MAX_PAGE_CLUSTERS, "too many clusters in a page");
        self.clusters.push(ClusterBuilder { vertices, ..ClusterBuilder::default() });
        (self.clusters.len() - 1) as u8
    }

    /// Adds a node with children in `bounds`, each still to be linked, and gives its number. Its strips are
    /// those of `cluster`.
    ///
    /// # Panics
    /// If there are more nodes than a page can number.
    pub fn node(&mut self, cluster: u8, bounds: &[Aabb]) -> u16 {
        assert!(self.nodes.len() < MAX_PAGE_NODES, "too many nodes in a page");
        self.nodes
            .push(WideNode { boxes: ChildBoxes::around(bounds, cluster), child: [WideNode::EMPTY; WIDTH] });
        (self.nodes.len() - 1) as u16
    }

    /// Makes node `child` the child of `node` at `slot`.
    pub fn link(&mut self, node: u16, slot: usize, child: u16) {
        debug_assert!(child > node, "children come after their parents");
        self.nodes[usize::from(node)].child[slot] = child;
    }

    /// Adds a strip to the cluster of `node` and makes it the child at `slot`.
    ///
    /// # Panics
    /// If the cluster's strips outgrow 15 bits.
    pub fn strip(&mut self, node: u16, slot: usize, strip: StripParts) {
        let node = &mut self.nodes[usize::from(node)];
        let grid = node.boxes.grid();
        let split = |s: &PlaneSplit| SplitNode {
            axis: s.axis,
            reversed: s.reversed,
            lower_max: grid.round_up(usize::from(s.axis), s.lower_max),
            upper_min: grid.round_down(usize::from(s.axis), s.upper_min),
        };
        let splits: Vec<SplitNode> = strip.splits.iter().map(split).collect();
        let cluster = &mut self.clusters[usize::from(node.boxes.cluster)];
        let offset = push_strip(&mut cluster.strips, &splits, strip.turns, strip.refs);
        assert!(cluster.strips.len() < MAX_STRIP_BYTES, "too many strips in a cluster");
        node.child[slot] = WideNode::LEAF | offset as u16;
        cluster.strip_count += 1;
        cluster.split_count += splits.len() as u64;
        cluster.triangle_count += strip.refs.len() as u32 - 2;
        match cluster.runs.last_mut() {
            Some(run) if run.geometry == strip.geometry => run.end = cluster.triangle_count,
            _ => cluster.runs.push(GeometryRun { geometry: strip.geometry, end: cluster.triangle_count }),
        }
    }

    /// Bytes of the page as it stands.
    pub fn byte_count(&self) -> usize {
        size_of::<PageHeader>()
            + self.nodes.len() * size_of::<WideNode>()
            + self.clusters.iter().map(ClusterBuilder::byte_count).sum::<usize>()
    }

    /// Lays out the page whose first triangle has number `first_triangle` in the pack.
    ///
    /// # Panics
    /// If a cluster has no strips.
    pub fn finish(mut self, first_triangle: u64) -> Result<BuiltPage, PackError> {
        let bytes_expected = self.byte_count();
        let triangle_count = self.clusters.iter().map(|c| c.triangle_count).sum();
        let header = PageHeader {
            node_count: self.nodes.len() as u16,
            cluster_count: self.clusters.len() as u16,
            triangle_count,
            first_triangle,
        };
        let mut bytes = Vec::with_capacity(bytes_expected);
        bytes.extend_from_slice(bytemuck::bytes_of(&header));
        bytes.extend_from_slice(bytemuck::cast_slice(&self.nodes));
        let mut counts = ByteCounts {
            nodes: (bytes.len() - size_of::<PageHeader>()) as u64,
            page_overhead: size_of::<PageHeader>() as u64,
            ..ByteCounts::default()
        };
        let mut offset = bytes.len() + self.clusters.len() * size_of::<ClusterHeader>();
        let mut first_in_page = 0;
        for cluster in &mut self.clusters {
            cluster.pad();
            let header = cluster.header(offset, first_in_page)?;
            bytes.extend_from_slice(bytemuck::bytes_of(&header));
            offset += cluster.blob_bytes();
            first_in_page += cluster.triangle_count;
            cluster.count(&mut counts);
        }
        for cluster in &self.clusters {
            bytes.extend_from_slice(bytemuck::cast_slice(&cluster.runs));
            bytes.extend_from_slice(&cluster.strips);
            bytes.extend_from_slice(bytemuck::cast_slice(&cluster.vertices));
        }
        debug_assert_eq!(bytes.len(), bytes_expected);
        Ok(BuiltPage {
            bytes,
            triangle_count,
            node_count: self.nodes.len() as u32,
            strip_count: self.clusters.iter().map(|c| c.strip_count).sum(),
            cluster_count: self.clusters.len() as u64,
            counts,
        })
    }
}

impl ClusterBuilder {
    fn pad(&mut self) {
        self.strips.resize(self.strips.len().next_multiple_of(4), 0);
    }

    fn blob_bytes(&self) -> usize {
        self.runs.len() * size_of::<GeometryRun>()
            + self.strips.len().next_multiple_of(4)
            + self.vertices.len() * size_of::<Vec3>()
    }

    fn byte_count(&self) -> usize {
        size_of::<ClusterHeader>() + self.blob_bytes()
    }

    fn header(&self, offset: usize, first_triangle: u32) -> Result<ClusterHeader, PackError> {
        assert!(!self.runs.is_empty(), "a cluster without strips");
        let too_many =
            |_| PackError::TooLarge("more than 256 geometries or 65,535 triangles in a cluster".into());
        Ok(ClusterHeader {
            offset: offset as u32,
            first_triangle,
            triangle_count: u16::try_from(self.triangle_count).map_err(too_many)?,
            strip_bytes: self.strips.len() as u16,
            last_vertex: (self.vertices.len() - 1) as u8,
            last_run: u8::try_from(self.runs.len() - 1).map_err(too_many)?,
            reserved: 0,
        })
    }

    fn count(&self, counts: &mut ByteCounts) {
        let trees = self.split_count * SPLIT_BYTES as u64;
        counts.vertices += (self.vertices.len() * size_of::<Vec3>()) as u64;
        counts.strip_trees += trees;
        counts.indices += self.strips.len() as u64 - trees;
        counts.materials += (self.runs.len() * size_of::<GeometryRun>()) as u64;
        counts.page_overhead += size_of::<ClusterHeader>() as u64;
    }
}
