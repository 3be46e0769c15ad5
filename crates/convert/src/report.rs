//! What a conversion tells while it runs and when it ends.

use crate::Plan;
use raystrips_meshio::{FileStamp, ImportError};
use raystrips_pack::{Manifest, PackError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Stages of a conversion, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Reading files; counts bytes.
    Import,
    /// Finding out where triangles are, and dividing them into pieces; counts triangles.
    Partition,
    /// Gathering the triangles of each piece; counts triangles.
    Distribute,
    /// Hierarchy, strips and pages of each piece, and the first level of its proxy; counts triangles.
    Build,
    /// Levels of simplification; counts the triangles of each.
    Simplify,
    /// Distances between model and proxy; counts pieces.
    Measure,
    /// What comes behind the pages; counts nothing.
    Finish,
}

impl Stage {
    /// Name as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Import => "import",
            Stage::Partition => "partition",
            Stage::Distribute => "distribute",
            Stage::Build => "build",
            Stage::Simplify => "simplify",
            Stage::Measure => "measure",
            Stage::Finish => "finish",
        }
    }
}

/// Follows a conversion, and may end it.
pub trait Observer: Sync {
    /// Told once, before anything is done.
    fn planned(&self, _plan: &Plan) {}

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
    /// Proxies in the pack, the largest first.
    pub proxies: Vec<ProxyReport>,
    /// Seconds of each stage that this run did.
    pub seconds: Vec<(Stage, f64)>,
    /// Things worth knowing about the input, a line each.
    pub warnings: Vec<String>,
    /// Every file that was read, as it was before.
    pub files: Vec<FileStamp>,
}

/// A proxy in a pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProxyReport {
    /// Its triangles.
    pub triangles: u64,
    /// Its part of the pack.
    pub bytes: u64,
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
    /// The budget is too small for any conversion of this input.
    #[error("a memory budget of {} MiB is too little, it takes {}; use --memory {}M", given >> 20, least.div_ceil(1 << 20), least.div_ceil(1 << 20))]
    TooLittleMemory {
        /// Bytes of the budget.
        given: u64,
        /// Bytes that would do.
        least: u64,
    },
    /// The disk is too small.
    #[error("{}: takes some {} MiB and there are {} MiB of space; free some, or name another place", path.display(), needed.div_ceil(1 << 20), free >> 20)]
    TooLittleDisk {
        /// The output, or the folder for scratch files.
        path: PathBuf,
        /// Bytes that would do.
        needed: u64,
        /// Bytes that there are.
        free: u64,
    },
    /// The folder for the unfinished pack or scratch files cannot be used.
    #[error("{}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Another process converts to the same output.
    #[error("{}: another conversion to this output is running; wait for it", path.display())]
    Busy {
        /// Its folder.
        path: PathBuf,
    },
    /// A scratch file cannot be written or read; [`convert`](crate::convert) gives it as [`ConvertError::Folder`].
    #[error("{0}")]
    Scratch(io::Error),
    /// The pack cannot be written.
    #[error("{}: {source}", path.display())]
    Write {
        /// The pack.
        path: PathBuf,
        /// Why.
        source: PackError,
    },
    /// The observer asked to stop.
    #[error("interrupted")]
    Cancelled,
    /// Any of the others, when the next run of the same conversion need not begin anew.
    #[error("{0}; the same command goes on from here, or begins anew with --restart")]
    Resumable(Box<ConvertError>),
}

impl ConvertError {
    /// Makes errors about the pack `path`.
    pub(crate) fn write(path: &Path) -> impl Fn(PackError) -> ConvertError {
        |source| ConvertError::Write { path: path.to_owned(), source }
    }

    /// The same error with the folder that it happened in.
    pub(crate) fn in_folder(self, folder: &Path) -> ConvertError {
        match self {
            ConvertError::Scratch(source) => ConvertError::Folder { path: folder.to_owned(), source },
            other => other,
        }
    }

    /// True if the same conversion may succeed later.
    pub(crate) fn may_pass(&self) -> bool {
        let not_damaged = |e: &io::Error| e.kind() != io::ErrorKind::InvalidData;
        match self {
            ConvertError::Cancelled => true,
            ConvertError::Import(error) => {
                matches!(error, ImportError::Io { .. } | ImportError::Scratch { .. })
            }
            ConvertError::Scratch(source) => not_damaged(source),
            ConvertError::Write { source, .. } => matches!(source, PackError::Io(_)),
            _ => false,
        }
    }
}

/// Times the stages.
pub(crate) struct Clock {
    begin: Instant,
    pub seconds: Vec<(Stage, f64)>,
}

impl Clock {
    pub fn new() -> Clock {
        Clock { begin: Instant::now(), seconds: Vec::new() }
    }

    pub fn record(&mut self, stage: Stage) {
        self.seconds.push((stage, self.begin.elapsed().as_secs_f64()));
        self.begin = Instant::now();
    }
}
