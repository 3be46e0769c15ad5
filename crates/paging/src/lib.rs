//! Which pages of a pack are in memory.
//!
//! In a [`PageTable`] all of them are: the file is read, or mapped where it would take most of the memory that is left,
//! and every page is checked when the pack is opened, so that tracing cannot fail. A truncation of the file while it
//! is mapped ends the process; the writer replaces packs by renaming, never in place. In a [`PagePool`] some of them
//! are, read and checked when somebody asks for them.

mod clock;
mod file_bytes;
mod frames;
mod loan;
mod page;
mod parents;
mod pool;
mod probe;
mod runs;
mod side_blocks;
mod visit;

pub use loan::Loan;
pub use pool::{PagePool, PoolCounts};
pub use runs::Runs;
pub use visit::Visit;

use file_bytes::FileBytes;
use rayon::prelude::*;
use raystrips_extmem::spare_memory;
use raystrips_geom::texture::TILE_BYTES;
use raystrips_pack::{AttributeView, Pack, PackError, PageEntry, PageId, PageView, ProxyKind, check_page};
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Why a pack cannot be opened: names the file.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", path.display())]
pub struct OpenError {
    /// The pack.
    pub path: PathBuf,
    /// What is wrong with it.
    pub source: PackError,
}

/// The pages of one pack.
pub struct PageTable {
    pack: Pack,
    file: FileBytes,
    /// All tiles of the images.
    tiles: Vec<u8>,
}

impl PageTable {
    /// Takes in the pack at `path` and checks all of its pages. Reads the whole file once.
    pub fn open(path: &Path) -> Result<PageTable, OpenError> {
        let take_in = |mut file: File| {
            let pack = Pack::open(&mut file)?;
            let place = 0..pack.file_bytes;
            PageTable::take_in(pack, &mut file, place)
        };
        let opened = File::open(path).map_err(PackError::from).and_then(take_in);
        opened.map_err(|source| OpenError { path: path.to_owned(), source })
    }

    /// The same for a proxy in the pack at `path`; `None` if it has none of the kind.
    pub fn open_proxy(path: &Path, kind: ProxyKind) -> Result<Option<PageTable>, OpenError> {
        let take_in = |mut file: File| {
            let around = Pack::open(&mut file)?;
            let Some(pack) = around.open_proxy(&mut file, kind)? else { return Ok(None) };
            let (offset, bytes) = around.proxy(kind).expect("it was just opened");
            PageTable::take_in(pack, &mut file, offset..offset + bytes).map(Some).map_err(|e| kind.error(e))
        };
        let opened = File::open(path).map_err(PackError::from).and_then(take_in);
        opened.map_err(|source| OpenError { path: path.to_owned(), source })
    }

    /// Takes in `pack`, which is at `place` in `file`, and checks its pages.
    fn take_in(pack: Pack, file: &mut File, place: Range<u64>) -> Result<PageTable, PackError> {
        let bytes = FileBytes::of(file, place, spare_memory().unwrap_or(0))?;
        if bytes.bytes().len() as u64 != pack.file_bytes {
            return Err(PackError::Corrupt("the file changes while it is read".into()));
        }
        let mut table = PageTable { pack, file: bytes, tiles: Vec::new() };
        table.check_pages()?;
        table.tiles = table.decode_tiles()?;
        Ok(table)
    }

    /// The resident part of the pack.
    pub fn pack(&self) -> &Pack {
        &self.pack
    }

    /// Page `id`.
    ///
    /// # Panics
    /// If there is no such page.
    #[inline]
    pub fn page(&self, id: PageId) -> PageView<'_> {
        PageView::new(self.page_bytes(id)).expect("pages are checked when the pack is opened")
    }

    /// Original triangle ids as stored; empty if none are kept.
    pub fn triangle_ids(&self) -> &[u8] {
        let (offset, bytes) = self.pack.triangle_ids();
        &self.file.bytes()[offset as usize..(offset + bytes) as usize]
    }

    /// The attributes of a page; `None` if it has none.
    pub fn attributes(&self, id: PageId) -> Option<AttributeView<'_>> {
        AttributeView::new(self.part(self.pack.shading.attributes(id)))
    }

    /// A tile of an image.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn tile(&self, tile: u64) -> &[u8] {
        &self.tiles[tile as usize * TILE_BYTES..][..TILE_BYTES]
    }

    fn part(&self, place: Range<u64>) -> &[u8] {
        &self.file.bytes()[place.start as usize..place.end as usize]
    }

    #[inline]
    fn page_bytes(&self, id: PageId) -> &[u8] {
        let entry = &self.pack.directory[id as usize];
        &self.file.bytes()[entry.offset as usize..entry.offset as usize + entry.bytes as usize]
    }

    /// Checks every page, and reports the first that is damaged.
    fn check_pages(&self) -> Result<(), PackError> {
        let manifest = &self.pack.manifest;
        let check = |(id, entry): (usize, &_)| {
            let id = id as PageId;
            let geometries = manifest.scene.geometries.len();
            check_page(self.page_bytes(id), id, entry, geometries, manifest.depth as usize).err()
        };
        let first_error =
            self.pack.directory.par_iter().enumerate().filter_map(check).min_by_key(|e| match e {
                PackError::CorruptPage { page, .. } => *page,
                _ => 0,
            });
        first_error.map_or(Ok(()), Err)?;
        self.check_attributes()?;
        self.pack.check_triangle_ids(self.triangle_ids())
    }

    fn check_attributes(&self) -> Result<(), PackError> {
        let shading = &self.pack.shading;
        let check_page = |(id, entry): (usize, &PageEntry)| {
            let place = shading.attributes(id as PageId);
            shading.check_attributes(self.part(place), id as PageId, entry.triangle_count)
        };
        self.pack.directory.par_iter().enumerate().try_for_each(check_page)
    }

    fn decode_tiles(&self) -> Result<Vec<u8>, PackError> {
        let shading = &self.pack.shading;
        let mut tiles = vec![0; shading.tile_bytes() as usize];
        let decode = |(number, tile): (usize, &mut [u8])| -> Result<(), PackError> {
            let number = number as u64;
            tile.copy_from_slice(&shading.decode_tile(self.part(shading.tile(number)), number)?);
            Ok(())
        };
        tiles.par_chunks_mut(TILE_BYTES).enumerate().try_for_each(decode)?;
        Ok(tiles)
    }
}
