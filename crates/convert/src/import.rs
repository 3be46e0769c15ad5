//! Models to blocks in the scratch file, with all else that the import tells.

use crate::block;
use crate::blocks::Blocks;
use crate::mesh;
use crate::offset::WorldBounds;
use crate::strands::{self, RadiusRange};
use crate::{ConvertError, Observer, Stage};
use glam::DAffine3;
use raystrips_extmem::{Extent, Spool};
use raystrips_geom::scene::SceneDesc;
use raystrips_meshio::{
    FileStamp, ImageSource, ImportOptions, Instance, StrandBatch, TriangleBatch, TriangleSink,
};
use raystrips_pack::Dropped;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

/// What an import gave, but for the triangles.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Imported {
    pub scene: SceneDesc,
    /// Of all that is shown.
    pub bounds: WorldBounds,
    /// Triangles, those of parts once.
    pub triangles: u64,
    /// Triangles of the scene, then those of parts that instances show.
    pub parts: Vec<Part>,
    pub instances: Vec<Instance>,
    /// Windows that strands are cut into.
    pub strand_windows: u64,
    /// Points of strands.
    pub strand_points: u64,
    pub radii: RadiusRange,
    /// Bytes of a stored id.
    pub id_bytes: u8,
    /// Triangles left out so far.
    pub dropped: Dropped,
    pub warnings: Vec<String>,
    pub files: Vec<FileStamp>,
    /// Where the images of the scene are.
    pub images: Vec<ImageSource>,
    /// Offset and bytes in the spool of each chunk of blocks of strands.
    strand_chunks: Vec<(u64, u64)>,
}

/// Triangles that stand in the same space.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Part {
    pub triangles: u64,
    pub bounds: WorldBounds,
    /// Offset and bytes in the spool of each chunk of blocks.
    chunks: Vec<(u64, u64)>,
}

/// What was imported, in blocks.
pub(crate) struct ImportedBlocks {
    /// Triangles of the scene, then those of parts.
    pub parts: Vec<Blocks>,
    /// Windows of strands.
    pub strands: Blocks,
}

impl Imported {
    /// All blocks, which are in `spool`.
    pub fn blocks(&self, spool: Spool, at_a_time: usize) -> ImportedBlocks {
        let spool = Arc::new(spool);
        let blocks = |chunks: &[(u64, u64)], triangles| Blocks {
            spool: spool.clone(),
            chunks: chunks.iter().map(|&(offset, bytes)| Extent { offset, bytes }).collect(),
            triangles,
            at_a_time,
            is_consumed: false,
            keeps_flat: false,
        };
        ImportedBlocks {
            parts: self.parts.iter().map(|part| blocks(&part.chunks, part.triangles)).collect(),
            strands: blocks(&self.strand_chunks, self.strand_windows),
        }
    }

    /// Bytes of all blocks.
    pub fn spool_bytes(&self) -> u64 {
        let of_parts = self.parts.iter().flat_map(|part| &part.chunks);
        of_parts.chain(&self.strand_chunks).map(|(_, bytes)| bytes).sum()
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
        parts: vec![OpenPart::default()],
        present: 0,
        strands: Chunks::default(),
        strand_windows: 0,
        strand_points: 0,
        radii: RadiusRange::EMPTY,
        strand_bounds: WorldBounds::EMPTY,
        id_end: 0,
        observer,
        failure: None,
    };
    let import = raystrips_meshio::import(inputs, options, &mut sink);
    let import = import.map_err(|e| sink.failure.take().unwrap_or_else(|| e.into()))?;
    sink.parts[sink.present].chunks.end(&mut sink.spool).map_err(ConvertError::Scratch)?;
    sink.strands.end(&mut sink.spool).map_err(ConvertError::Scratch)?;
    let mut warnings = import.report.warnings;
    if import.report.warnings_left_out > 0 {
        warnings.push(format!("{} more warnings", import.report.warnings_left_out));
    }
    let parts: Vec<Part> = sink.parts.into_iter().map(OpenPart::finish).collect();
    let mut bounds = parts[0].bounds;
    bounds.grow_around(&sink.strand_bounds, &DAffine3::IDENTITY);
    for instance in &import.instances {
        bounds.grow_around(&parts[instance.part as usize].bounds, &instance.world_from_local);
    }
    let imported = Imported {
        scene: import.scene,
        bounds,
        triangles: import.report.triangles,
        parts,
        instances: import.instances,
        strand_windows: sink.strand_windows,
        strand_points: sink.strand_points,
        radii: sink.radii,
        id_bytes: mesh::id_bytes(sink.id_end),
        dropped: Dropped {
            degenerate: 0,
            non_finite: import.report.dropped.non_finite,
            out_of_range: import.report.dropped.out_of_range,
        },
        warnings,
        files: import.report.files,
        images: import.images,
        strand_chunks: sink.strands.done,
    };
    Ok((imported, sink.spool))
}

