//! Bytes that are appended now and read later: in memory while the budget lasts, then in a file.

use crate::disk::{discard, read_exact_at};
use crate::{MemoryBudget, Reservation};
use std::borrow::Cow;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Where something lies in a [`Spool`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// First byte.
    pub offset: u64,
    /// How many.
    pub bytes: u64,
}

/// A list of byte strings.
#[derive(Debug)]
pub struct Spool {
    /// What is in memory: the beginning of all, each with its offset.
    in_memory: Vec<(u64, Vec<u8>)>,
    memory: Option<Reservation>,
    place: Place,
    file: Option<File>,
    /// Offset of the first byte in the file.
    file_begin: u64,
    length: u64,
}

/// Where the file of a spool is.
#[derive(Debug)]
enum Place {
    Named(PathBuf),
    /// Without a name in this folder: gone when the spool is.
    Unnamed(PathBuf),
}

impl Spool {
    /// An empty spool that takes memory of `budget`, and the file `path` when that is spent; no memory if there is no
    /// budget.
    pub fn new(path: &Path, budget: Option<&MemoryBudget>) -> Spool {
        Spool::at(Place::Named(path.to_owned()), budget)
    }

    /// The same with a file in `folder` that is gone when the spool is.
    pub fn unnamed(folder: &Path, budget: Option<&MemoryBudget>) -> Spool {
        Spool::at(Place::Unnamed(folder.to_owned()), budget)
    }

    fn at(place: Place, budget: Option<&MemoryBudget>) -> Spool {
        Spool {
            in_memory: Vec::new(),
            memory: budget.and_then(|budget| budget.take(0)),
            place,
            file: None,
            file_begin: 0,
            length: 0,
        }
    }

    /// The first `length` bytes of a spool that was in the file `path` as a whole; the rest is cut off.
    pub fn reopen(path: &Path, length: u64) -> io::Result<Spool> {
        let file = OpenOptions::new().read(true).append(true).open(path)?;
        if file.metadata()?.len() < length {
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "a scratch file is cut off"));
        }
        file.set_len(length)?;
        Ok(Spool { file: Some(file), length, ..Spool::new(path, None) })
    }

    /// Bytes appended so far.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Appends `bytes` as they are, in one piece.
    pub fn append(&mut self, bytes: Vec<u8>) -> io::Result<Extent> {
        let extent = Extent { offset: self.length, bytes: bytes.len() as u64 };
        let fits = self.file.is_none() && self.memory.as_mut().is_some_and(|m| m.grow(extent.bytes));
        if fits {
            self.in_memory.push((self.length, bytes));
        } else {
            self.file()?.write_all(&bytes)?;
        }
        self.length += extent.bytes;
        Ok(extent)
    }

    fn file(&mut self) -> io::Result<&mut File> {
        if self.file.is_none() {
            let file = match &self.place {
                Place::Named(path) => OpenOptions::new().read(true).append(true).create(true).open(path)?,
                Place::Unnamed(folder) => tempfile::tempfile_in(folder)?,
            };
            file.set_len(0)?;
            self.file = Some(file);
            self.file_begin = self.length;
        }
        Ok(self.file.as_mut().expect("it was just opened"))
    }

    /// What one call of [`Spool::append`] appended.
    ///
    /// # Panics
    /// If the extent is none that it gave and lies in memory.
    pub fn read(&self, extent: Extent) -> io::Result<Cow<'_, [u8]>> {
        if extent.offset < self.file_begin || self.file.is_none() {
            let found = self.in_memory.binary_search_by_key(&extent.offset, |(offset, _)| *offset);
            let bytes = &self.in_memory[found.expect("an extent that was appended")].1;
            assert_eq!(bytes.len() as u64, extent.bytes, "a whole extent");
            return Ok(Cow::Borrowed(bytes));
        }
        let file = self.file.as_ref().expect("bytes not in memory are in the file");
        let mut bytes = vec![0; extent.bytes as usize];
        read_exact_at(file, &mut bytes, extent.offset - self.file_begin)?;
        Ok(Cow::Owned(bytes))
    }

    /// Gives the disk back what `extent` takes there; it cannot be read any more.
    pub fn discard(&self, extent: Extent) {
        if let Some(file) = &self.file
            && extent.offset >= self.file_begin
        {
            discard(file, extent.offset - self.file_begin, extent.bytes);
        }
    }

    /// Brings what is in the file to the disk. False if something is in memory only.
    pub fn sync(&self) -> io::Result<bool> {
        if let Some(file) = &self.file {
            file.sync_data()?;
        }
        Ok(self.in_memory.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(i: usize) -> Vec<u8> {
        format!("{i}").repeat(i % 5 + 1).into_bytes()
    }

    #[test]
    fn reads_what_was_appended_from_memory_and_from_the_file() {
        let folder = tempfile::tempdir().unwrap();
        for memory in [None, Some(0), Some(20), Some(1000)] {
            let path = folder.path().join(format!("{memory:?}"));
            let budget = memory.map(MemoryBudget::new);
            let mut spool = Spool::new(&path, budget.as_ref());
            let extents: Vec<Extent> = (0..50).map(|i| spool.append(text(i)).unwrap()).collect();
            for (i, &extent) in extents.iter().enumerate().rev() {
                assert_eq!(*spool.read(extent).unwrap(), text(i), "{memory:?}");
            }
            assert_eq!(spool.sync().unwrap(), matches!(memory, None | Some(0)));
            assert_eq!(path.exists(), memory != Some(1000));
        }
    }

    #[test]
    fn without_a_name_there_is_nothing_in_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let mut spool = Spool::unnamed(folder.path(), None);
        let extents: Vec<Extent> = (0..5).map(|i| spool.append(text(i)).unwrap()).collect();
        assert_eq!(*spool.read(extents[3]).unwrap(), text(3));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_is_discarded_takes_no_room() {
        use std::os::unix::fs::MetadataExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spool");
        let mut spool = Spool::new(&path, None);
        let extents = [1, 2].map(|byte| spool.append(vec![byte; 1 << 20]).unwrap());
        spool.sync().unwrap();
        let blocks = || path.metadata().unwrap().blocks();
        let before = blocks();
        spool.discard(extents[0]);
        assert!(blocks() < before, "{before}");
        assert_eq!(*spool.read(extents[1]).unwrap(), [2; 1 << 20]);
    }

    #[test]
    fn reopened_it_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spool");
        let mut spool = Spool::new(&path, None);
        let first = spool.append(text(3)).unwrap();
        spool.append(text(4)).unwrap();
        drop(spool);
        let mut spool = Spool::reopen(&path, first.bytes).unwrap();
        let second = spool.append(text(6)).unwrap();
        assert_eq!(second.offset, first.bytes);
        assert_eq!(
            (spool.read(first).unwrap(), spool.read(second).unwrap()),
            (text(3).into(), text(6).into())
        );
        assert!(Spool::reopen(&path, 1000).is_err());
    }
}
