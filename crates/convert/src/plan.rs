//! What a conversion will take, told before it begins, and refused if there is not enough.

use crate::cells::Cells;
use crate::partition::PIECE_TRIANGLES;
use crate::{ConvertError, ConvertParams, job};
use raystrips_extmem::disk::free_bytes;
use raystrips_extmem::spare_memory;
use raystrips_meshio::{Survey, survey};
use std::io;
use std::path::{Path, PathBuf};

/// Memory of a conversion apart from all that is named below: the program, buffers, batches on their way, pages of
/// mapped files. Measured, as the others.
const BASE_BYTES: u64 = 60 << 20;
/// What the allocator keeps for each thread.
const THREAD_BYTES: u64 = 6 << 20;
/// Memory in which a piece is built, a triangle and a vertex: the more vertices, the shorter and more the strips.
const BUILD_TRIANGLE_BYTES: u64 = 160;
const BUILD_VERTEX_BYTES: u64 = 220;
/// The same for attributes: which record each corner has; the records, and those of a page found again by their bytes.
const CORNERS_BYTES: u64 = 16;
const RECORD_BYTES: u64 = 48;
/// Scratch bytes of the attributes of a vertex.
const ATTRIBUTE_BYTES: u64 = 20;
/// Memory of an instance, in the import, in the pack and in hierarchies.
const INSTANCE_BYTES: u64 = 400;
/// Memory for each thread that works on batches, while there are no pieces yet.
const BATCH_BYTES: u64 = 12 << 20;
/// Scratch bytes of a triangle: its corners, and its share of a batch's head.
const TRIANGLE_BYTES: u64 = 7;
/// Scratch bytes of a vertex, which may be in several batches; and if positions are f64.
const VERTEX_BYTES: u64 = 18;
/// Bytes of a vertex that a text format makes the import keep.
const KEPT_BYTES: u64 = 24;
/// Scratch bytes of a triangle's place in its batch, if ids are kept.
const PLACE_BYTES: u64 = 2;
/// Bytes of a triangle and of a vertex of the input in a pack: vertices that clusters share are there more than once,
/// but take less than 12 bytes then.
const PACK_TRIANGLE_BYTES: u64 = 5;
const PACK_VERTEX_BYTES: u64 = 13;
/// Bytes of an id, in the unfinished pack and beside it.
const ID_BYTES: u64 = 16;
/// Bytes of a short face in a text file.
const LEAST_TEXT: u64 = 8;
/// Triangles a second that a processor core converts, for a first guess of the time.
const TRIANGLES_PER_SECOND: u64 = 500_000;
/// Where the system does not tell how much memory there is.
const DEFAULT_MEMORY: u64 = 1 << 30;

/// How a conversion will be done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Triangles to convert.
    pub triangles: u64,
    /// False if the number of triangles is a guess from the size of the files.
    pub is_exact: bool,
    /// Bytes of the models.
    pub input_bytes: u64,
    /// Memory that the whole process keeps to.
    pub memory: u64,
    /// Pieces built at a time.
    pub pieces_at_a_time: usize,
    /// Bytes that go to the scratch folder; 0 if all is done in memory.
    pub scratch_bytes: u64,
    /// Scratch folder.
    pub scratch: PathBuf,
    /// Bytes free there, if the system tells.
    pub scratch_free: Option<u64>,
    /// Guess of the time it takes.
    pub seconds: u64,
    /// Memory but for what is taken in any case.
    spare: u64,
    /// Memory for vertices while the import needs them.
    pub(crate) kept_bytes: u64,
    /// Memory for what is kept between the stages.
    pub(crate) spool_memory: u64,
}

