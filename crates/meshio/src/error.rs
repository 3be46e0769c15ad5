//! What can go wrong while reading, each in one line that names the file, the place and the cure.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why an import stopped. Every message is a single line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A file cannot be opened or read.
    #[error("{}: cannot be read: {}", shown(path), one_line(&source.to_string()))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The sink refused a batch.
    #[error("triangles cannot be stored: {}", one_line(&.0.to_string()))]
    Sink(#[source] io::Error),
    /// What an import has to keep for a while cannot be written to disk.
    #[error(
        "{}: scratch files cannot be kept there: {}; free space on that disk, or name another folder for scratch files",
        shown(folder),
        one_line(&source.to_string())
    )]
    Scratch {
        /// The folder.
        folder: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file breaks the rules of its format.
    #[error("{}{place}: {what}", shown(path))]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What is wrong and what to do about it.
        what: String,
    },
    /// The file is well formed but uses something that is not read here.
    #[error("{}{place}: {what}", shown(path))]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What it is and what to do about it.
        what: String,
    },
    /// A face names a vertex that does not exist.
    #[error(
        "{}{place}: vertex index {index} does not exist, there are {vertex_count} vertices; repair the file, or leave \
         such triangles out with --drop-out-of-range",
        shown(path)
    )]
    IndexOutOfRange {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// The index as written in the file.
        index: i64,
        /// How many vertices there are.
        vertex_count: u64,
    },
    /// The file holds nothing that can be rendered.
    #[error("{}: no triangles: {found}; choose a file with faces", shown(path))]
    NoTriangles {
        /// The file.
        path: PathBuf,
        /// What was found instead.
        found: String,
    },
}

/// Where in a file something is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line of text, counted from 1.
    Line(u64),
    /// An offset in bytes from the start of the file.
    Byte(u64),
    /// A path into a JSON document, like `meshes[0].primitives[2].indices`.
    Json(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Whole => Ok(()),
            Place::Line(line) => write!(f, ", line {line}"),
            Place::Byte(byte) => write!(f, ", byte {byte}"),
            Place::Json(path) => write!(f, ", {path}"),
        }
    }
}

impl ImportError {
    pub(crate) fn io(path: &Path, source: io::Error) -> ImportError {
        ImportError::Io { path: path.into(), source }
    }

    pub(crate) fn syntax(path: &Path, place: Place, what: impl fmt::Display) -> ImportError {
        ImportError::Syntax { path: path.into(), place, what: one_line(&what.to_string()) }
    }

    pub(crate) fn unsupported(path: &Path, place: Place, what: impl fmt::Display) -> ImportError {
        ImportError::Unsupported { path: path.into(), place, what: one_line(&what.to_string()) }
    }
}

/// `text` without control characters, which names and broken files may carry.
pub(crate) fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// The start of `token`, fit for a message.
pub(crate) fn excerpt(token: &[u8]) -> String {
    const MAX: usize = 40;
    let shown = one_line(&String::from_utf8_lossy(&token[..token.len().min(MAX)]));
    if token.len() > MAX { format!("'{shown}...'") } else { format!("'{shown}'") }
}

fn shown(path: &Path) -> String {
    one_line(&path.display().to_string())
}
