//! What can be wrong with a pack, apart by what the reader can do about it.

use crate::PageId;
use std::io;

/// Why a pack cannot be written or read. Messages do not name the file: the caller, who opened it, does.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PackError {
    /// The disk or the system failed.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Something else than a pack.
    #[error("not a raystrips pack (it does not begin with the signature); make one with `raystrips convert`")]
    NotAPack,
    /// Written by another version of the format.
    #[error("pack format version {got}, but this program reads version {expected}; convert the model again")]
    Version {
        /// What this program reads.
        expected: u32,
        /// What the file says.
        got: u32,
    },
    /// Bytes are missing or wrong outside of the pages.
    #[error("damaged pack: {0}; convert the model again or restore the file")]
    Corrupt(String),
    /// Bytes of a page are missing or wrong.
    #[error("damaged pack: page {page}: {what}; convert the model again or restore the file")]
    CorruptPage {
        /// Which page.
        page: PageId,
        /// What is wrong with it.
        what: String,
    },
    /// More than the format can hold.
    #[error("{0}")]
    TooLarge(String),
}

impl PackError {
    pub(crate) fn corrupt(what: impl Into<String>) -> PackError {
        PackError::Corrupt(what.into())
    }
}
