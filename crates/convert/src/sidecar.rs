//! Files beside the unfinished pack, for what goes in behind the pages or is needed in the end.

use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Bytes that one piece added to a sidecar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Added {
    bytes: u64,
    checksum: u32,
}

/// A file that pieces add to.
pub(crate) struct Sidecar {
    file: File,
}

impl Sidecar {
    /// Opens the file, or makes it, and tells how many of the parts that were `added` are there, from the first on.
    pub fn open(path: &Path, added: impl Iterator<Item = Added>) -> io::Result<(Sidecar, usize)> {
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let mut whole = 0;
        let mut bytes = Vec::new();
        for part in added {
            bytes.clear();
            (&mut file).take(part.bytes).read_to_end(&mut bytes)?;
            if Added::of(&bytes) != part {
                break;
            }
            whole += 1;
        }
        Ok((Sidecar { file }, whole))
    }

    /// Cuts off what follows the parts that were `added`.
    pub fn cut(&mut self, added: impl Iterator<Item = Added>) -> io::Result<()> {
        let length = added.map(|part| part.bytes).sum();
        self.file.set_len(length)?;
        self.file.seek(SeekFrom::Start(length))?;
        Ok(())
    }

    pub fn add(&mut self, bytes: &[u8]) -> io::Result<Added> {
        self.file.write_all(bytes)?;
        Ok(Added::of(bytes))
    }

    /// All of it.
    pub fn read(mut self) -> io::Result<BufReader<File>> {
        self.file.rewind()?;
        Ok(BufReader::with_capacity(1 << 16, self.file))
    }
}

impl Added {
    /// How many.
    pub fn bytes(self) -> u64 {
        self.bytes
    }

    fn of(bytes: &[u8]) -> Added {
        Added { bytes: bytes.len() as u64, checksum: crc32c::crc32c(bytes) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_parts_are_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sidecar");
        let (mut sidecar, _) = Sidecar::open(&path, [].into_iter()).unwrap();
        let added = [&b"one"[..], b"", b"three"].map(|bytes| sidecar.add(bytes).unwrap());
        for (length, whole) in [(8, 3), (7, 2), (3, 2), (2, 0)] {
            OpenOptions::new().write(true).open(&path).unwrap().set_len(length).unwrap();
            let (mut sidecar, found) = Sidecar::open(&path, added.into_iter()).unwrap();
            assert_eq!(found, whole, "{length}");
            sidecar.cut(added[..found].iter().copied()).unwrap();
            sidecar.add(b"!").unwrap();
            let mut text = String::new();
            sidecar.read().unwrap().read_to_string(&mut text).unwrap();
            assert_eq!(text, format!("{}!", &"onethree"[..[0, 3, 3, 8][found]]));
        }
    }
}
