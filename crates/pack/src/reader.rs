//! Opens a pack: header, footer, section table, and the sections that stay in memory. Pages are not read here.

use crate::PackError;
use crate::layout::*;
use crate::manifest::Manifest;
use crate::page::check::boxes_are_sane;
use bytemuck::Pod;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// The resident part of a pack.
///
/// Memory: 32 bytes a page, the nodes above the pages, the emitters and the manifest.
#[derive(Clone, Debug)]
pub struct Pack {
    /// Numbers and names.
    pub manifest: Manifest,
    /// Where the pages are.
    pub directory: Vec<PageEntry>,
    /// Nodes above the pages; node 0 is the root.
    pub top_nodes: Vec<TopNode>,
    /// Ways into pages.
    pub top_entries: Vec<TopEntry>,
    /// Emissive triangles.
    pub emitters: Vec<Emitter>,
    /// Length of the file.
    pub file_bytes: u64,
    triangle_ids: SectionEntry,
}

impl Pack {
    /// Reads all but the pages and the triangle ids, and checks it. Takes time by the number of pages, not of
    /// triangles.
    pub fn open(file: &mut File) -> Result<Pack, PackError> {
        let length = file.seek(SeekFrom::End(0))?;
        check_header(file, length)?;
        let footer: Footer = read_pod(file, length.saturating_sub(FOOTER_BYTES as u64))?;
        if footer.magic != MAGIC || footer.file_bytes != length {
            return Err(PackError::corrupt(format!("the file is cut off or has grown: {length} bytes")));
        }
        let table = read_sections(file, &footer, length)?;
        let mut sections = Sections { file, table, length };
        let manifest = Manifest::decode(&sections.bytes(Section::Manifest)?)?;
        let pack = Pack {
            directory: sections.array(Section::Directory)?,
            top_nodes: sections.array(Section::TopNodes)?,
            top_entries: sections.array(Section::TopEntries)?,
            emitters: sections.array(Section::Emitters)?,
            triangle_ids: sections.entry(Section::TriangleIds)?,
            file_bytes: length,
            manifest,
        };
        pack.check_directory()?;
        pack.check_top()?;
        pack.check_scene()?;
        Ok(pack)
    }

    /// Where the original ids of triangles are in the file: offset and length; the length is 0 if none are kept.
    pub fn triangle_ids(&self) -> (u64, u64) {
        (self.triangle_ids.offset, self.triangle_ids.bytes)
    }

    /// CRC-32C of the original ids.
    pub fn triangle_ids_checksum(&self) -> u32 {
        self.triangle_ids.checksum
    }

    fn check_directory(&self) -> Result<(), PackError> {
        let mut triangles = 0u64;
        for (page, entry) in self.directory.iter().enumerate() {
            let inside =
                entry.offset.checked_add(u64::from(entry.bytes)).is_some_and(|end| end <= self.file_bytes);
            if !inside || entry.offset % ALIGNMENT != 0 || entry.first_triangle != triangles {
                let what = "its directory entry is wrong".into();
                return Err(PackError::CorruptPage { page: page as PageId, what });
            }
            triangles += u64::from(entry.triangle_count);
        }
        if triangles != self.manifest.triangles || self.directory.len() as u64 != self.manifest.pages {
            return Err(PackError::corrupt("directory and manifest differ"));
        }
        let ids = triangles.checked_mul(u64::from(self.manifest.id_bytes));
        if ids != Some(self.triangle_ids.bytes) || ![0, 4, 8].contains(&self.manifest.id_bytes) {
            return Err(PackError::corrupt("wrong number of triangle ids"));
        }
        Ok(())
    }

