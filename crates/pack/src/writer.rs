//! Writes a pack: pages as they come, then sections, then the footer. The file appears under its name whole or
//! not at all; until then it has another name, under which an interrupted work can be taken up again.

use crate::PackError;
use crate::layout::*;
use crate::manifest::{ByteCounts, Manifest};
use crate::page::builder::BuiltPage;
use crate::proxy::ProxyKind;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

const HEADER: FileHeader = FileHeader { magic: MAGIC, version: FORMAT_VERSION, reserved: 0 };

/// What follows the pages. Long lists are read where they are, not held.
pub struct PackContents<'a> {
    /// Nodes above the pages; node 0 is the root.
    pub top_nodes: &'a [TopNode],
    /// Ways into pages.
    pub top_entries: &'a [TopEntry],
    /// Parts of the scene at places of their own.
    pub instances: &'a [Instance],
    /// Emissive triangles: an array of [`Emitter`].
    pub emitters: &'a mut dyn Read,
    /// Original triangle ids in the order of the pack, [`Manifest::id_bytes`] each; empty if not kept.
    pub triangle_ids: &'a mut dyn Read,
    /// Box of each geometry; empty if they are not kept.
    pub geometry_bounds: &'a [GeometryBounds],
    /// Packs of proxies.
    pub proxies: Vec<(ProxyKind, &'a mut dyn Read)>,
    /// An [`BlockEntry`] for each page, and the blocks that they name; `None` if there are no attributes.
    pub attributes: Option<[&'a mut dyn Read; 2]>,
    /// A [`BlockEntry`] for each tile of the images, and the codes that they name; `None` if there are none.
    pub tiles: Option<(&'a [BlockEntry], &'a mut dyn Read)>,
}

/// A page without its bytes: what a writer must know of it to go on where another one ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PageRecord {
    offset: u64,
    /// Zeros before it.
    padding: u64,
    bytes: u32,
    checksum: u32,
    triangle_count: u32,
    segment_count: u32,
    node_count: u32,
    strip_count: u64,
    cluster_count: u64,
    counts: ByteCounts,
}

impl PageRecord {
    fn of(page: &BuiltPage, offset: u64, padding: u64) -> PageRecord {
        PageRecord {
            offset,
            padding,
            bytes: page.bytes.len() as u32,
            checksum: crc32c::crc32c(&page.bytes),
            triangle_count: page.triangle_count,
            segment_count: page.segment_count,
            node_count: page.node_count,
            strip_count: page.strip_count,
            cluster_count: page.cluster_count,
            counts: page.counts,
        }
    }

    fn end(&self) -> u64 {
        self.offset + u64::from(self.bytes)
    }
}

/// Writes one pack. Dropped before [`PackWriter::finish`], it leaves the partial file behind.
///
/// Memory: 32 bytes a page.
pub struct PackWriter {
    out: BufWriter<File>,
    partial: PathBuf,
    position: u64,
    directory: Vec<PageEntry>,
    /// Pages with strands.
    strand_pages: u64,
    totals: Manifest,
}

impl PackWriter {
    /// Begins a pack in the file `partial`.
    pub fn create(partial: &Path, manifest: Manifest) -> Result<PackWriter, PackError> {
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(partial)?;
        let mut writer = PackWriter::new(file, partial, 0, manifest);
        writer.write(bytemuck::bytes_of(&HEADER))?;
        Ok(writer)
    }

    /// Goes on with the pack in the file `partial` after its first pages, those of `pieces` in their order, as far as
    /// they are whole: tells of how many pieces. What follows them is cut off.
    pub fn reopen(
        partial: &Path,
        manifest: Manifest,
        pieces: &[&[PageRecord]],
    ) -> Result<(PackWriter, usize), PackError> {
        let mut file = OpenOptions::new().read(true).write(true).open(partial)?;
        let mut position = FILE_HEADER_BYTES as u64;
        let mut whole = 0;
        for piece in pieces {
            if !are_whole(&mut file, piece) {
                break;
            }
            position = piece.iter().map(PageRecord::end).fold(position, u64::max);
            whole += 1;
        }
        let mut writer = PackWriter::new(file, partial, FILE_HEADER_BYTES as u64, manifest);
        writer.position = position;
        for page in pieces[..whole].iter().copied().flatten() {
            writer.account(page)?;
        }
        // The header has no checksum: it is written again.
        let file = writer.out.get_mut();
        file.rewind()?;
        file.write_all(bytemuck::bytes_of(&HEADER))?;
        file.set_len(writer.position)?;
        file.seek(SeekFrom::End(0))?;
        Ok((writer, whole))
    }

