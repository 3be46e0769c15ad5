//! Models to blocks in the scratch file, with all else that the import tells.

use crate::block;
use crate::blocks::Blocks;
use crate::mesh;
use crate::offset::WorldBounds;
use crate::{ConvertError, Observer, Stage};
use raystrips_extmem::{Extent, Spool};
use raystrips_geom::scene::SceneDesc;
use raystrips_meshio::{FileStamp, ImportOptions, TriangleBatch, TriangleSink};
use raystrips_pack::Dropped;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::PathBuf;

/// What an import gave, but for the triangles.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Imported {
    pub scene: SceneDesc,
    pub bounds: WorldBounds,
    pub triangles: u64,
    /// Bytes of a stored id.
    pub id_bytes: u8,
    /// Triangles left out so far.
    pub dropped: Dropped,
    pub warnings: Vec<String>,
    pub files: Vec<FileStamp>,
    /// Offset and bytes of each chunk of blocks in the spool.
    chunks: Vec<(u64, u64)>,
}

impl Imported {
    /// The triangles, which are in `spool`.
    pub fn blocks(&self, spool: Spool, at_a_time: usize) -> Blocks {
        let chunks = self.chunks.iter().map(|&(offset, bytes)| Extent { offset, bytes }).collect();
        Blocks { spool, chunks, triangles: self.triangles, at_a_time, is_consumed: false, keeps_flat: false }
    }

    /// Bytes of all blocks.
    pub fn spool_bytes(&self) -> u64 {
        self.chunks.iter().map(|(_, bytes)| bytes).sum()
    }
}

/// Imports `inputs` into `spool`.
pub(crate) fn import(
    inputs: &[PathBuf],
    options: &ImportOptions,
    spool: Spool,
    observer: &dyn Observer,
) -> Result<(Imported, Spool), ConvertError> {
    let mut sink = Sink {
        spool,
        chunk: Vec::new(),
        chunks: Vec::new(),
        bounds: WorldBounds::EMPTY,
        id_end: 0,
        observer,
        failure: None,
    };
    let import = raystrips_meshio::import(inputs, options, &mut sink);
    let import = import.map_err(|e| sink.failure.take().unwrap_or_else(|| e.into()))?;
    sink.end_chunk().map_err(ConvertError::Scratch)?;
    let mut warnings = import.report.warnings;
    if import.report.warnings_left_out > 0 {
        warnings.push(format!("{} more warnings", import.report.warnings_left_out));
    }
    let imported = Imported {
        scene: import.scene,
        bounds: sink.bounds,
        triangles: import.report.triangles,
        id_bytes: mesh::id_bytes(sink.id_end),
        dropped: Dropped {
            degenerate: 0,
            non_finite: import.report.dropped.non_finite,
            out_of_range: import.report.dropped.out_of_range,
        },
        warnings,
        files: import.report.files,
        chunks: sink.chunks,
    };
    Ok((imported, sink.spool))
}

/// Bytes of blocks that are read together: the list of chunks stays short even if every triangle is a batch of its own,
/// as where materials change all the time.
const CHUNK_BYTES: usize = 1 << 20;

struct Sink<'a> {
    spool: Spool,
    /// Blocks that are not in the spool yet.
    chunk: Vec<u8>,
    chunks: Vec<(u64, u64)>,
    bounds: WorldBounds,
    /// One more than the greatest id.
    id_end: u64,
    observer: &'a dyn Observer,
    /// Why a batch was not taken.
    failure: Option<ConvertError>,
}

impl Sink<'_> {
    fn end_chunk(&mut self) -> io::Result<()> {
        if !self.chunk.is_empty() {
            let extent = self.spool.append(std::mem::take(&mut self.chunk))?;
            self.chunks.push((extent.offset, extent.bytes));
        }
        Ok(())
    }
}

impl TriangleSink for Sink<'_> {
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()> {
        if self.observer.is_cancelled() {
            self.failure = Some(ConvertError::Cancelled);
            return Err(io::ErrorKind::Interrupted.into());
        }
        self.bounds.grow(&batch.positions);
        self.id_end = self.id_end.max(batch.first_triangle_id + batch.triangles.len() as u64);
        self.chunk.append(&mut block::of_batch(&batch));
        if self.chunk.len() < CHUNK_BYTES {
            return Ok(());
        }
        self.end_chunk().map_err(|e| {
            self.failure = Some(ConvertError::Scratch(e));
            io::ErrorKind::Other.into()
        })
    }

    fn progress(&mut self, progress: raystrips_meshio::Progress) {
        self.observer.progress(Stage::Import, progress.bytes_done, progress.bytes_total);
    }
}
