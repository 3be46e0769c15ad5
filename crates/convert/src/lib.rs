//! Models and scenes to packs: runs the preparing stages and reports on them.
//!
//! For now a conversion holds the whole mesh in memory, some 250 bytes a triangle.

mod assemble;
mod emitters;
mod mesh;
mod offset;
mod positions;

pub use positions::Positions;
use positions::ToPack;
pub use raystrips_meshio::ImportOptions;
use raystrips_meshio::{ImportError, TriangleBatch, TriangleSink};
use raystrips_pack::{Dropped, Manifest, PackContents, PackError, PackWriter};
pub use raystrips_strips::StripParams;
use raystrips_strips::{Mesh, StripTree};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Parameters of [`convert`].
#[derive(Clone, Debug)]
pub struct ConvertParams {
    /// Bytes of a page to aim at.
    pub page_size: u32,
    /// Strips.
    pub strips: StripParams,
    /// How positions are kept.
    pub positions: Positions,
    /// Keep the number that each triangle has in the input: 4 or 8 bytes a triangle.
    pub keep_ids: bool,
    /// What to do where files leave a choice.
    pub import: ImportOptions,
}

impl Default for ConvertParams {
    fn default() -> ConvertParams {
        ConvertParams {
            page_size: 64 << 10,
            strips: StripParams::default(),
            positions: Positions::default(),
            keep_ids: false,
            import: ImportOptions::default(),
        }
    }
}

/// Stages of a conversion, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Reading files; counts bytes.
    Import,
    /// Finding equal vertices; counts triangles.
    Weld,
    /// Hierarchy and strips; counts triangles.
    Build,
    /// Writing pages; counts triangles.
    Write,
}

impl Stage {
    /// Name as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Import => "import",
            Stage::Weld => "weld",
            Stage::Build => "build",
            Stage::Write => "write",
        }
    }
}

/// Follows a conversion, and may end it.
pub trait Observer: Sync {
    /// `done` of `total` of `stage`. Called now and then, from any thread.
    fn progress(&self, _stage: Stage, _done: u64, _total: u64) {}