    fn new(file: File, partial: &Path, position: u64, manifest: Manifest) -> PackWriter {
        PackWriter {
            out: BufWriter::with_capacity(1 << 20, file),
            partial: partial.to_owned(),
            position,
            directory: Vec::new(),
            strand_pages: 0,
            totals: manifest,
        }
    }

    /// Number that the next page's first triangle will have.
    pub fn next_triangle(&self) -> u64 {
        self.totals.primitives
    }

    /// Pages so far.
    pub fn page_count(&self) -> u64 {
        self.directory.len() as u64
    }

    /// Appends a page.
    pub fn page(&mut self, page: &BuiltPage) -> Result<PageRecord, PackError> {
        let padding = self.pad()?;
        let record = PageRecord::of(page, self.position, padding);
        self.write(&page.bytes)?;
        self.account(&record)?;
        Ok(record)
    }

    /// Appends pages, which are numbered as they come, in the order in which `order` names them.
    ///
    /// # Panics
    /// If `order` does not name each of them.
    pub fn pages(&mut self, pages: &[BuiltPage], order: &[u32]) -> Result<Vec<PageRecord>, PackError> {
        let mut records = vec![None; pages.len()];
        for &i in order {
            let page = &pages[i as usize];
            let padding = self.pad()?;
            records[i as usize] = Some(PageRecord::of(page, self.position, padding));
            self.write(&page.bytes)?;
        }
        let records: Vec<PageRecord> =
            records.into_iter().map(|record| record.expect("every page is named")).collect();
        records.iter().try_for_each(|record| self.account(record))?;
        Ok(records)
    }

    /// Enters a page into the directory and the totals.
    fn account(&mut self, page: &PageRecord) -> Result<(), PackError> {
        if self.page_count() >= MAX_PAGES {
            let what = "more pages than 29 bits can number; use a larger --page-size";
            return Err(PackError::TooLarge(what.into()));
        }
        self.directory.push(PageEntry {
            offset: page.offset,
            first_triangle: self.totals.primitives,
            bytes: page.bytes,
            checksum: page.checksum,
            triangle_count: page.triangle_count,
            node_count: page.node_count,
        });
        let totals = &mut self.totals;
        totals.primitives += u64::from(page.triangle_count);
        totals.segments += u64::from(page.segment_count);
        totals.strips += page.strip_count;
        totals.clusters += page.cluster_count;
        totals.pages += 1;
        let mut counts = page.counts;
        counts.page_overhead += page.padding + size_of::<PageEntry>() as u64;
        totals.bytes.add(&counts);
        if page.segment_count > 0 {
            totals.strand_bytes.add(&counts);
            self.strand_pages += 1;
        }
        Ok(())
    }

    /// Hands what was written to the system, so that it outlives this process.
    pub fn flush(&mut self) -> Result<(), PackError> {
        Ok(self.out.flush()?)
    }

    /// The manifest as it will be written; counts of pages, triangles and bytes are kept by the writer.
    pub fn manifest_mut(&mut self) -> &mut Manifest {
        &mut self.totals
    }

