//! What tells whether a file is still the one that was read.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// A file as it was at a time; empty and ageless if it was missing.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileStamp {
    /// Full path.
    pub path: PathBuf,
    bytes: u64,
    modified_nanos: u128,
}

impl FileStamp {
    /// The file as it is now.
    pub fn of(path: &Path) -> FileStamp {
        let metadata = path.metadata().ok();
        let modified = metadata.as_ref().and_then(|m| m.modified().ok()?.duration_since(UNIX_EPOCH).ok());
        FileStamp {
            path: std::path::absolute(path).unwrap_or(path.to_owned()),
            bytes: metadata.map_or(0, |m| m.len()),
            modified_nanos: modified.map_or(0, |d| d.as_nanos()),
        }
    }

    /// True if the file has neither another length nor another time.
    pub fn is_current(&self) -> bool {
        FileStamp::of(&self.path) == *self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_or_missing_file_is_not_current() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let missing = FileStamp::of(&path);
        assert!(missing.is_current());
        std::fs::write(&path, "1").unwrap();
        let first = FileStamp::of(&path);
        assert!(first.is_current() && !missing.is_current());
        std::fs::write(&path, "22").unwrap();
        assert!(!first.is_current());
    }
}
