//! Puts the right checksums on changed bytes, as a hostile author would.

use bytemuck::{bytes_of, bytes_of_mut};
use raystrips_pack::PageEntry;
use raystrips_pack::layout::{FOOTER_BYTES, Footer, Section, SectionEntry};
use std::ops::Range;

/// Recomputes every checksum that still covers bytes of the file: pages, then sections, then their table.
pub fn reseal(file: &mut [u8]) {
    let Some(table) = table_range(file) else { return };
    for place in records::<SectionEntry>(&table) {
        let section: SectionEntry = bytemuck::pod_read_unaligned(&file[place.clone()]);
        let Some(range) = inside(file, section.offset, section.bytes) else { continue };
        if section.kind == Section::Directory as u32 {
            for place in records::<PageEntry>(&range) {
                reseal_page(file, place);
            }
        }
        let section = SectionEntry { checksum: crc32c::crc32c(&file[range]), ..section };
        file[place].copy_from_slice(bytes_of(&section));
    }
    let mut footer = footer(file);
    footer.sections_checksum = crc32c::crc32c(&file[table]);
    let end = file.len() - FOOTER_BYTES;
    file[end..].copy_from_slice(bytes_of(&footer));
}

fn reseal_page(file: &mut [u8], place: Range<usize>) {
    let mut entry: PageEntry = bytemuck::pod_read_unaligned(&file[place.clone()]);
    if let Some(range) = inside(file, entry.offset, entry.bytes.into()) {
        entry.checksum = crc32c::crc32c(&file[range]);
        file[place].copy_from_slice(bytes_of(&entry));
    }
}

/// Where every part of the sound pack `file` is that is not padding: name and place.
pub fn parts(file: &[u8]) -> Vec<(String, Range<usize>)> {
    let table = table_range(file).unwrap();
    let mut parts = vec![("header".into(), 0..16), ("footer".into(), table.end..file.len())];
    for place in records::<SectionEntry>(&table) {
        let section: SectionEntry = bytemuck::pod_read_unaligned(&file[place]);
        let range = inside(file, section.offset, section.bytes).unwrap();
        if section.kind == Section::Directory as u32 {
            for (i, place) in records::<PageEntry>(&range).enumerate() {
                let page: PageEntry = bytemuck::pod_read_unaligned(&file[place]);
                parts.push((format!("page {i}"), inside(file, page.offset, page.bytes.into()).unwrap()));
            }
        }
        parts.push((format!("section {}", section.kind), range));
    }
    parts.push(("section table".into(), table));
    parts
}

fn footer(file: &[u8]) -> Footer {
    let mut footer: Footer = bytemuck::Zeroable::zeroed();
    bytes_of_mut(&mut footer).copy_from_slice(&file[file.len() - FOOTER_BYTES..]);
    footer
}

fn table_range(file: &[u8]) -> Option<Range<usize>> {
    let footer = footer(file);
    inside(file, footer.sections_offset, u64::from(footer.section_count) * size_of::<SectionEntry>() as u64)
}

fn inside(file: &[u8], offset: u64, bytes: u64) -> Option<Range<usize>> {
    let end = offset.checked_add(bytes).filter(|&end| end <= file.len() as u64)?;
    Some(offset as usize..end as usize)
}

fn records<T>(range: &Range<usize>) -> impl Iterator<Item = Range<usize>> + use<T> {
    let (start, end, size) = (range.start, range.end, size_of::<T>());
    (start..end).step_by(size).map(move |at| at..at + size).filter(move |r| r.end <= end)
}