    /// Writes the sections and gives the file the name `path`, in the same file system as the partial one. Gives the
    /// manifest and the length of the file.
    ///
    /// # Panics
    /// If the triangle ids are not as many as the triangles.
    pub fn finish(mut self, path: &Path, contents: PackContents) -> Result<(Manifest, u64), PackError> {
        let top_bytes = size_of_val(contents.top_nodes)
            + size_of_val(contents.top_entries)
            + size_of_val(contents.instances);
        let top_bytes = top_bytes as u64;
        self.totals.bytes.nodes += top_bytes;
        self.totals.instances = contents.instances.len() as u64;
        self.totals.strand_bytes.nodes += top_bytes * self.strand_pages / self.page_count().max(1);
        let id_bytes = u64::from(self.totals.id_bytes);
        self.totals.bytes.ids = self.totals.primitives * id_bytes;
        // The manifest tells the lengths of the others.
        let mut shading = Vec::new();
        if let Some([directory, blocks]) = contents.attributes {
            shading.push(self.section(Section::AttributeDirectory, directory)?);
            shading.push(self.section(Section::Attributes, blocks)?);
            self.totals.bytes.attributes = shading.iter().map(|section| section.bytes).sum();
        }
        if let Some((directory, codes)) = contents.tiles {
            let directory = self.section(Section::TileDirectory, bytemuck::cast_slice(directory))?;
            let codes = self.section(Section::Tiles, codes)?;
            self.totals.bytes.textures = directory.bytes + codes.bytes;
            shading.extend([directory, codes]);
        }
        let manifest = self.totals.encode()?;
        let directory = std::mem::take(&mut self.directory);
        let mut sections = vec![
            self.section(Section::Directory, bytemuck::cast_slice(&directory))?,
            self.section(Section::TopNodes, bytemuck::cast_slice(contents.top_nodes))?,
            self.section(Section::TopEntries, bytemuck::cast_slice(contents.top_entries))?,
            self.section(Section::Emitters, contents.emitters)?,
            self.section(Section::TriangleIds, contents.triangle_ids)?,
            self.section(Section::Manifest, manifest.as_slice())?,
        ];
        assert_eq!(sections[4].bytes, self.totals.bytes.ids, "bytes of triangle ids");
        if !contents.geometry_bounds.is_empty() {
            let bounds: &[u8] = bytemuck::cast_slice(contents.geometry_bounds);
            sections.push(self.section(Section::GeometryBounds, bounds)?);
        }
        if !contents.instances.is_empty() {
            sections.push(self.section(Section::Instances, bytemuck::cast_slice(contents.instances))?);
        }
        for (kind, proxy) in contents.proxies {
            sections.push(self.section(kind.section(), proxy)?);
        }
        sections.extend(shading);
        self.pad()?;
        let sections_offset = self.position;
        let table: &[u8] = bytemuck::cast_slice(&sections);
        self.write(table)?;
        let footer = Footer {
            sections_offset,
            section_count: sections.len() as u32,
            sections_checksum: crc32c::crc32c(table),
            file_bytes: self.position + FOOTER_BYTES as u64,
            magic: MAGIC,
        };
        self.write(bytemuck::bytes_of(&footer))?;
        let bytes = self.position;
        publish(self.out, &self.partial, path)?;
        Ok((self.totals, bytes))
    }

    fn section(&mut self, kind: Section, mut contents: impl Read) -> Result<SectionEntry, PackError> {
        self.pad()?;
        let offset = self.position;
        let mut checksum = 0;
        let mut buffer = vec![0; 1 << 16];
        loop {
            let read = contents.read(&mut buffer)?;
            if read == 0 {
                break;
            }
            self.write(&buffer[..read])?;
            checksum = crc32c::crc32c_append(checksum, &buffer[..read]);
        }
        Ok(SectionEntry { kind: kind as u32, checksum, offset, bytes: self.position - offset })
    }

    fn pad(&mut self) -> Result<u64, PackError> {
        let padding = self.position.next_multiple_of(ALIGNMENT) - self.position;
        self.write(&[0; ALIGNMENT as usize][..padding as usize])?;
        Ok(padding)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), PackError> {
        self.out.write_all(bytes)?;
        self.position += bytes.len() as u64;
        Ok(())
    }
}

/// True if all `pages` are there as they were.
fn are_whole(file: &mut File, pages: &[PageRecord]) -> bool {
    let mut bytes = Vec::new();
    let mut is_whole = |page: &PageRecord| {
        bytes.clear();
        let read = file.seek(SeekFrom::Start(page.offset));
        let read = read.and_then(|_| file.take(u64::from(page.bytes)).read_to_end(&mut bytes));
        read.is_ok() && bytes.len() == page.bytes as usize && crc32c::crc32c(&bytes) == page.checksum
    };
    pages.iter().all(&mut is_whole)
}

/// Brings everything to the disk, then gives the file its name, then brings that to the disk where the system can.
fn publish(out: BufWriter<File>, partial: &Path, path: &Path) -> Result<(), PackError> {
    let file = out.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    file.sync_all()?;
    std::fs::rename(partial, path)?;
    #[cfg(unix)]
    {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        _ = File::open(folder).and_then(|folder| folder.sync_all());
    }
    Ok(())
}
