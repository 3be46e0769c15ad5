//! Finds and reads sections: header, footer, section table, and what the table names.

use crate::PackError;
use crate::layout::*;
use bytemuck::Pod;
use std::io::{Read, Seek, SeekFrom};

/// Sections by kind, each length checked against the file before memory is taken for it.
pub(crate) struct Sections<'a, F> {
    file: &'a mut F,
    table: Vec<SectionEntry>,
    /// Length of the file.
    pub length: u64,
}

impl<'a, F: Read + Seek> Sections<'a, F> {
    /// Reads header, footer and section table.
    pub fn find(file: &'a mut F) -> Result<Sections<'a, F>, PackError> {
        let length = file.seek(SeekFrom::End(0))?;
        check_header(file, length)?;
        let footer: Footer = read_pod(file, length - FOOTER_BYTES as u64)?;
        if footer.magic != MAGIC || footer.file_bytes != length {
            return Err(PackError::corrupt(format!("the file is cut off or has grown: {length} bytes")));
        }
        let table = read_table(file, &footer)?;
        Ok(Sections { file, table, length })
    }

    /// Where the section is, of which there must be exactly one.
    pub fn entry(&self, kind: Section) -> Result<SectionEntry, PackError> {
        let entry = self.optional_entry(kind)?;
        entry.ok_or_else(|| PackError::corrupt(format!("{kind:?} section is missing")))
    }

    /// Where the section is, of which there may be one.
    pub fn optional_entry(&self, kind: Section) -> Result<Option<SectionEntry>, PackError> {
        let wrong = |what: &str| PackError::corrupt(format!("{kind:?} section {what}"));
        let mut found = self.table.iter().filter(|e| e.kind == kind as u32);
        let Some(&entry) = found.next() else { return Ok(None) };
        if found.next().is_some() {
            return Err(wrong("is there twice"));
        }
        if !entry.offset.is_multiple_of(ALIGNMENT) {
            return Err(wrong("is not aligned"));
        }
        if entry.offset.checked_add(entry.bytes).is_none_or(|end| end > self.length) {
            return Err(wrong("lies beyond the end of the file"));
        }
        Ok(Some(entry))
    }

    /// The whole section, which is an array of `T`.
    pub fn array<T: Pod>(&mut self, kind: Section) -> Result<Vec<T>, PackError> {
        let entry = self.entry(kind)?;
        self.array_at(kind, &entry)
    }

    /// The whole section if there is one.
    pub fn optional_array<T: Pod>(&mut self, kind: Section) -> Result<Vec<T>, PackError> {
        let entry = self.optional_entry(kind)?;
        entry.map_or(Ok(Vec::new()), |entry| self.array_at(kind, &entry))
    }

    fn array_at<T: Pod>(&mut self, kind: Section, entry: &SectionEntry) -> Result<Vec<T>, PackError> {
        if !entry.bytes.is_multiple_of(size_of::<T>() as u64) {
            return Err(PackError::corrupt(format!("{kind:?} section has an odd length")));
        }
        let array = read_array(self.file, entry.offset, entry.bytes)?;
        if crc32c::crc32c(bytemuck::cast_slice(&array)) != entry.checksum {
            return Err(PackError::corrupt(format!("{kind:?} section: its checksum does not match")));
        }
        Ok(array)
    }
}

/// Checks the header; afterwards the file is known to be long enough for header and footer.
fn check_header(file: &mut (impl Read + Seek), length: u64) -> Result<(), PackError> {
    if length < (FILE_HEADER_BYTES + FOOTER_BYTES) as u64 {
        let mut start = vec![0; length.min(MAGIC.len() as u64) as usize];
        file.seek(SeekFrom::Start(0))?;
        file.read_exact(&mut start)?;
        let begins_well = !start.is_empty() && MAGIC.starts_with(&start);
        return Err(if begins_well {
            PackError::corrupt("the file is cut off")
        } else {
            PackError::NotAPack
        });
    }
    let header: FileHeader = read_pod(file, 0)?;
    if header.magic != MAGIC {
        return Err(PackError::NotAPack);
    }
    if header.version != FORMAT_VERSION {
        return Err(PackError::Version { expected: FORMAT_VERSION, got: header.version });
    }
    if header.reserved != 0 {
        return Err(PackError::corrupt("bad header"));
    }
    Ok(())
}

/// Reads the section table, which must end where the footer begins.
fn read_table(file: &mut (impl Read + Seek), footer: &Footer) -> Result<Vec<SectionEntry>, PackError> {
    let bytes = u64::from(footer.section_count) * size_of::<SectionEntry>() as u64;
    let end = footer.sections_offset.checked_add(bytes);
    if end != Some(footer.file_bytes - FOOTER_BYTES as u64)
        || !footer.sections_offset.is_multiple_of(ALIGNMENT)
    {
        return Err(PackError::corrupt("bad section table"));
    }
    let table = read_array(file, footer.sections_offset, bytes)?;
    if crc32c::crc32c(bytemuck::cast_slice(&table)) != footer.sections_checksum {
        return Err(PackError::corrupt("section table: its checksum does not match"));
    }
    Ok(table)
}

/// Reads `bytes` bytes, which the caller has checked against the length of the file.
fn read_array<T: Pod>(file: &mut (impl Read + Seek), offset: u64, bytes: u64) -> Result<Vec<T>, PackError> {
    let bytes = usize::try_from(bytes)
        .map_err(|_| PackError::TooLarge("a section is larger than this machine can address".into()))?;
    let mut array = vec![T::zeroed(); bytes / size_of::<T>()];
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(bytemuck::cast_slice_mut(&mut array))?;
    Ok(array)
}

fn read_pod<T: Pod>(file: &mut (impl Read + Seek), offset: u64) -> Result<T, PackError> {
    let mut value = T::zeroed();
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(bytemuck::bytes_of_mut(&mut value))?;
    Ok(value)
}
