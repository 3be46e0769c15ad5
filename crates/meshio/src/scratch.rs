//! An unnamed file for what does not fit into memory: it is gone when the process is, however that ends.

use crate::map::{Map, read_at};
use crate::{ImportError, ImportOptions, Result};
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::PathBuf;

/// A file that grows at its end. It comes into being with its first byte.
pub(crate) struct Scratch {
    folder: PathBuf,
    file: Option<File>,
    bytes: u64,
}

impl Scratch {
    pub fn new(options: &ImportOptions) -> Scratch {
        let folder = options.scratch.clone().unwrap_or_else(std::env::temp_dir);
        Scratch { folder, file: None, bytes: 0 }
    }

    /// Appends `bytes` and gives the place where they start.
    pub fn append(&mut self, bytes: &[u8]) -> Result<u64> {
        let start = self.bytes;
        self.try_append(bytes).map_err(|source| self.error(source))?;
        self.bytes += bytes.len() as u64;
        Ok(start)
    }

    fn try_append(&mut self, bytes: &[u8]) -> io::Result<()> {
        match &mut self.file {
            Some(file) => file.write_all(bytes),
            None => self.file.insert(tempfile::tempfile_in(&self.folder)?).write_all(bytes),
        }
    }

    /// What `append` has written at `start`.
    pub fn map(&self, start: u64, length: usize) -> Result<Map> {
        let map = self.file.as_ref().map(|file| Map::of_part(file, start, length));
        map.unwrap_or_else(|| Err(io::ErrorKind::UnexpectedEof.into())).map_err(|source| self.error(source))
    }

    /// Fills `bytes` with what `append` has written at `start`; false if that cannot be read this way.
    pub fn read_at(&self, start: u64, bytes: &mut [u8]) -> bool {
        self.file.as_ref().is_some_and(|file| read_at(file, start, bytes).is_ok())
    }

    /// The file, at its start, if anything was ever written.
    pub fn into_file(mut self) -> Result<Option<File>> {
        match self.file.as_mut().map(|file| file.seek(SeekFrom::Start(0))) {
            Some(Err(source)) => Err(self.error(source)),
            _ => Ok(self.file),
        }
    }

    fn error(&self, source: io::Error) -> ImportError {
        ImportError::Scratch { folder: self.folder.clone(), source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn what_was_appended_comes_back_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let options = ImportOptions { scratch: Some(folder.path().into()), ..ImportOptions::default() };
        let mut scratch = Scratch::new(&options);
        assert!(scratch.map(0, 1).is_err());
        assert_eq!((scratch.append(b"abc").unwrap(), scratch.append(b"defg").unwrap()), (0, 3));
        let map = scratch.map(3, 4).unwrap();
        map.release();
        assert_eq!(&map[..], b"defg");
        let mut two = [0; 2];
        assert!(scratch.read_at(2, &mut two) && &two == b"cd" && !scratch.read_at(6, &mut two));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let mut text = String::new();
        scratch.into_file().unwrap().unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "abcdefg");
        assert!(Scratch::new(&options).into_file().unwrap().is_none());
    }

    #[test]
    fn folders_that_cannot_be_written_are_named() {
        let folder = tempfile::tempdir().unwrap().path().join("not there");
        let options = ImportOptions { scratch: Some(folder), ..ImportOptions::default() };
        let error = Scratch::new(&options).append(b"a").unwrap_err();
        assert!(matches!(error, ImportError::Scratch { .. }));
        let error = error.to_string();
        assert!(
            error.contains("not there: scratch files") && error.contains("name another folder"),
            "{error}"
        );
    }
}
