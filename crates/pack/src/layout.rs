//! The fixed-size records of the file, in the order of FORMAT.md. All numbers are little-endian.

use crate::vertices::VertexCode;
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DMat3, DVec3, DVec4, Vec3};
use raystrips_geom::affine::condition;
use raystrips_geom::{Aabb, Frame, NodeGrid, PageGrid, RadiusCode, Subgrid};

/// First bytes of a pack. As in PNG: a byte that is not text, a name, line ends that a text transfer would
/// change, and the end-of-file character of old systems.
pub const MAGIC: [u8; 8] = *b"\x89RSP\r\n\x1a\n";
/// Version of the format that this code reads and writes.
pub const FORMAT_VERSION: u32 = 8;
/// Pages and sections begin at multiples of this: the unit of direct I/O and of the page cache.
pub const ALIGNMENT: u64 = 4096;
/// Bytes of [`FileHeader`].
pub const FILE_HEADER_BYTES: usize = size_of::<FileHeader>();
/// Bytes of [`Footer`].
pub const FOOTER_BYTES: usize = size_of::<Footer>();
/// Children of a node.
pub const WIDTH: usize = 8;
/// Most pages, and most roots of trees in them.
pub const MAX_PAGES: u64 = 1 << 29;
/// Most instances.
pub const MAX_INSTANCES: u64 = 1 << 29;
/// Most levels of nodes, those above the pages and those in a page counted together.
pub const MAX_DEPTH: usize = 128;
/// Most vertices of a cluster, so that a byte names one.
pub const MAX_CLUSTER_VERTICES: usize = 256;
/// Most nodes of a page, so that 16 bits name one.
pub const MAX_PAGE_NODES: usize = 1 << 16;
/// Most clusters of a page, so that a byte names one.
pub const MAX_PAGE_CLUSTERS: usize = 256;
/// Most numbers of strips of a page: 16 bits name one.
pub const MAX_PAGE_STRIPS: usize = 1 << 16;
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
    /// [`GeometryBounds`] of each geometry; optional.
    GeometryBounds = 7,
    /// A pack of a simplified scene; optional.
    FineProxy = 8,
    /// A pack of a scene simplified further; optional.
    CoarseProxy = 9,
    /// [`BlockEntry`] for each page; optional.
    AttributeDirectory = 10,
    /// The blocks that [`Section::AttributeDirectory`] lists, one after the other; optional.
    Attributes = 11,
    /// [`BlockEntry`] for each tile; optional.
    TileDirectory = 12,
    /// The codes of tiles of images that [`Section::TileDirectory`] lists, one after the other; optional.
    Tiles = 13,
    /// [`Instance`]s; optional.
    Instances = 14,
}

/// Directory entry of the attributes of a page or of a tile.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct BlockEntry {
    /// Length of the block; 0 if a page has no attributes.
    pub bytes: u32,
    /// CRC-32C of the block.
    pub checksum: u32,
}

impl BlockEntry {
    /// The entry of a block.
    pub fn of(block: &[u8]) -> BlockEntry {
        BlockEntry { bytes: block.len() as u32, checksum: crc32c::crc32c(block) }
    }
}

/// Begins the attributes of a page.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct AttributeHeader {
    /// Records, which follow.
    pub record_count: u32,
    /// Triangles of the page, whose corners follow the records: which record each has, in 16 bits, or in 32 if there are more
    /// than 65536 records.
    pub triangle_count: u32,
    /// Bits of the [`Streams`](raystrips_geom::Streams) that records hold.
    pub streams: u32,
}

/// The box of a geometry; where that has no triangles, least corner +∞ and greatest corner -∞.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct GeometryBounds {
    /// Least corner.
    pub min: [f32; 3],
    /// Greatest corner.
    pub max: [f32; 3],
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

