//! What is in a pack, in numbers and names. The only part of the file that is encoded with bincode; this module
//! is the only one that knows.

use crate::PackError;
use raystrips_geom::scene::SceneDesc;
use serde::{Deserialize, Serialize};

/// Most bytes of a manifest: some millions of named geometries.
pub const MAX_MANIFEST_BYTES: usize = 1 << 27;

/// What is in a pack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Program and version that wrote it.
    pub generator: String,
    /// Triangles and segments of strands, those of parts once.
    pub primitives: u64,
    /// The same, those of parts as often as instances show them.
    pub shown: u64,
    /// Instances.
    pub instances: u64,
    /// Segments of strands alone.
    pub segments: u64,
    /// Different positions; pages hold those that several clusters use more than once.
    pub vertices: u64,
    /// Strips.
    pub strips: u64,
    /// Clusters.
    pub clusters: u64,
    /// Pages.
    pub pages: u64,
    /// Most levels of nodes from the root to a strip.
    pub depth: u32,
    /// Most bytes of a page that the conversion aimed at.
    pub page_size: u32,
    /// Least corner of all triangles.
    pub bounds_min: [f32; 3],
    /// Greatest corner of all triangles.
    pub bounds_max: [f32; 3],
    /// Original positions are those of the pack plus this.
    pub scene_offset: [f64; 3],
    /// Most by which a coordinate of the pack differs from that of the input less the offset.
    pub position_error: f64,
    /// Most by which a radius of the pack differs from that of the input, as a share of it, but for those that are too small
    /// to be told apart from nothing.
    pub radius_error: f64,
    /// Bytes of an original triangle id, 0 if none are kept.
    pub id_bytes: u8,
    /// Where the bytes of the file went.
    pub bytes: ByteCounts,
    /// The part of that which pages of strands take, and their share of the nodes above the pages.
    pub strand_bytes: ByteCounts,
    /// Triangles of the input that are not in the pack.
    pub dropped: Dropped,
    /// Materials, geometries, lights, cameras; positions are those of the pack.
    pub scene: SceneDesc,
}

/// Where the bytes of a pack went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ByteCounts {
    /// Positions.
    pub vertices: u64,
    /// Vertex references, turns, counts and places of strips.
    pub indices: u64,
    /// Trees along strips.
    pub strip_trees: u64,
    /// Nodes in pages and above.
    pub nodes: u64,
    /// Which triangle has which geometry.
    pub materials: u64,
    /// Headers, directory and padding of pages.
    pub page_overhead: u64,
    /// Original triangle ids.
    pub ids: u64,
    /// Attributes of vertices, with their directory.
    pub attributes: u64,
    /// Tiles of images, with their directory.
    pub textures: u64,
}

impl ByteCounts {
    /// All that tracing needs, without materials, ids, emitters and the manifest.
    pub fn tracing(&self) -> u64 {
        self.vertices + self.indices + self.strip_trees + self.nodes + self.page_overhead
    }

    /// True where no count is greater than that of `all`.
    pub(crate) fn is_part_of(&self, all: &ByteCounts) -> bool {
        let counts = |c: &ByteCounts| {
            [
                c.vertices,
                c.indices,
                c.strip_trees,
                c.nodes,
                c.materials,
                c.page_overhead,
                c.ids,
                c.attributes,
                c.textures,
            ]
        };
        counts(self).iter().zip(counts(all)).all(|(&part, all)| part <= all)
    }

    /// All of it; `None` where that is beyond 64 bits, which only a hostile file can say.
    pub(crate) fn total(&self) -> Option<u64> {
        let ByteCounts {
            vertices,
            indices,
            strip_trees,
            nodes,
            materials,
            page_overhead,
            ids,
            attributes,
            textures,
        } = *self;
        [indices, strip_trees, nodes, materials, page_overhead, ids, attributes, textures]
            .into_iter()
            .try_fold(vertices, u64::checked_add)
    }

    /// The counts less those of a part of them.
    #[must_use]
    pub fn without(&self, part: &ByteCounts) -> ByteCounts {
        ByteCounts {
            vertices: self.vertices - part.vertices,
            indices: self.indices - part.indices,
            strip_trees: self.strip_trees - part.strip_trees,
            nodes: self.nodes - part.nodes,
            materials: self.materials - part.materials,
            page_overhead: self.page_overhead - part.page_overhead,
            ids: self.ids - part.ids,
            attributes: self.attributes - part.attributes,
            textures: self.textures - part.textures,
        }
    }

    /// Component-wise sum.
    pub fn add(&mut self, other: &ByteCounts) {
        self.vertices += other.vertices;
        self.indices += other.indices;
        self.strip_trees += other.strip_trees;
        self.nodes += other.nodes;
        self.materials += other.materials;
        self.page_overhead += other.page_overhead;
        self.ids += other.ids;
        self.attributes += other.attributes;
        self.textures += other.textures;
    }
}

/// Triangles of the input that were left out, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dropped {
    /// Without area.
    pub degenerate: u64,
    /// With a corner that is not a number.
    pub non_finite: u64,
    /// With a corner that does not exist or is too far out for f32 arithmetic.
    pub out_of_range: u64,
}

impl Manifest {
    /// Triangles.
    pub fn triangles(&self) -> u64 {
        self.primitives - self.segments
    }

    /// Bytes a triangle that tracing needs.
    pub fn bytes_per_triangle(&self) -> f64 {
        self.bytes.without(&self.strand_bytes).tracing() as f64 / self.triangles().max(1) as f64
    }

    /// Bytes a segment of a strand that tracing needs.
    pub fn bytes_per_segment(&self) -> f64 {
        self.strand_bytes.tracing() as f64 / self.segments.max(1) as f64
    }

    pub(crate) fn encode(&self) -> Result<Vec<u8>, PackError> {
        let bytes = bincode::serde::encode_to_vec(self, bincode::config::standard())
            .map_err(|e| PackError::TooLarge(format!("manifest: {e}")))?;
        if bytes.len() > MAX_MANIFEST_BYTES {
            return Err(PackError::TooLarge(
                "names of geometries and materials fill more than 128 MiB".into(),
            ));
        }
        Ok(bytes)
    }

    pub(crate) fn decode(bytes: &[u8]) -> Result<Manifest, PackError> {
        // bincode takes memory for a string by what the file says, up to its limit, which must be a constant.
        // It counts numbers as they are in memory: at most 8 for a byte of the file.
        const SMALL: usize = 1 << 12;
        const MIDDLE: usize = 1 << 18;
        match bytes.len() {
            n if n <= SMALL => decode_within::<{ 8 * SMALL }>(bytes),
            n if n <= MIDDLE => decode_within::<{ 8 * MIDDLE }>(bytes),
            n if n <= MAX_MANIFEST_BYTES => decode_within::<{ 8 * MAX_MANIFEST_BYTES }>(bytes),
            _ => Err(PackError::corrupt("manifest: too long")),
        }
    }
}

fn decode_within<const LIMIT: usize>(bytes: &[u8]) -> Result<Manifest, PackError> {
    match bincode::serde::decode_from_slice(bytes, bincode::config::standard().with_limit::<LIMIT>()) {
        Ok((manifest, used)) if used == bytes.len() => Ok(manifest),
        Ok(_) => Err(PackError::corrupt("manifest: bytes left over")),
        Err(e) => Err(PackError::corrupt(format!("manifest: {e}"))),
    }
}