    /// Checks that the top nodes are a tree of bounded depth whose leaves are pages.
    fn check_top(&self) -> Result<(), PackError> {
        let wrong = |i: usize, what: &str| Err(PackError::corrupt(format!("top node {i}: {what}")));
        if self.top_nodes.is_empty() || self.manifest.depth as usize > MAX_DEPTH {
            return Err(PackError::corrupt("no root, or too deep"));
        }
        let mut depth = vec![0u32; self.top_nodes.len()];
        for (i, node) in self.top_nodes.iter().enumerate() {
            let here = depth[i].max(1);
            if !boxes_are_sane(&node.boxes) || here > self.manifest.depth {
                return wrong(i, "bad grid or depth");
            }
            for child in node.child.into_iter().filter(|&c| c != TopNode::EMPTY) {
                if child & TopNode::ENTRY != 0 {
                    let entry = self.top_entries.get((child & !TopNode::ENTRY) as usize);
                    if !entry.is_some_and(|e| self.has_node(e)) {
                        return wrong(i, "leads to no page");
                    }
                } else {
                    let c = child as usize;
                    if c <= i || c >= self.top_nodes.len() || depth[c] != 0 {
                        return wrong(i, "bad child");
                    }
                    depth[c] = here + 1;
                }
            }
        }
        Ok(())
    }

    fn has_node(&self, entry: &TopEntry) -> bool {
        self.directory.get(entry.page as usize).is_some_and(|page| entry.node < page.node_count)
    }

    fn check_scene(&self) -> Result<(), PackError> {
        let scene = &self.manifest.scene;
        if scene.geometries.iter().any(|g| g.material as usize >= scene.materials.len()) {
            return Err(PackError::corrupt("a geometry has no material"));
        }
        if self.emitters.iter().any(|e| e.geometry as usize >= scene.geometries.len()) {
            return Err(PackError::corrupt("an emitter has no geometry"));
        }
        Ok(())
    }
}

fn check_header(file: &mut File, length: u64) -> Result<(), PackError> {
    if length < (FILE_HEADER_BYTES + FOOTER_BYTES) as u64 {
        let mut start = vec![0; length.min(8) as usize];
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

fn read_sections(file: &mut File, footer: &Footer, length: u64) -> Result<Vec<SectionEntry>, PackError> {
    let bytes = u64::from(footer.section_count) * size_of::<SectionEntry>() as u64;
    let end = footer.sections_offset.checked_add(bytes);
    if end != Some(length - FOOTER_BYTES as u64) {
        return Err(PackError::corrupt("bad section table"));
    }
    let table = read_array(file, footer.sections_offset, bytes)?;
    if crc32c::crc32c(bytemuck::cast_slice(&table)) != footer.sections_checksum {
        return Err(PackError::corrupt("section table: its checksum does not match"));
    }
    Ok(table)
}

/// Sections by kind, each length checked against the file before memory is taken for it.
struct Sections<'a> {
    file: &'a mut File,
    table: Vec<SectionEntry>,
    length: u64,
}

impl Sections<'_> {
    fn entry(&self, kind: Section) -> Result<SectionEntry, PackError> {
        let entry = self.table.iter().find(|e| e.kind == kind as u32);
        let entry = *entry.ok_or_else(|| PackError::corrupt(format!("{kind:?} section is missing")))?;
        if entry.offset.checked_add(entry.bytes).is_none_or(|end| end > self.length) {
            return Err(PackError::corrupt(format!("{kind:?} section lies beyond the end of the file")));
        }
        Ok(entry)
    }

    fn array<T: Pod>(&mut self, kind: Section) -> Result<Vec<T>, PackError> {
        let entry = self.entry(kind)?;
        if entry.bytes % size_of::<T>() as u64 != 0 {
            return Err(PackError::corrupt(format!("{kind:?} section has an odd length")));
        }
        let array = read_array(self.file, entry.offset, entry.bytes)?;
        if crc32c::crc32c(bytemuck::cast_slice(&array)) != entry.checksum {
            return Err(PackError::corrupt(format!("{kind:?} section: its checksum does not match")));
        }
        Ok(array)
    }

    fn bytes(&mut self, kind: Section) -> Result<Vec<u8>, PackError> {
        self.array(kind)
    }
}

/// Reads `bytes` bytes, which the caller has checked against the length of the file.
fn read_array<T: Pod>(file: &mut File, offset: u64, bytes: u64) -> io::Result<Vec<T>> {
    let mut array = vec![T::zeroed(); bytes as usize / size_of::<T>()];
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(bytemuck::cast_slice_mut(&mut array))?;
    Ok(array)
}

fn read_pod<T: Pod>(file: &mut File, offset: u64) -> io::Result<T> {
    let mut value = T::zeroed();
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(bytemuck::bytes_of_mut(&mut value))?;
    Ok(value)
}
