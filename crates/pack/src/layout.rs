//! The fixed-size records of the file, in the order of FORMAT.md. All numbers are little-endian.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use raystrips_geom::{Aabb, NodeGrid};

/// First bytes of a pack. As in PNG: a byte that is not text, a name, line ends that a text transfer would
/// change, and the end-of-file character of old systems.
pub const MAGIC: [u8; 8] = *b"\x89RSP\r\n\x1a\n";
/// Version of the format that this code reads and writes.
pub const FORMAT_VERSION: u32 = 1;
/// Pages and sections begin at multiples of this: the unit of direct I/O and of the page cache.
pub const ALIGNMENT: u64 = 4096;
/// Bytes of [`FileHeader`].
pub const FILE_HEADER_BYTES: usize = size_of::<FileHeader>();
/// Bytes of [`Footer`].
pub const FOOTER_BYTES: usize = size_of::<Footer>();
/// Children of a node.
pub const WIDTH: usize = 8;
/// Most pages; the last number that 32 bits hold is left free.
pub const MAX_PAGES: u64 = PageId::MAX as u64;
/// Most levels of nodes, those above the pages and those in a page counted together.
pub const MAX_DEPTH: usize = 128;
/// Most vertices of a cluster, so that a byte names one.
pub const MAX_CLUSTER_VERTICES: usize = 256;
/// Most nodes of a page, so that 15 bits name one and the top bit is free for [`WideNode::LEAF`].
pub const MAX_PAGE_NODES: usize = 1 << 15;
/// Most clusters of a page, so that a byte names one.
pub const MAX_PAGE_CLUSTERS: usize = 256;
/// Most bytes of the strips of a cluster with their padding, so that 15 bits name where one begins.
pub const MAX_STRIP_BYTES: usize = 1 << 15;
/// Most triangles of a strip.
pub const MAX_STRIP_TRIANGLES: usize = 255;

/// Number of a page: its place in the page directory.
pub type PageId = u32;

/// Begins the file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct FileHeader {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// [`FORMAT_VERSION`].
    pub version: u32,
    /// Zero.
    pub reserved: u32,
}

/// Ends the file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Footer {
    /// Where the section table begins.
    pub sections_offset: u64,
    /// Entries of the section table.
    pub section_count: u32,
    /// CRC-32C of the section table.
    pub sections_checksum: u32,
    /// Length of the whole file.
    pub file_bytes: u64,
    /// [`MAGIC`], so that a cut file is known at once.
    pub magic: [u8; 8],
}

/// One entry of the section table.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct SectionEntry {
    /// A [`Section`].
    pub kind: u32,
    /// CRC-32C of the section.
    pub checksum: u32,
    /// Where it begins.
    pub offset: u64,
    /// Its length, without padding.
    pub bytes: u64,
}

/// Kinds of sections.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// [`PageEntry`] for each page.
    Directory = 1,
    /// [`TopNode`]s; node 0 is the root.
    TopNodes = 2,
    /// [`TopEntry`]s.
    TopEntries = 3,
    /// [`Emitter`]s.
    Emitters = 4,
    /// Original triangle ids; empty if none are kept.
    TriangleIds = 5,
    /// The manifest.
    Manifest = 6,
}

/// Directory entry of a page.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PageEntry {
    /// Where the page begins; a multiple of [`ALIGNMENT`].
    pub offset: u64,
    /// Number of the page's first triangle in the pack.
    pub first_triangle: u64,
    /// Its length, without padding.
    pub bytes: u32,
    /// CRC-32C of the page.
    pub checksum: u32,
    /// Triangles in the page.
    pub triangle_count: u32,
    /// Nodes in the page.
    pub node_count: u32,
}

/// The boxes of up to eight children on the grid of their node.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ChildBoxes {
    /// Plane 0 of each axis.
    pub origin: [f32; 3],
    /// log2 of the distance between planes of each axis.
    pub exponent: [i8; 3],
    /// In a page: the cluster to which the node's strips belong. Above the pages: zero.
    pub cluster: u8,
    /// Least planes: axis, then child.
    pub lo: [[u8; WIDTH]; 3],
    /// Greatest planes: axis, then child.
    pub hi: [[u8; WIDTH]; 3],
}

