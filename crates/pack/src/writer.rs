//! Writes a pack: pages as they come, then sections, then the footer. The file appears under its name whole or
//! not at all.

use crate::PackError;
use crate::layout::*;
use crate::manifest::Manifest;
use crate::page::builder::BuiltPage;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// What follows the pages.
pub struct PackContents<'a> {
    /// Nodes above the pages; node 0 is the root.
    pub top_nodes: &'a [TopNode],
    /// Ways into pages.
    pub top_entries: &'a [TopEntry],
    /// Emissive triangles.
    pub emitters: &'a [Emitter],
    /// Original triangle ids in the order of the pack, [`Manifest::id_bytes`] each; empty if not kept.
    pub triangle_ids: &'a [u8],
}

/// Writes one pack. Dropped before [`PackWriter::finish`], it leaves nothing behind.
///
/// Memory: 32 bytes a page.
pub struct PackWriter {
    out: BufWriter<NamedTempFile>,
    path: PathBuf,
    position: u64,
    directory: Vec<PageEntry>,
    totals: Manifest,
}

impl PackWriter {
    /// Begins a pack that will be named `path`, in the folder of that name.
    pub fn create(path: &Path, manifest: Manifest) -> Result<PackWriter, PackError> {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut builder = tempfile::Builder::new();
        builder.prefix(".raystrips-").suffix(".partial");
        readable_as_usual(&mut builder);
        let file = builder.tempfile_in(folder)?;
        let mut writer = PackWriter {
            out: BufWriter::with_capacity(1 << 20, file),
            path: path.to_owned(),
            position: 0,
            directory: Vec::new(),
            totals: manifest,
        };
        writer.write(bytemuck::bytes_of(&FileHeader {
            magic: MAGIC,
            version: FORMAT_VERSION,
            reserved: 0,
        }))?;
        Ok(writer)
    }

    /// Number that the next page's first triangle will have.
    pub fn next_triangle(&self) -> u64 {
        self.totals.triangles
    }

    /// Appends a page and gives its number.
    pub fn page(&mut self, page: &BuiltPage) -> Result<PageId, PackError> {
        if self.directory.len() as u64 >= MAX_PAGES {
            let what = "more pages than 29 bits can number; use a larger --page-size";
            return Err(PackError::TooLarge(what.into()));
        }
        let id = self.directory.len() as PageId;
        let padding = self.pad()?;
        self.directory.push(PageEntry {
            offset: self.position,
            first_triangle: self.totals.triangles,
            bytes: page.bytes.len() as u32,
            checksum: crc32c::crc32c(&page.bytes),
            triangle_count: page.triangle_count,
            node_count: page.node_count,
        });
        self.write(&page.bytes)?;
        let totals = &mut self.totals;
        totals.triangles += u64::from(page.triangle_count);
        totals.strips += page.strip_count;
        totals.clusters += page.cluster_count;
        totals.pages += 1;
        totals.bytes.add(&page.counts);
        totals.bytes.page_overhead += padding + size_of::<PageEntry>() as u64;
        Ok(id)
    }

    /// The manifest as it will be written; counts of pages, triangles and bytes are kept by the writer.
    pub fn manifest_mut(&mut self) -> &mut Manifest {
        &mut self.totals
    }

    /// Writes the sections and gives the file its name. Gives the manifest and the length of the file.
    ///
    /// # Panics
    /// If the triangle ids are not as many as the triangles.
    pub fn finish(mut self, contents: &PackContents) -> Result<(Manifest, u64), PackError> {
        self.totals.bytes.nodes +=
            (size_of_val(contents.top_nodes) + size_of_val(contents.top_entries)) as u64;
        self.totals.bytes.ids = contents.triangle_ids.len() as u64;
        let id_bytes = u64::from(self.totals.id_bytes);
        assert_eq!(self.totals.bytes.ids, self.totals.triangles * id_bytes, "bytes of triangle ids");
        let manifest = self.totals.encode()?;
        let directory = std::mem::take(&mut self.directory);
        let sections = [
            self.section(Section::Directory, bytemuck::cast_slice(&directory))?,
            self.section(Section::TopNodes, bytemuck::cast_slice(contents.top_nodes))?,
            self.section(Section::TopEntries, bytemuck::cast_slice(contents.top_entries))?,
            self.section(Section::Emitters, bytemuck::cast_slice(contents.emitters))?,
            self.section(Section::TriangleIds, contents.triangle_ids)?,
            self.section(Section::Manifest, &manifest)?,
        ];
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
        publish(self.out, &self.path)?;
        Ok((self.totals, bytes))
    }

    fn section(&mut self, kind: Section, bytes: &[u8]) -> Result<SectionEntry, PackError> {
        self.pad()?;
        let offset = self.position;
        self.write(bytes)?;
        Ok(SectionEntry {
            kind: kind as u32,
            checksum: crc32c::crc32c(bytes),
            offset,
            bytes: bytes.len() as u64,
        })
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

/// Brings everything to the disk, then gives the file its name, then brings that to the disk.
fn publish(out: BufWriter<NamedTempFile>, path: &Path) -> Result<(), PackError> {
    let file = out.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    #[cfg(unix)]
    std::fs::File::open(folder)?.sync_all()?;
    Ok(())
}

/// A temporary file is for its owner alone; a pack is a file like any other, within what the user's umask lets.
fn readable_as_usual(_builder: &mut tempfile::Builder) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        _builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
}
