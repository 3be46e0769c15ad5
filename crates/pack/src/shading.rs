//! Where a pack keeps what shading needs and tracing does not: attributes of vertices, tiles of images.

use crate::PackError;
use crate::layout::{AttributeEntry, PageId, Section};
use crate::sections::Sections;
use raystrips_geom::scene::SceneDesc;
use raystrips_geom::texture::{MAX_IMAGE_EXTENT, TILE_BYTES, tile_count};
use std::io::{Read, Seek};
use std::ops::Range;

/// Places of blocks in the file.
///
/// Memory: 16 bytes a page with attributes, 4 a tile.
#[derive(Clone, Debug, Default)]
pub struct Shading {
    attributes: Vec<AttributeEntry>,
    /// Where the block of each page begins.
    attribute_offsets: Vec<u64>,
    tiles_offset: u64,
    tile_checksums: Vec<u32>,
}

impl Shading {
    /// Reads the directories, for a pack of so many pages.
    pub(crate) fn open<F: Read + Seek>(
        sections: &mut Sections<F>,
        pages: usize,
    ) -> Result<Shading, PackError> {
        let wrong = |what: &str| Err(PackError::corrupt(what));
        let attributes: Vec<AttributeEntry> = sections.optional_array(Section::AttributeDirectory)?;
        if !attributes.is_empty() && attributes.len() != pages {
            return wrong("attributes of another number of pages");
        }
        let blocks = sections.optional_entry(Section::Attributes)?;
        let (begin, length) = blocks.map_or((0, 0), |entry| (entry.offset, entry.bytes));
        let attribute_offsets: Vec<u64> = attributes
            .iter()
            .scan(begin, |next, entry| {
                let offset = *next;
                *next += u64::from(entry.bytes);
                Some(offset)
            })
            .collect();
        if attributes.iter().map(|entry| u64::from(entry.bytes)).sum::<u64>() != length {
            return wrong("attributes are not as long as their directory says");
        }
        let tile_checksums: Vec<u32> = sections.optional_array(Section::TileChecksums)?;
        let tiles = sections.optional_entry(Section::Tiles)?;
        let (tiles_offset, tile_bytes) = tiles.map_or((0, 0), |entry| (entry.offset, entry.bytes));
        if Some(tile_bytes) != (tile_checksums.len() as u64).checked_mul(TILE_BYTES as u64) {
            return wrong("tiles are not as many as their checksums");
        }
        Ok(Shading { attributes, attribute_offsets, tiles_offset, tile_checksums })
    }

    /// Checks that images are of tiles that there are, and materials of textures of images.
    pub(crate) fn check(&self, scene: &SceneDesc) -> Result<(), PackError> {
        let has_tiles = |image: &raystrips_geom::texture::Image| {
            let is_sized = image.width <= MAX_IMAGE_EXTENT && image.height <= MAX_IMAGE_EXTENT;
            let end = image.first_tile.checked_add(tile_count(image.width, image.height));
            is_sized && end.is_some_and(|end| end <= self.tile_checksums.len() as u64)
        };
        // Packs of proxies have the scene, but not its images.
        if !self.tile_checksums.is_empty() && !scene.images.iter().all(has_tiles) {
            return Err(PackError::corrupt("an image lies beyond the tiles"));
        }
        let is_there = |texture: u32| scene.textures.get(texture as usize).is_some();
        let mut named = scene.materials.iter().flat_map(|material| material.textures.all());
        if !named.all(is_there)
            || scene.textures.iter().any(|t| t.image as usize >= scene.images.len() || t.tex_coord > 1)
        {
            return Err(PackError::corrupt("a texture or an image that is named is not there"));
        }
        Ok(())
    }

    /// True if there are neither attributes nor tiles.
    pub fn is_empty(&self) -> bool {
        self.attributes.is_empty() && self.tile_checksums.is_empty()
    }

    /// Bytes of all attributes and tiles.
    pub fn bytes(&self) -> u64 {
        let attributes = self.attributes.iter().map(|entry| u64::from(entry.bytes)).sum::<u64>();
        attributes + self.tile_checksums.len() as u64 * TILE_BYTES as u64
    }

    /// Bytes of the longest block or tile.
    pub fn most_block_bytes(&self) -> u64 {
        let tile = if self.tile_checksums.is_empty() { 0 } else { TILE_BYTES as u64 };
        self.attributes.iter().map(|entry| u64::from(entry.bytes)).fold(tile, u64::max)
    }

    /// Bytes of memory of the directories.
    pub(crate) fn resident_bytes(&self) -> u64 {
        (size_of_val(&self.attributes[..])
            + size_of_val(&self.attribute_offsets[..])
            + size_of_val(&self.tile_checksums[..])) as u64
    }

    /// Where the attributes of a page are in the file; empty if it has none.
    pub fn attributes(&self, page: PageId) -> Range<u64> {
        let Some(entry) = self.attributes.get(page as usize) else { return 0..0 };
        let begin = self.attribute_offsets[page as usize];
        begin..begin + u64::from(entry.bytes)
    }

    /// Checks the bytes at [`Shading::attributes`] of a page with so many triangles.
    ///
    /// # Errors
    /// If they are damaged.
    pub fn check_attributes(&self, bytes: &[u8], page: PageId, triangles: u32) -> Result<(), PackError> {
        if bytes.is_empty() {
            return Ok(());
        }
        if crc32c::crc32c(bytes) != self.attributes[page as usize].checksum {
            let what = "attributes: their checksum does not match".into();
            return Err(PackError::CorruptPage { page, what });
        }
        crate::attributes::check_attributes(bytes, page, triangles)
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> u64 {
        self.tile_checksums.len() as u64
    }

    /// Where a tile is in the file.
    pub fn tile(&self, tile: u64) -> Range<u64> {
        let begin = self.tiles_offset + tile * TILE_BYTES as u64;
        begin..begin + TILE_BYTES as u64
    }

    /// The checksum that belongs to a tile.
    pub fn tile_checksum(bytes: &[u8]) -> u32 {
        crc32c::crc32c(bytes)
    }

    /// Checks the bytes at [`Shading::tile`].
    ///
    /// # Errors
    /// If they are damaged.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn check_tile(&self, bytes: &[u8], tile: u64) -> Result<(), PackError> {
        match Shading::tile_checksum(bytes) == self.tile_checksums[tile as usize] {
            true => Ok(()),
            false => {
                Err(PackError::corrupt(format!("tile {tile} of the images: its checksum does not match")))
            }
        }
    }
}
