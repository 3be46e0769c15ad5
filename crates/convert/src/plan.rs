//! What a conversion will take, told before it begins, and refused if there is not enough.

use crate::partition::PIECE_TRIANGLES;
use crate::{ConvertError, ConvertParams, job};
use raystrips_extmem::disk::free_bytes;
use raystrips_extmem::spare_memory;
use raystrips_meshio::survey;
use std::path::{Path, PathBuf};

/// Memory of a conversion apart from all that is named below: the program, buffers, batches on their way, pages of
/// mapped files. Measured, as the others.
const BASE_BYTES: u64 = 60 << 20;
/// What the allocator keeps for each thread.
const THREAD_BYTES: u64 = 6 << 20;
/// Memory in which a piece is built, a triangle.
const PIECE_BYTES_PER_TRIANGLE: u64 = 260;
/// Memory for each thread that works on batches, while there are no pieces yet.
const BATCH_BYTES: u64 = 12 << 20;
/// Scratch bytes of a triangle: its corners, and its share of a batch's head.
const TRIANGLE_BYTES: u64 = 7;
/// Scratch bytes of a vertex, which may be in several batches; and if positions are f64.
const VERTEX_BYTES: u64 = 18;
/// Bytes of a vertex that a text format makes the import keep.
const KEPT_BYTES: u64 = 24;
/// Bytes of a triangle in a pack.
const PACK_BYTES: u64 = 11;
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
    /// Memory for vertices while the import needs them.
    pub(crate) kept_bytes: u64,
}

impl Plan {
    /// The plan for converting `inputs` to `output` with the threads of the current rayon pool.
    ///
    /// # Errors
    /// If an input cannot be read, and if there is too little memory or disk; the message says how much would do.
    pub fn new(inputs: &[PathBuf], output: &Path, params: &ConvertParams) -> Result<Plan, ConvertError> {
        let survey = survey(inputs)?;
        let memory = params.memory.unwrap_or_else(|| spare_memory().unwrap_or(DEFAULT_MEMORY));
        let threads = rayon::current_num_threads() as u64;
        let piece = PIECE_TRIANGLES.min(survey.triangles) * PIECE_BYTES_PER_TRIANGLE;
        let base = base_bytes();
        let least = base + piece.max(BATCH_BYTES);
        if memory < least {
            return Err(ConvertError::TooLittleMemory { given: memory, least });
        }
        // Batches of the import, then the same in pieces; the import is removed after that.
        let id_bytes = if params.keep_ids { 2 * survey.triangles } else { 0 };
        let spools = 2 * (survey.triangles * TRIANGLE_BYTES + survey.vertices * VERTEX_BYTES) + id_bytes;
        let kept = survey.kept_vertices * KEPT_BYTES;
        let pieces = survey.triangles.div_ceil(PIECE_TRIANGLES / 2).min(threads);
        let in_memory = base + pieces * piece + spools + kept <= memory;
        let spare = memory - base;
        let plan = Plan {
            triangles: survey.triangles,
            is_exact: survey.is_exact,
            input_bytes: survey.bytes,
            memory,
            pieces_at_a_time: if in_memory { pieces } else { (spare / piece.max(1)).clamp(1, threads) }
                as usize,
            scratch_bytes: if in_memory { 0 } else { spools + kept.saturating_sub(spare / 2) },
            scratch: params.scratch.clone().unwrap_or_else(|| parent(output)),
            scratch_free: free_bytes(&params.scratch.clone().unwrap_or_else(|| parent(output))),
            seconds: survey.triangles / (TRIANGLES_PER_SECOND * threads),
            kept_bytes: if in_memory { spare - spools } else { spare / 4 * 3 },
        };
        plan.check_disk(output)?;
        Ok(plan)
    }

    /// Refuses disks that are too small; a quarter of the estimate may be wrong.
    fn check_disk(&self, output: &Path) -> Result<(), ConvertError> {
        let pack = self.triangles * PACK_BYTES;
        let beside = self.scratch == parent(output);
        let needs = [
            (output, parent(output), pack + if beside { self.scratch_bytes } else { 0 }),
            (&self.scratch, self.scratch.clone(), self.scratch_bytes),
        ];
        for (path, folder, needed) in needs {
            // What an earlier run left there is part of what is needed.
            let free = free_bytes(&folder)
                .unwrap_or(u64::MAX)
                .saturating_add(job::used_bytes(output, &self.scratch));
            if free < needed / 4 * 3 {
                return Err(ConvertError::TooLittleDisk { path: path.to_owned(), needed, free });
            }
        }
        Ok(())
    }

    /// True if nothing goes to scratch files.
    pub fn is_in_memory(&self) -> bool {
        self.scratch_bytes == 0
    }

    /// Batches worked on at a time.
    pub(crate) fn batches_at_a_time(&self) -> usize {
        let most = ((self.memory - base_bytes()) / BATCH_BYTES).max(1) as usize;
        (2 * rayon::current_num_threads()).min(most)
    }

    /// Memory for what is kept between the stages.
    pub(crate) fn spool_memory(&self) -> u64 {
        let piece = PIECE_TRIANGLES.min(self.triangles) * PIECE_BYTES_PER_TRIANGLE;
        (self.memory - base_bytes()).saturating_sub(self.pieces_at_a_time as u64 * piece)
    }
}

/// Memory that is taken whatever is converted, with the threads of the current rayon pool.
fn base_bytes() -> u64 {
    BASE_BYTES + THREAD_BYTES * rayon::current_num_threads() as u64
}

fn parent(path: &Path) -> PathBuf {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned()
}