impl Plan {
    /// The plan for converting `inputs` to `output` with the threads of the current rayon pool.
    ///
    /// # Errors
    /// If an input cannot be read, and if there is too little memory or disk; the message says how much would do.
    pub fn new(inputs: &[PathBuf], output: &Path, params: &ConvertParams) -> Result<Plan, ConvertError> {
        let scratch = params.scratch.clone().unwrap_or_else(|| parent(output));
        if !scratch.is_dir() {
            let source =
                io::Error::new(io::ErrorKind::NotADirectory, "there is no such folder; make it first");
            return Err(ConvertError::Folder { path: scratch, source });
        }
        let mut survey = survey(inputs, &params.import)?;
        if params.import.bare {
            survey.attributed_vertices = 0;
        }
        let memory = params.memory.unwrap_or_else(|| spare_memory().unwrap_or(DEFAULT_MEMORY));
        let threads = rayon::current_num_threads() as u64;
        let piece = piece_bytes(&survey);
        let base = base_bytes().saturating_add(survey.instances.saturating_mul(INSTANCE_BYTES));
        let least = base.saturating_add(piece.max(BATCH_BYTES).max(Cells::most_bytes(survey.triangles)));
        if memory < least {
            return Err(ConvertError::TooLittleMemory { given: memory, least });
        }
        // Batches of the import, then the same in pieces; the import is removed after that.
        let places = if params.keep_ids { PLACE_BYTES * survey.triangles } else { 0 };
        let attributes = survey.attributed_vertices * ATTRIBUTE_BYTES;
        let batches = survey.triangles * TRIANGLE_BYTES + survey.vertices * VERTEX_BYTES + attributes;
        let spools = 2 * batches + places;
        let kept = survey.kept_vertices * KEPT_BYTES;
        let pieces = survey.triangles.div_ceil(PIECE_TRIANGLES / 2).clamp(1, threads);
        let in_memory = base + pieces * piece + spools + kept <= memory;
        let spare = memory - base;
        let at_a_time = if in_memory { pieces } else { (spare / piece.max(1)).clamp(1, threads) };
        let plan = Plan {
            triangles: survey.triangles,
            is_exact: survey.is_exact,
            input_bytes: survey.bytes,
            memory,
            pieces_at_a_time: at_a_time as usize,
            scratch_bytes: if in_memory { 0 } else { spools + kept.saturating_sub(spare / 2) },
            scratch_free: free_bytes(&scratch),
            scratch,
            seconds: survey.triangles / (TRIANGLES_PER_SECOND * threads),
            spare,
            kept_bytes: if in_memory { spare - spools } else { spare / 4 * 3 },
            spool_memory: spare.saturating_sub(at_a_time * piece),
        };
        plan.check_disk(output, &survey, params.keep_ids)?;
        Ok(plan)
    }

    /// Refuses disks that are too small; a quarter of the estimate may be wrong.
    fn check_disk(&self, output: &Path, survey: &Survey, keep_ids: bool) -> Result<(), ConvertError> {
        let pack = survey.triangles * PACK_TRIANGLE_BYTES + survey.vertices * PACK_VERTEX_BYTES;
        // There once more until the pack is whole.
        let pack = pack + 2 * survey.attributed_vertices * ATTRIBUTE_BYTES;
        let pack = pack + if keep_ids { survey.triangles * ID_BYTES } else { 0 };
        let beside = parent(output);
        let (pack_used, scratch_used) = job::used_bytes(output, &self.scratch);
        let needs = if are_on_one_disk(&beside, &self.scratch) {
            vec![(output, &beside, pack + self.scratch_bytes, pack_used + scratch_used)]
        } else {
            let scratch = self.scratch.as_path();
            vec![
                (output, &beside, pack, pack_used),
                (scratch, &self.scratch, self.scratch_bytes, scratch_used),
            ]
        };
        for (path, folder, needed, used) in needs {
            // What an earlier run left there is part of what is needed.
            let free = free_bytes(folder).unwrap_or(u64::MAX).saturating_add(used);
            if free < needed / 4 * 3 {
                return Err(ConvertError::TooLittleDisk { path: path.to_owned(), needed, free });
            }
        }
        Ok(())
    }

    /// Refuses memory in which `bytes` do not fit beside what is taken in any case.
    pub(crate) fn check_memory(&self, bytes: u64) -> Result<(), ConvertError> {
        if self.spare >= bytes {
            return Ok(());
        }
        Err(ConvertError::TooLittleMemory { given: self.memory, least: self.memory - self.spare + bytes })
    }

    /// True if nothing goes to scratch files.
    pub fn is_in_memory(&self) -> bool {
        self.scratch_bytes == 0
    }

    /// Batches worked on at a time.
    pub(crate) fn batches_at_a_time(&self) -> usize {
        let most = (self.spare / BATCH_BYTES).max(1) as usize;
        (2 * rayon::current_num_threads()).min(most)
    }

    /// Memory for sorting in the end, when all pieces are built.
    pub(crate) fn sort_memory(&self) -> u64 {
        self.spare / 2
    }
}

/// Memory in which a piece is built: where the number of triangles is a guess, no more than the file can hold.
fn piece_bytes(survey: &Survey) -> u64 {
    let most =
        if survey.is_exact { survey.triangles } else { survey.triangles.max(survey.bytes / LEAST_TEXT) };
    let triangles = PIECE_TRIANGLES.min(most);
    let vertices = (triangles * 3).min(triangles.saturating_mul(survey.vertices) / survey.triangles.max(1));
    let bare = triangles * BUILD_TRIANGLE_BYTES + vertices * BUILD_VERTEX_BYTES;
    if survey.attributed_vertices == 0 {
        return bare;
    }
    let share = triangles.saturating_mul(survey.attributed_vertices) / survey.triangles.max(1);
    bare + triangles * CORNERS_BYTES + (triangles * 3).min(share) * RECORD_BYTES
}

fn are_on_one_disk(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        matches!((a.metadata(), b.metadata()), (Ok(a), Ok(b)) if a.dev() == b.dev())
    }
    #[cfg(not(unix))]
    return a == b;
}

/// Memory that is taken whatever is converted, with the threads of the current rayon pool.
fn base_bytes() -> u64 {
    BASE_BYTES + THREAD_BYTES * rayon::current_num_threads() as u64
}

fn parent(path: &Path) -> PathBuf {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned()
}
