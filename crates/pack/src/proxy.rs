//! Packs in a pack: stand-ins for the scene, of fewer triangles.

use crate::PackError;
use crate::layout::{Section, SectionEntry};
use std::io::{self, Read, Seek, SeekFrom};

/// Which stand-in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProxyKind {
    /// About 2 % of the triangles.
    Fine,
    /// As few triangles as fit the cache of a processor.
    Coarse,
}

impl ProxyKind {
    /// All kinds.
    pub const ALL: [ProxyKind; 2] = [ProxyKind::Fine, ProxyKind::Coarse];

    /// An error in the pack of a proxy as one of the pack around it.
    pub fn error(self, error: PackError) -> PackError {
        match error {
            PackError::Io(error) => PackError::Io(error),
            PackError::Corrupt(what) => PackError::Corrupt(format!("{self:?} proxy: {what}")),
            other => PackError::Corrupt(format!("{self:?} proxy: {other}")),
        }
    }

    pub(crate) fn section(self) -> Section {
        match self {
            ProxyKind::Fine => Section::FineProxy,
            ProxyKind::Coarse => Section::CoarseProxy,
        }
    }
}

/// A part of a file as if it were one.
pub(crate) struct Part<'a, F> {
    file: &'a mut F,
    begin: u64,
    length: u64,
    position: u64,
}

impl<'a, F: Read + Seek> Part<'a, F> {
    /// The part of `file` that `entry` names, which was checked against its length.
    pub fn new(file: &'a mut F, entry: &SectionEntry) -> Part<'a, F> {
        Part { file, begin: entry.offset, length: entry.bytes, position: 0 }
    }
}

impl<F: Read + Seek> Read for Part<'_, F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.length.saturating_sub(self.position);
        let most = buffer.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        self.file.seek(SeekFrom::Start(self.begin + self.position))?;
        let read = self.file.read(&mut buffer[..most])?;
        self.position += read as u64;
        Ok(read)
    }
}

impl<F> Seek for Part<'_, F> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::End(by) => self.length.checked_add_signed(by),
            SeekFrom::Current(by) => self.position.checked_add_signed(by),
        };
        self.position = place.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn a_part_is_like_a_file() {
        let mut file = Cursor::new(b"0123456789");
        let entry = SectionEntry { kind: 8, checksum: 0, offset: 2, bytes: 5 };
        let mut part = Part::new(&mut file, &entry);
        let mut text = String::new();
        part.read_to_string(&mut text).unwrap();
        assert_eq!(text, "23456");
        assert_eq!(part.seek(SeekFrom::End(-2)).unwrap(), 3);
        text.clear();
        part.read_to_string(&mut text).unwrap();
        assert_eq!(text, "56");
        assert!(part.seek(SeekFrom::Current(-9)).is_err());
        part.seek(SeekFrom::Start(99)).unwrap();
        assert_eq!(part.read(&mut [0; 4]).unwrap(), 0);
    }
}
