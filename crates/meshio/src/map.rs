//! Read-only views of whole files: the only unsafe code of the crate.
#![allow(unsafe_code)]

use crate::ImportError;
use std::fs::File;
use std::io;
use std::ops::{Deref, Range};
use std::path::Path;

/// The bytes of a file. Pages come in when touched and may leave memory again.
pub(crate) struct Map(Option<memmap2::Mmap>);

impl Map {
    pub(crate) fn open(path: &Path) -> Result<Map, ImportError> {
        Self::try_open(path).map_err(|e| ImportError::io(path, e))
    }

    fn try_open(path: &Path) -> io::Result<Map> {
        let file = open_regular(path)?;
        // An empty file cannot be mapped on every system.
        if file.metadata()?.len() == 0 {
            return Ok(Map(None));
        }
        // SAFETY: the map is private to this crate, read-only, and read as plain bytes only, which are checked
        // wherever they are used. A program that cuts the file short meanwhile ends this process with a signal,
        // as with every mapped file; it cannot make a checked slice access go out of bounds.
        let map = unsafe { memmap2::Mmap::map(&file)? };
        Ok(Map(Some(map)))
    }

    /// `length` bytes of a file of this process from `offset` on, which must be there.
    pub(crate) fn of_part(file: &File, offset: u64, length: usize) -> io::Result<Map> {
        if length == 0 {
            return Ok(Map(None));
        }
        // SAFETY: as above; nobody else can reach the unnamed files that this is for.
        let map = unsafe { memmap2::MmapOptions::new().offset(offset).len(length).map(file)? };
        Ok(Map(Some(map)))
    }

    /// Takes the pages touched so far out of this process, so that reading a large file does not fill memory.
    /// They are read again when touched again.
    pub(crate) fn release(&self) {
        self.release_range(0..self.len());
    }

    /// The same for the pages that `range` touches.
    pub(crate) fn release_range(&self, range: Range<usize>) {
        #[cfg(unix)]
        if let Some(map) = &self.0
            && range.start < range.end
            && range.end <= map.len()
        {
            let advice = memmap2::UncheckedAdvice::DontNeed;
            // SAFETY: for a shared read-only map of a file, dropped pages come back with the same bytes. A
            // failure only leaves the pages where they are.
            let _ = unsafe { map.unchecked_advise_range(advice, range.start, range.len()) };
        }
        #[cfg(not(unix))]
        let _ = range;
    }
}

impl Deref for Map {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.0.as_deref().unwrap_or_default()
    }
}

/// Fills `bytes` from `offset` on, without a map.
pub(crate) fn read_at(file: &File, offset: u64, bytes: &mut [u8]) -> io::Result<()> {
    #[cfg(unix)]
    return std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset);
    #[cfg(not(unix))]
    return Err(io::ErrorKind::Unsupported.into());
}

/// Opens a file, but no folder, pipe or device: those can block or never end.
pub(crate) fn open_regular(path: &Path) -> io::Result<File> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    File::open(path)
}