/// A node inside a page: one cache line. Its children are all nodes or all strips, numbered one after the other.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct WideNode {
    /// Plane 0 of each axis: a plane of the page's grid.
    pub origin: [u16; 3],
    /// Zero.
    pub reserved: u16,
    /// log2 of the distance between planes of each axis.
    pub exponent: [i8; 3],
    /// Zero.
    pub reserved_too: u8,
    /// The first child: the number of a node of the page, after this one, or of a strip of `cluster`.
    pub first: u16,
    /// The cluster of the strips; 0 if the children are nodes.
    pub cluster: u8,
    /// How many children, and with [`WideNode::STRIPS`] set, that they are strips.
    pub count: u8,
    /// Least planes: axis, then child.
    pub lo: [[u8; WIDTH]; 3],
    /// Greatest planes: axis, then child.
    pub hi: [[u8; WIDTH]; 3],
}

impl WideNode {
    /// Set where the children are strips.
    pub const STRIPS: u8 = 1 << 7;

    /// Number of children.
    #[inline]
    pub fn child_count(&self) -> usize {
        usize::from(self.count & !WideNode::STRIPS)
    }

    /// True where the children are strips.
    #[inline]
    pub fn holds_strips(&self) -> bool {
        self.count & WideNode::STRIPS != 0
    }

    /// The grid, in a page with grid `page`.
    pub fn grid(&self, page: PageGrid) -> Subgrid {
        Subgrid { page, origin: self.origin, exponent: self.exponent }
    }

    /// The box of child `i`, rounded outward to `f32`.
    pub fn child_bounds(&self, page: PageGrid, i: usize) -> Aabb {
        let grid = self.grid(page);
        let min = |axis: usize| (grid.plane(axis, self.lo[axis][i]) as f32).next_down();
        let max = |axis: usize| (grid.plane(axis, self.hi[axis][i]) as f32).next_up();
        Aabb { min: Vec3::new(min(0), min(1), min(2)), max: Vec3::new(max(0), max(1), max(2)) }
    }
}

/// The boxes of up to eight children above the pages, on the grid of their node.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ChildBoxes {
    /// Plane 0 of each axis.
    pub origin: [f32; 3],
    /// log2 of the distance between planes of each axis.
    pub exponent: [i8; 3],
    /// Zero.
    pub reserved: u8,
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
    pub fn around(bounds: &[Aabb]) -> ChildBoxes {
        assert!((1..=WIDTH).contains(&bounds.len()), "{} children", bounds.len());
        let grid = NodeGrid::covering(&bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(*b)));
        let (mut lo, mut hi) = ([[255; WIDTH]; 3], [[0; WIDTH]; 3]);
        for (i, b) in bounds.iter().enumerate() {
            for axis in 0..3 {
                lo[axis][i] = grid.round_down(axis, b.min[axis]);
                hi[axis][i] = grid.round_up(axis, b.max[axis]);
            }
        }
        ChildBoxes { origin: grid.origin.to_array(), exponent: grid.exponent, reserved: 0, lo, hi }
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

/// A node above the pages.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TopNode {
    /// Where the children are.
    pub boxes: ChildBoxes,
    /// [`TopNode::EMPTY`]; or [`TopNode::NODE`] and the place of a node after this one; or [`TopNode::ENTRY`] and the
    /// place of a [`TopEntry`]; or [`TopNode::INSTANCE`] and the place of an [`Instance`]. Used places come first.
    pub child: [u32; WIDTH],
}

impl TopNode {
    /// No child here.
    pub const EMPTY: u32 = 0;
    /// What a child is: these bits of it.
    pub const KIND: u32 = 7 << 29;
    /// A node above the pages.
    pub const NODE: u32 = 1 << 29;
    /// The root of a tree in a page.
    pub const ENTRY: u32 = 2 << 29;
    /// A part of the scene at a place of its own.
    pub const INSTANCE: u32 = 3 << 29;

    /// Number of children.
    #[inline(always)]
    pub fn child_count(&self) -> usize {
        self.child.iter().map(|&c| usize::from(c != TopNode::EMPTY)).sum()
    }
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

/// A part of the scene, which may stand at many places, at one of them.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Instance {
    /// Three rows a, b, c, d: a coordinate in the scene is `a x + b y + c z + d` of those in the part.
    pub world_from_local: [[f32; 4]; 3],
    /// The [`TopNode`] that is the root of the part.
    pub root: u32,
}

impl Instance {
    /// Most of [`Instance::condition`].
    pub const MAX_CONDITION: f64 = 64.0;

