//! Where a pack keeps what shading needs and tracing does not: attributes of vertices, tiles of images.

use crate::PackError;
use crate::attributes::check_attributes;
use crate::layout::{BlockEntry, PageId, Section};
use crate::sections::Sections;
use crate::tile_code;
use raystrips_geom::scene::SceneDesc;
use raystrips_geom::texture::{Image, MAX_IMAGE_EXTENT, TILE_BYTES, tile_count};
use std::io::{Read, Seek};
use std::ops::Range;

/// Places of blocks in the file.
///
/// Memory: 16 bytes for each page, if any has attributes, and for each tile.
#[derive(Clone, Debug, Default)]
pub struct Shading {
    /// By page.
    attributes: Blocks,
    tiles: Blocks,
}

/// Blocks that follow each other in a section.
#[derive(Clone, Debug, Default)]
struct Blocks {
    entries: Vec<BlockEntry>,
    offsets: Vec<u64>,
}

impl Blocks {
    fn open<F: Read + Seek>(
        sections: &mut Sections<F>,
        directory: Section,
        blocks: Section,
    ) -> Result<Blocks, PackError> {
        let entries: Vec<BlockEntry> = sections.optional_array(directory)?;
        let place = sections.optional_entry(blocks)?;
        let (begin, length) = place.map_or((0, 0), |entry| (entry.offset, entry.bytes));
        let mut end = begin;
        let mut offset = |entry: &BlockEntry| {
            let offset = end;
            end += u64::from(entry.bytes);
            offset
        };
        let offsets = entries.iter().map(&mut offset).collect();
        if end - begin != length {
            return Err(PackError::corrupt(format!("{blocks:?} section: not as long as its directory says")));
        }
        Ok(Blocks { entries, offsets })
    }

    fn place(&self, number: usize) -> Range<u64> {
        let Some(entry) = self.entries.get(number) else { return 0..0 };
        let begin = self.offsets[number];
        begin..begin + u64::from(entry.bytes)
    }

    fn resident_bytes(&self) -> u64 {
        (size_of_val(&self.entries[..]) + size_of_val(&self.offsets[..])) as u64
    }

    fn lengths(&self) -> impl Iterator<Item = u64> {
        self.entries.iter().map(|entry| u64::from(entry.bytes))
    }
}

impl Shading {
    /// Reads the directories, for a pack of so many pages.
    pub(crate) fn open<F: Read + Seek>(
        sections: &mut Sections<F>,
        pages: usize,
    ) -> Result<Shading, PackError> {
        let attributes = Blocks::open(sections, Section::AttributeDirectory, Section::Attributes)?;
        let tiles = Blocks::open(sections, Section::TileDirectory, Section::Tiles)?;
        match attributes.entries.len() {
            0 => {}
            count if count == pages => {}
            _ => return Err(PackError::corrupt("attributes of another number of pages")),
        }
        Ok(Shading { attributes, tiles })
    }

    /// Checks that images are of tiles that there are, and materials of textures of images.
    pub(crate) fn check(&self, scene: &SceneDesc) -> Result<(), PackError> {
        let has_tiles = |image: &Image| {
            let is_sized = image.width.max(image.height) <= MAX_IMAGE_EXTENT;
            let end = is_sized.then(|| image.first_tile.checked_add(tile_count(image.width, image.height)));
            end.flatten().is_some_and(|end| end <= self.tile_count())
        };
        // Packs of proxies have the scene, but not its images.
        if self.tile_count() > 0 && !scene.images.iter().all(has_tiles) {
            return Err(PackError::corrupt("an image lies beyond the tiles"));
        }
        let is_there = |texture: u32| scene.textures.get(texture as usize).is_some();
        let mut named = scene.materials.iter().flat_map(|material| material.textures.all());
        let has_image = |t: &raystrips_geom::texture::Texture| {
            (t.image as usize) < scene.images.len() && t.tex_coord <= 1
        };
        match named.all(is_there) && scene.textures.iter().all(has_image) {
            true => Ok(()),
            false => Err(PackError::corrupt("a texture or an image that is named is not there")),
        }
    }

    /// True if there are neither attributes nor tiles.
    pub fn is_empty(&self) -> bool {
        self.attributes.entries.is_empty() && self.tiles.entries.is_empty()
    }

    /// Bytes of all attributes and tiles in memory.
    pub fn bytes(&self) -> u64 {
        self.attributes.lengths().sum::<u64>() + self.tile_bytes()
    }

    /// Bytes of all tiles in memory.
    pub fn tile_bytes(&self) -> u64 {
        self.tile_count() * TILE_BYTES as u64
    }

    /// Bytes in memory of the longest block of attributes, or of a tile.
    pub fn most_block_bytes(&self) -> u64 {
        let tile = if self.tile_count() > 0 { TILE_BYTES as u64 } else { 0 };
        self.attributes.lengths().fold(tile, u64::max)
    }

    /// Bytes of memory of the directories.
    pub(crate) fn resident_bytes(&self) -> u64 {
        self.attributes.resident_bytes() + self.tiles.resident_bytes()
    }

    /// Where the attributes of a page are in the file; empty if it has none.
    pub fn attributes(&self, page: PageId) -> Range<u64> {
        self.attributes.place(page as usize)
    }

    /// Checks the bytes at [`Shading::attributes`] of a page with so many triangles.
    ///
    /// # Errors
    /// If they are damaged.
    pub fn check_attributes(&self, bytes: &[u8], page: PageId, triangles: u32) -> Result<(), PackError> {
        if bytes.is_empty() {
            return Ok(());
        }
        if BlockEntry::of(bytes) != self.attributes.entries[page as usize] {
            let what = "attributes: their checksum does not match".into();
            return Err(PackError::CorruptPage { page, what });
        }
        check_attributes(bytes, page, triangles)
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> u64 {
        self.tiles.entries.len() as u64
    }

    /// Where the code of a tile is in the file.
    pub fn tile(&self, tile: u64) -> Range<u64> {
        self.tiles.place(tile as usize)
    }

    /// The tile whose code is the bytes at [`Shading::tile`].
    ///
    /// # Errors
    /// If they are damaged.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn decode_tile(&self, bytes: &[u8], tile: u64) -> Result<Vec<u8>, PackError> {
        match BlockEntry::of(bytes) == self.tiles.entries[tile as usize] {
            true => tile_code::decode(bytes),
            false => {
                Err(PackError::corrupt(format!("tile {tile} of the images: its checksum does not match")))
            }
        }
    }
}
