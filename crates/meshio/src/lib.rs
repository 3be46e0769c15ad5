//! Reads OBJ, glTF 2.0, PLY, hair and [scene files](scene_file) as a stream of self-contained batches of triangles and
//! strands, and what else makes up the scene as a [`SceneDesc`].
//!
//! Input is hostile until checked: no number from a file sizes an allocation or a loop before it has been compared
//! with the bytes that are there, and nothing panics. Files only lead to other files in their own folder or below.
//!
//! Triangles are numbered in reading order over all inputs, polygons counting as the triangles they are cut into;
//! triangles that are dropped keep their number. Memory does not grow with the input: PLY and glTF positions stay in
//! the mapped file; of OBJ and ASCII PLY 24 bytes a vertex are kept, in memory up to [`ImportOptions::kept_bytes`] and
//! in a file beyond.

mod emit;
mod error;
mod export;
mod gltf;
mod hair;
mod image;
mod import;
mod instances;
mod kept;
mod map;
mod number;
mod obj;
mod ply;
mod polygon;
mod reference;
mod repeated;
mod resident;
pub mod scene_file;
mod scratch;
mod spool;
mod stamp;
mod strand;
mod survey;
#[cfg(test)]
mod testing;

pub use error::{ImportError, Place};
pub use export::{ExportFormat, ExportMesh, export};
pub use image::{ImageSource, Pixels};
pub use import::import;
pub use stamp::FileStamp;
pub use survey::{Survey, survey};

use glam::DAffine3;
use raystrips_geom::Streams;
use raystrips_geom::scene::SceneDesc;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::PathBuf;

/// Triangles that share a geometry; at most 65,536 of them, and as many positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleBatch {
    /// Index into [`SceneDesc::geometries`].
    pub geometry: u32,
    /// What they belong to: 0 to the scene, others to a part that [`Import::instances`] show. Batches of a part follow each
    /// other.
    pub part: u32,
    /// World space, or that of the part; finite, no coordinate beyond ±1e18. A vertex of the file appears once, unless it has
    /// several attributes.
    pub positions: Vec<[f64; 3]>,
    /// Indices into `positions`, all in range. Counterclockwise as seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Number of the first triangle in reading order over all inputs; the others follow without gaps.
    pub first_triangle_id: u64,
    /// What vertices have besides positions.
    pub streams: Streams,
    /// A record of these for each position, as [`Attributes::encode`](raystrips_geom::Attributes::encode) writes it; normals
    /// are in the space of positions. A vertex of the file that has several appears as often.
    pub attributes: Vec<u8>,
}

/// Strands of one geometry: rows of points with radii, at most 65,536 points in all. Longer strands go on in the next
/// batch, which begins with the last point of this one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrandBatch {
    /// Index into [`SceneDesc::geometries`].
    pub geometry: u32,
    /// World space, as those of triangles; strand after strand.
    pub positions: Vec<[f64; 3]>,
    /// Radius at each position: finite, not below zero.
    pub radii: Vec<f32>,
    /// Points of each strand, at least two.
    pub lengths: Vec<u32>,
    /// Number of the first segment in reading order: segments and triangles are numbered together. The others follow
    /// without gaps.
    pub first_segment_id: u64,
}

/// How far an import has come, in bytes of its model files, not counting the files that those name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Read so far.
    pub bytes_done: u64,
    /// To be read in all.
    pub bytes_total: u64,
}

/// Takes what an import reads.
pub trait TriangleSink {
    /// Takes the next batch; never an empty one. An error ends the import with [`ImportError::Sink`].
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()>;

    /// The same for strands; who wants triangles alone need not take them.
    fn strands(&mut self, _batch: StrandBatch) -> io::Result<()> {
        Ok(())
    }

    /// Called every now and then.
    fn progress(&mut self, _progress: Progress) {}
}

/// What to do where files leave a choice, and what an import may use.
#[derive(Clone, Debug)]
pub struct ImportOptions {
    /// Drop and count triangles that name vertices that do not exist, where otherwise the import fails.
    pub drop_out_of_range: bool,
    /// Folder for what does not fit into `kept_bytes`; the system's folder for temporary files if not given. Files
    /// there have no names, so that nothing is left behind however the import ends.
    pub scratch: Option<PathBuf>,
    /// Bytes of memory for what has to be kept until a file ends: the vertices of OBJ and ASCII PLY, 24 bytes each,
    /// and faces that name vertices further on. The rest goes to `scratch`. Also for pages of files that are read in
    /// place, which count as this process's memory even if the system may take them away. Up to 160 MiB more may
    /// be used, and the batches that the sink keeps.
    pub kept_bytes: u64,
    /// Width of strands where files have lines but do not say how wide they are, in units of the file; such lines are left
    /// out if it is not given.
    pub strand_width: Option<f64>,
    /// Leave out normals, texture coordinates and colors of vertices, and textures.
    pub bare: bool,
    /// Send what is shown many times once, as a part, where otherwise it is repeated.
    pub instances: bool,
}

impl Default for ImportOptions {
    fn default() -> ImportOptions {
        ImportOptions {
            drop_out_of_range: false,
            scratch: None,
            kept_bytes: 1 << 30,
            strand_width: None,
            bare: false,
            instances: false,
        }
    }
}

/// A finished import.
#[derive(Clone, Debug, Default)]
pub struct Import {
    /// All but the triangles.
    pub scene: SceneDesc,
    /// Where parts are shown, if [`ImportOptions::instances`].
    pub instances: Vec<Instance>,
    /// Where the images of the scene are, which are not read yet.
    pub images: Vec<ImageSource>,
    /// What happened on the way.
    pub report: ImportReport,
}

/// A part of the scene at a place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instance {
    /// That of [`TriangleBatch::part`], not 0.
    pub part: u32,
    /// From the part's space to the world. Its [condition](raystrips_geom::affine::condition) is at most 32, and all that it
    /// shows is within the bounds for positions.
    pub world_from_local: DAffine3,
}

/// What an import did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportReport {
    /// Triangles sent to the sink.
    pub triangles: u64,
    /// Segments of strands sent to the sink.
    pub segments: u64,
    /// Triangles and segments read but not sent.
    pub dropped: Dropped,
    /// Every file that was read, as it was before.
    pub files: Vec<FileStamp>,
    /// The first twenty things worth knowing, a line each that names the file.
    pub warnings: Vec<String>,
    /// How many more warnings there were.
    pub warnings_left_out: u64,
}

/// Triangles and segments read but not sent to the sink. Triangles without area are sent: whoever welds positions finds them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// With a position that is infinite or not a number.
    pub non_finite: u64,
    /// With a position beyond ±1e18, or, if [`ImportOptions::drop_out_of_range`], an index of no vertex.
    pub out_of_range: u64,
}

pub(crate) type Result<T> = std::result::Result<T, ImportError>;