    /// From the part to the scene.
    #[inline]
    pub fn world_from_local(&self) -> DAffine3 {
        let row = |i: usize| DVec4::from_array(self.world_from_local[i].map(f64::from));
        let [x, y, z] = [row(0), row(1), row(2)];
        DAffine3 {
            matrix3: DMat3::from_cols(x.truncate(), y.truncate(), z.truncate()).transpose(),
            translation: DVec3::new(x.w, y.w, z.w),
        }
    }

    /// The [`condition`] of the matrix.
    pub fn condition(&self) -> f64 {
        let affine = self.world_from_local();
        if affine.translation.is_finite() { condition(affine.matrix3) } else { f64::INFINITY }
    }
}

/// Begins a page.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct PageHeader {
    /// [`WideNode`]s, at least one, less one.
    pub last_node: u16,
    /// [`ClusterHeader`]s, which follow this header.
    pub cluster_count: u16,
    /// Triangles of all clusters.
    pub triangle_count: u32,
    /// Number of the first triangle in the pack.
    pub first_triangle: u64,
    /// Plane 0 of each axis of the page's grid.
    pub grid_origin: [f32; 3],
    /// log2 of the distance between planes of each axis.
    pub grid_exponent: [i8; 3],
    /// Most windows of a strip. Where it is 1, the number of a strip says where it is. 0: the page is one of strands.
    pub max_windows: u8,
    /// Strips of all clusters.
    pub strip_count: u32,
    /// Where the nodes begin, from the beginning of the page: a multiple of a cache line.
    pub nodes_offset: u32,
    /// Bits of the radius of code 0; 0 in a page without strands.
    pub radius_base: u32,
    /// log2 of the distance of bits from the radius of one code to that of the next.
    pub radius_shift: u32,
    /// The turn from the axes of the scene to those of the boxes: a quaternion x, y, z, w. All zero: none.
    pub turn: [f32; 4],
}

impl PageHeader {
    /// The page's grid; in its frame, if it has one.
    pub fn grid(&self) -> PageGrid {
        match self.is_turned() {
            true => PageGrid::around_zero(self.grid_exponent),
            false => PageGrid { origin: Vec3::from_array(self.grid_origin), exponent: self.grid_exponent },
        }
    }

    /// Whether boxes are along other axes than those of the scene.
    #[inline(always)]
    pub fn is_turned(&self) -> bool {
        self.turn != [0.0; 4]
    }

    /// The frame that boxes are in, if the page is turned.
    #[inline(always)]
    pub fn frame(&self) -> Frame {
        Frame { origin: Vec3::from_array(self.grid_origin), turn: self.turn }
    }

    /// Whether it is a page of strands; else it is one of triangles.
    #[inline(always)]
    pub fn holds_strands(&self) -> bool {
        self.max_windows == 0
    }

    /// How radii of strands are stored.
    #[inline(always)]
    pub fn radius_code(&self) -> RadiusCode {
        RadiusCode { base: self.radius_base, shift: self.radius_shift }
    }
}

/// Where a cluster is in its page. Its strips, its vertices and its geometry runs follow each other there.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ClusterHeader {
    /// Where the vertices begin, from the beginning of the page; a multiple of 4.
    pub offset: u32,
    /// Triangles of the clusters before this one.
    pub first_triangle: u32,
    /// Triangles.
    pub triangle_count: u16,
    /// Number of the first strip; the others count up from there.
    pub first_strip: u16,
    /// Strips.
    pub strip_count: u16,
    /// Geometry runs.
    pub run_count: u16,
    /// How the vertices are stored.
    pub code: VertexCode,
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

impl GeometryRun {
    /// The runs of strips with so many triangles of a geometry each.
    pub(crate) fn of(strips: impl Iterator<Item = (u32, usize)>) -> Vec<GeometryRun> {
        let mut runs: Vec<GeometryRun> = Vec::new();
        let mut end = 0;
        for (geometry, triangles) in strips {
            end += triangles as u32;
            match runs.last_mut() {
                Some(run) if run.geometry == geometry => run.end = end,
                _ => runs.push(GeometryRun { geometry, end }),
            }
        }
        runs
    }
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
