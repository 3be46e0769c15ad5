//! The bytes of a file, or of a part of it, in memory. The only unsafe code of this crate.
//!
//! A file that fits is read into memory with huge pages, where the system gives them: incoherent rays touch more
//! pages of 4 KiB than a processor can keep the places of. A larger one is mapped.
#![allow(unsafe_code)]

use memmap2::{Advice, Mmap, MmapMut, MmapOptions};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;

/// A huge page of most systems.
const HUGE_PAGE: usize = 2 << 20;

/// The bytes of a file.
pub(crate) enum FileBytes {
    /// In memory of our own.
    Read {
        /// Whole huge pages.
        memory: MmapMut,
        /// How many there are.
        len: usize,
    },
    /// Mapped.
    Mapped(Mmap),
}

impl FileBytes {
    /// Reads `place` of `file` if it has at most `most` bytes, and maps it else. Shorter if the file ends before.
    pub(crate) fn of(file: &mut File, place: Range<u64>, most: u64) -> io::Result<FileBytes> {
        let end = place.end.min(file.metadata()?.len());
        let len = end.saturating_sub(place.start);
        match usize::try_from(len) {
            Ok(len) if len as u64 <= most => FileBytes::read(file, place.start, len),
            _ => FileBytes::map(file, place.start, len),
        }
    }

    fn read(file: &mut File, offset: u64, len: usize) -> io::Result<FileBytes> {
        let mut memory = MmapOptions::new().len(len.max(1).next_multiple_of(HUGE_PAGE)).map_anon()?;
        // A system that has no huge pages refuses, and does as well with small ones.
        let _ = memory.advise(Advice::HugePage);
        file.seek(SeekFrom::Start(offset))?;
        file.read_exact(&mut memory[..len])?;
        Ok(FileBytes::Read { memory, len })
    }

    fn map(file: &File, offset: u64, len: u64) -> io::Result<FileBytes> {
        let len = usize::try_from(len).map_err(|_| io::ErrorKind::OutOfMemory)?;
        // SAFETY: the bytes are only ever read as plain numbers, each of which is valid whatever its bits, and
        // pages are checked before kernels rely on them. Another process that truncates the file makes reads
        // fail with a signal, which is documented; packs are replaced by renaming.
        Ok(FileBytes::Mapped(unsafe { MmapOptions::new().offset(offset).len(len).map(file)? }))
    }

    /// The bytes.
    #[inline]
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            FileBytes::Read { memory, len } => &memory[..*len],
            FileBytes::Mapped(map) => map,
        }
    }
}
