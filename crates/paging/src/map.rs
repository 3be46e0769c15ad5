//! A file mapped for reading. The only unsafe code of this crate.
#![allow(unsafe_code)]

use memmap2::Mmap;
use std::fs::File;
use std::io;

/// A mapped file.
pub(crate) struct FileMap(Mmap);

impl FileMap {
    /// Maps all of `file`.
    pub(crate) fn of(file: &File) -> io::Result<FileMap> {
        // SAFETY: the bytes are only ever read as plain numbers, each of which is valid whatever its bits, and
        // pages are checked before kernels rely on them. Another process that truncates the file makes reads
        // fail with a signal, which is documented; packs are replaced by renaming.
        let map = unsafe { Mmap::map(file)? };
        Ok(FileMap(map))
    }

    /// The bytes.
    #[inline]
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0
    }
}
