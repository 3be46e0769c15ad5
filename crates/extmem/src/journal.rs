//! What is done, one record after the other, so that work can go on after the process was killed.
//!
//! A record is its length and the CRC-32C of its bytes, both 4 bytes little-endian, then the bytes. A record that was
//! being written when the end came does not match and ends the journal.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;

const HEAD: usize = 8;

/// A journal that can be added to.
#[derive(Debug)]
pub struct Journal {
    file: File,
}

impl Journal {
    /// Opens the journal at `path`, or begins it, and gives its whole records. What follows them is cut off.
    pub fn open(path: &Path) -> io::Result<(Journal, Vec<Vec<u8>>)> {
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let mut records = Vec::new();
        let mut rest = bytes.as_slice();
        while let Some((record, after)) = split_record(rest) {
            records.push(record.to_vec());
            rest = after;
        }
        file.set_len((bytes.len() - rest.len()) as u64)?;
        Ok((Journal { file }, records))
    }

    /// Adds a record.
    pub fn append(&mut self, record: &[u8]) -> io::Result<()> {
        let length = u32::try_from(record.len())
            .map_err(|_| io::Error::new(io::ErrorKind::FileTooLarge, "a record of more than 4 GiB"))?;
        let mut bytes = Vec::with_capacity(HEAD + record.len());
        bytes.extend(length.to_le_bytes());
        bytes.extend(crc32c::crc32c(record).to_le_bytes());
        bytes.extend(record);
        self.file.write_all(&bytes)
    }

    /// Forgets all records.
    pub fn clear(&mut self) -> io::Result<()> {
        self.file.set_len(0)
    }

    /// Brings all records to the disk.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }
}

/// The first record and what follows it.
fn split_record(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (checksum, rest) = rest.split_first_chunk::<4>()?;
    let (record, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    (crc32c::crc32c(record) == u32::from_le_bytes(*checksum)).then_some((record, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_cut_off_or_damaged_whole_records_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let records: Vec<Vec<u8>> = (0..4).map(|i| vec![i as u8 + 1; i * 3]).collect();
        let (mut journal, none) = Journal::open(&path).unwrap();
        assert!(none.is_empty());
        records.iter().for_each(|r| journal.append(r).unwrap());
        let whole = std::fs::read(&path).unwrap();
        let ends: Vec<usize> = records
            .iter()
            .scan(0, |end, r| {
                *end += HEAD + r.len();
                Some(*end)
            })
            .collect();
        for cut in 0..=whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let (mut journal, found) = Journal::open(&path).unwrap();
            let expected = ends.iter().filter(|&&end| end <= cut).count();
            assert_eq!(found, records[..expected]);
            journal.append(b"next").unwrap();
            assert_eq!(Journal::open(&path).unwrap().1.last().unwrap(), b"next");
        }
        for bit in 0..whole.len() * 8 {
            let mut damaged = whole.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            std::fs::write(&path, damaged).unwrap();
            let found = Journal::open(&path).unwrap().1;
            assert!(found.len() < 4 && found == records[..found.len()]);
        }
    }
}