impl ChildBoxes {
    /// The smallest grid boxes around `bounds`, at most [`WIDTH`] of them; unused places hold inverted boxes.
    ///
    /// # Panics
    /// If there are none or too many, or one is empty or not finite.
    pub fn around(bounds: &[Aabb], cluster: u8) -> ChildBoxes {
        assert!((1..=WIDTH).contains(&bounds.len()), "{} children", bounds.len());
        let grid = NodeGrid::covering(&bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(*b)));
        let (mut lo, mut hi) = ([[255; WIDTH]; 3], [[0; WIDTH]; 3]);
        for (i, b) in bounds.iter().enumerate() {
            for axis in 0..3 {
                lo[axis][i] = grid.round_down(axis, b.min[axis]);
                hi[axis][i] = grid.round_up(axis, b.max[axis]);
            }
        }
        ChildBoxes { origin: grid.origin.to_array(), exponent: grid.exponent, cluster, lo, hi }
    }

    /// The grid.
    pub fn grid(&self) -> NodeGrid {
        NodeGrid { origin: Vec3::from_array(self.origin), exponent: self.exponent }
    }

    /// The box of child `i`.
    pub fn child_bounds(&self, i: usize) -> Aabb {
        let grid = self.grid();
        let corner =
            |q: &[[u8; WIDTH]; 3]| Vec3::from_array([0, 1, 2].map(|axis| grid.plane(axis, q[axis][i])));
        Aabb { min: corner(&self.lo), max: corner(&self.hi) }
    }
}

/// A node inside a page.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct WideNode {
    /// Where the children are.
    pub boxes: ChildBoxes,
    /// [`WideNode::EMPTY`]; or with [`WideNode::LEAF`] set, the place of a strip in the strips of the node's
    /// cluster; or the place of a node in the page, after this one. Used places come first.
    pub child: [u16; WIDTH],
}

impl WideNode {
    /// No child here.
    pub const EMPTY: u16 = u16::MAX;
    /// Set where the child is a strip.
    pub const LEAF: u16 = 1 << 15;
}

/// A node above the pages.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TopNode {
    /// Where the children are.
    pub boxes: ChildBoxes,
    /// [`TopNode::EMPTY`]; or with [`TopNode::ENTRY`] set, the place of a [`TopEntry`]; or the place of a node
    /// after this one. Used places come first.
    pub child: [u32; WIDTH],
}

impl TopNode {
    /// No child here.
    pub const EMPTY: u32 = u32::MAX;
    /// Set where the child is the root of a tree in a page.
    pub const ENTRY: u32 = 1 << 31;
}

/// A way into a page.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TopEntry {
    /// The page.
    pub page: PageId,
    /// The node in it.
    pub node: u32,
}

/// Begins a page.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct PageHeader {
    /// [`WideNode`]s, which follow this header.
    pub node_count: u16,
    /// [`ClusterHeader`]s, which follow the nodes.
    pub cluster_count: u16,
    /// Triangles of all clusters.
    pub triangle_count: u32,
    /// Number of the first triangle in the pack.
    pub first_triangle: u64,
}

/// Where a cluster is in its page. Its geometry runs, strips and vertices follow each other there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ClusterHeader {
    /// Where the runs begin, from the beginning of the page; a multiple of 4.
    pub offset: u32,
    /// Triangles of the clusters before this one.
    pub first_triangle: u32,
    /// Triangles.
    pub triangle_count: u16,
    /// Bytes of the strips, padded to a multiple of 4.
    pub strip_bytes: u16,
    /// Vertices less one.
    pub last_vertex: u8,
    /// Geometry runs less one.
    pub last_run: u8,
    /// Zero.
    pub reserved: u16,
}

/// Triangles of a cluster in a row that belong to one geometry.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct GeometryRun {
    /// Which geometry.
    pub geometry: u32,
    /// First triangle in the cluster after the run.
    pub end: u32,
}

/// An emissive triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Emitter {
    /// Corners, wound as in the mesh.
    pub corners: [[f32; 3]; 3],
    /// Its geometry.
    pub geometry: u32,
}
