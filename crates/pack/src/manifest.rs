//! What is in a pack, in numbers and names. The only part of the file that is encoded with bincode; this module
//! is the only one that knows.

use crate::PackError;
use raystrips_geom::scene::SceneDesc;
use serde::{Deserialize, Serialize};

/// Most bytes that a manifest may take: some millions of named geometries.
const MANIFEST_LIMIT: usize = 1 << 30;

/// What is in a pack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Program and version that wrote it.
    pub generator: String,
    /// Triangles.
    pub triangles: u64,
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
    /// Bytes of an original triangle id, 0 if none are kept.
    pub id_bytes: u8,
    /// Where the bytes of the file went.
    pub bytes: ByteCounts,
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
    /// Vertex references, turns and counts of strips.
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
}

impl ByteCounts {
    /// All that tracing needs, without materials, ids, emitters and the manifest.
    pub fn tracing(&self) -> u64 {
        self.vertices + self.indices + self.strip_trees + self.nodes + self.page_overhead
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
    /// Bytes a triangle that tracing needs.
    pub fn bytes_per_triangle(&self) -> f64 {
        self.bytes.tracing() as f64 / self.triangles.max(1) as f64
    }

    pub(crate) fn encode(&self) -> Result<Vec<u8>, PackError> {
        bincode::serde::encode_to_vec(self, config())
            .map_err(|e| PackError::TooLarge(format!("manifest: {e}")))
    }

    pub(crate) fn decode(bytes: &[u8]) -> Result<Manifest, PackError> {
        match bincode::serde::decode_from_slice(bytes, config()) {
            Ok((manifest, used)) if used == bytes.len() => Ok(manifest),
            Ok(_) => Err(PackError::corrupt("manifest has bytes left over")),
            Err(e) => Err(PackError::corrupt(format!("manifest: {e}"))),
        }
    }
}

fn config() -> impl bincode::config::Config {
    bincode::config::standard().with_limit::<MANIFEST_LIMIT>()
}