/// Bytes of blocks that are read together: the list of chunks stays short even if every triangle is a batch of its own,
/// as where materials change all the time.
const CHUNK_BYTES: usize = 1 << 20;

/// Blocks of one kind on their way to the spool.
#[derive(Default)]
struct Chunks {
    /// Blocks that are not in the spool yet.
    open: Vec<u8>,
    /// Offset and bytes of those that are.
    done: Vec<(u64, u64)>,
}

impl Chunks {
    fn push(&mut self, mut block: Vec<u8>, spool: &mut Spool) -> io::Result<()> {
        self.open.append(&mut block);
        if self.open.len() < CHUNK_BYTES { Ok(()) } else { self.end(spool) }
    }

    fn end(&mut self, spool: &mut Spool) -> io::Result<()> {
        if !self.open.is_empty() {
            let extent = spool.append(std::mem::take(&mut self.open))?;
            self.done.push((extent.offset, extent.bytes));
        }
        Ok(())
    }
}

/// A part on its way.
#[derive(Default)]
struct OpenPart {
    triangles: u64,
    bounds: WorldBounds,
    chunks: Chunks,
}

impl OpenPart {
    fn finish(self) -> Part {
        Part { triangles: self.triangles, bounds: self.bounds, chunks: self.chunks.done }
    }
}

struct Sink<'a> {
    spool: Spool,
    /// The scene, then parts.
    parts: Vec<OpenPart>,
    /// The one that the last batch belonged to.
    present: usize,
    strands: Chunks,
    strand_windows: u64,
    strand_points: u64,
    radii: RadiusRange,
    strand_bounds: WorldBounds,
    /// One more than the greatest id.
    id_end: u64,
    observer: &'a dyn Observer,
    /// Why a batch was not taken.
    failure: Option<ConvertError>,
}

impl Sink<'_> {
    fn check_cancelled(&mut self) -> io::Result<()> {
        if self.observer.is_cancelled() {
            self.failure = Some(ConvertError::Cancelled);
            return Err(io::ErrorKind::Interrupted.into());
        }
        Ok(())
    }

    /// Adds a batch to its part: chunks are of one part alone.
    fn push(&mut self, batch: &TriangleBatch) -> io::Result<()> {
        let number = batch.part as usize;
        if number != self.present {
            self.parts[self.present].chunks.end(&mut self.spool)?;
            self.present = number;
        }
        if number >= self.parts.len() {
            self.parts.resize_with(number + 1, OpenPart::default);
        }
        let part = &mut self.parts[number];
        part.triangles += batch.triangles.len() as u64;
        part.bounds.grow(&batch.positions);
        part.chunks.push(block::of_batch(batch), &mut self.spool)
    }

    /// Keeps why the spool did not take a batch.
    fn noted(&mut self, result: io::Result<()>) -> io::Result<()> {
        result.map_err(|e| {
            self.failure = Some(ConvertError::Scratch(e));
            io::ErrorKind::Other.into()
        })
    }
}

impl TriangleSink for Sink<'_> {
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()> {
        self.check_cancelled()?;
        self.id_end = self.id_end.max(batch.first_triangle_id + batch.triangles.len() as u64);
        let pushed = self.push(&batch);
        self.noted(pushed)
    }

    fn strands(&mut self, batch: StrandBatch) -> io::Result<()> {
        self.check_cancelled()?;
        self.strand_bounds.grow(&batch.positions);
        self.radii.grow(&batch.radii);
        self.strand_points += batch.positions.len() as u64;
        let segments = (batch.positions.len() - batch.lengths.len()) as u64;
        self.id_end = self.id_end.max(batch.first_segment_id + segments);
        let (block, windows) = strands::of_batch(&batch);
        self.strand_windows += windows;
        let pushed = self.strands.push(block, &mut self.spool);
        self.noted(pushed)
    }

    fn progress(&mut self, progress: raystrips_meshio::Progress) {
        self.observer.progress(Stage::Import, progress.bytes_done, progress.bytes_total);
    }
}