    /// True when the conversion shall end with [`ConvertError::Cancelled`].
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Follows nothing.
pub struct Unobserved;

impl Observer for Unobserved {}

/// What a conversion did.
#[derive(Clone, Debug)]
pub struct ConvertReport {
    /// Numbers and names of the pack.
    pub manifest: Manifest,
    /// Length of the pack.
    pub file_bytes: u64,
    /// Seconds of each stage.
    pub seconds: Vec<(Stage, f64)>,
    /// Things worth knowing about the input, a line each.
    pub warnings: Vec<String>,
    /// Every file that was read.
    pub files: Vec<PathBuf>,
}

/// Why there is no pack. Messages name the file.
#[derive(Debug, thiserror::Error)]
pub enum ConvertError {
    /// The input.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The input holds nothing that a ray could hit.
    #[error("{}: none of its {triangles} triangles has an area; check the model's scale and export", path.display())]
    NoArea {
        /// First input.
        path: PathBuf,
        /// Triangles read.
        triangles: u64,
    },
    /// The pack cannot be written.
    #[error("{}: {source}; nothing was left behind", path.display())]
    Write {
        /// The pack.
        path: PathBuf,
        /// Why.
        source: PackError,
    },
    /// The observer asked to stop.
    #[error("interrupted; nothing was left behind")]
    Cancelled,
}

/// Converts `inputs`, all placed into one scene, to the pack `output`. The same inputs and parameters give the
/// same bytes, whatever the number of threads (that of the current rayon pool).
pub fn convert(
    inputs: &[PathBuf],
    output: &Path,
    params: &ConvertParams,
    observer: &dyn Observer,
) -> Result<ConvertReport, ConvertError> {
    let mut clock = Clock::new(observer);
    let mut collector = Collector { batches: Vec::new(), observer };
    let import = raystrips_meshio::import(inputs, &params.import, &mut collector)
        .map_err(|e| clock.cancelled_or(e))?;
    clock.finish(Stage::Import)?;

    let placement = offset::placement(&collector.batches);
    let mut to_pack = ToPack::new(&placement, params.positions);
    let welded = mesh::weld(collector.batches, &mut to_pack);
    if welded.mesh.triangles.is_empty() {
        let path = inputs.first().cloned().unwrap_or_default();
        return Err(ConvertError::NoArea { path, triangles: import.report.triangles });
    }
    clock.finish(Stage::Weld)?;

    let built = build(&welded.mesh, params, observer);
    clock.finish(Stage::Build)?;

    let mut scene = import.scene;
    scene.translate(placement.offset.map(|x| -x));
    let bounds = built.tree.bounds();
    let manifest = Manifest {
        generator: concat!("raystrips ", env!("CARGO_PKG_VERSION")).into(),
        triangles: 0,
        vertices: welded.mesh.positions.len() as u64,
        strips: 0,
        clusters: 0,
        pages: 0,
        depth: 0,
        page_size: params.page_size,
        bounds_min: bounds.min.to_array(),
        bounds_max: bounds.max.to_array(),
        scene_offset: placement.offset,
        position_error: to_pack.error,
        id_bytes: 0,
        bytes: Default::default(),
        dropped: Dropped {
            degenerate: welded.degenerate,
            non_finite: import.report.dropped.non_finite,
            out_of_range: import.report.dropped.out_of_range,
        },
        scene,
    };
    let failed = |source| match observer.is_cancelled() {
        true => ConvertError::Cancelled,
        false => ConvertError::Write { path: output.to_owned(), source },
    };
    let (manifest, file_bytes) =
        write(output, manifest, &welded, &built, params, observer).map_err(failed)?;
    clock.record(Stage::Write);
    let mut warnings = import.report.warnings;
    if import.report.warnings_left_out > 0 {
        warnings.push(format!("{} more warnings", import.report.warnings_left_out));
    }
    Ok(ConvertReport { manifest, file_bytes, seconds: clock.seconds, warnings, files: import.report.files })
}

fn build(mesh: &Mesh, params: &ConvertParams, observer: &dyn Observer) -> StripTree {
    let total = mesh.triangles.len() as u64;
    let done = AtomicU64::new(0);
    observer.progress(Stage::Build, 0, total);
    raystrips_strips::build(mesh, &params.strips, &|triangles| {
        let before = done.fetch_add(triangles as u64, Ordering::Relaxed);
        observer.progress(Stage::Build, before + triangles as u64, total);
    })
}

fn write(
    output: &Path,
    manifest: Manifest,
    welded: &mesh::Welded,
    built: &StripTree,
    params: &ConvertParams,
    observer: &dyn Observer,
) -> Result<(Manifest, u64), PackError> {
    let emitters = emitters::emitters(&manifest.scene, &welded.mesh);
    let mut writer = PackWriter::create(output, manifest)?;
    let top = assemble::write_pages(&mut writer, built, params.page_size as usize, observer)?;
    let (triangle_ids, id_bytes) =
        if params.keep_ids { mesh::encode_ids(built, &welded.ids) } else { (Vec::new(), 0) };
    let manifest = writer.manifest_mut();
    manifest.depth = top.depth;
    manifest.id_bytes = id_bytes;
    writer.finish(&PackContents {
        top_nodes: &top.nodes,
        top_entries: &top.entries,
        emitters: &emitters,
        triangle_ids: &triangle_ids,
    })
}

/// Keeps what is imported.
struct Collector<'a> {
    batches: Vec<TriangleBatch>,
    observer: &'a dyn Observer,
}

impl TriangleSink for Collector<'_> {
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()> {
        if self.observer.is_cancelled() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        self.batches.push(batch);
        Ok(())
    }

    fn progress(&mut self, progress: raystrips_meshio::Progress) {
        self.observer.progress(Stage::Import, progress.bytes_done, progress.bytes_total);
    }
}

/// Times the stages.
struct Clock<'a> {
    observer: &'a dyn Observer,
    begin: Instant,
    seconds: Vec<(Stage, f64)>,
}

impl<'a> Clock<'a> {
    fn new(observer: &'a dyn Observer) -> Clock<'a> {
        Clock { observer, begin: Instant::now(), seconds: Vec::new() }
    }

    fn record(&mut self, stage: Stage) {
        self.seconds.push((stage, self.begin.elapsed().as_secs_f64()));
        self.begin = Instant::now();
    }

    /// Records a stage, after which the conversion can still be ended.
    fn finish(&mut self, stage: Stage) -> Result<(), ConvertError> {
        self.record(stage);
        if self.observer.is_cancelled() { Err(ConvertError::Cancelled) } else { Ok(()) }
    }

    fn cancelled_or(&self, error: ImportError) -> ConvertError {
        if self.observer.is_cancelled() { ConvertError::Cancelled } else { error.into() }
    }
}
