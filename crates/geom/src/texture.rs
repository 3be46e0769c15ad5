//! Pictures on surfaces: which image, where it lies on the surface, and how its texels lie in a pack.
//!
//! An image is kept as a pyramid, each level half as wide and high as the one before, down to one texel. Levels are cut into
//! tiles of 64 x 64 texels, row by row; all levels that fit into 32 x 32 share the last tile.

use serde::{Deserialize, Serialize};

/// Texels along a side of a tile.
pub const TILE_EXTENT: u32 = 64;
/// Bytes of a texel: red, green, blue, opacity.
pub const TEXEL_BYTES: usize = 4;
/// Bytes of a tile.
pub const TILE_BYTES: usize = (TILE_EXTENT * TILE_EXTENT) as usize * TEXEL_BYTES;
/// Levels up to this size share a tile: 32 + 16 + 8 + 4 + 2 + 1 texels beside each other are less than its width.
const SMALL_EXTENT: u32 = TILE_EXTENT / 2;
/// Most texels along a side of an image.
pub const MAX_IMAGE_EXTENT: u32 = 1 << 16;

/// The light, 0 to 1, that sRGB (IEC 61966-2-1) codes as `x`, 0 to 1.
pub fn light_of_srgb(x: f64) -> f64 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// An image of a pack.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Image {
    /// Name in the file, for reports; may be empty.
    pub name: String,
    /// Texels in a row; 0 if the image could not be read.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Colors are coded as sRGB codes them; opacity never is.
    pub is_srgb: bool,
    /// The first of its tiles among those of the pack.
    pub first_tile: u64,
}

/// How an image goes on beyond its borders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Wrap {
    /// Again and again.
    #[default]
    Repeat,
    /// The same, every other time mirrored.
    Mirror,
    /// With its last texels.
    Clamp,
}

/// An image as it lies on surfaces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Texture {
    /// Index into [`SceneDesc::images`](crate::scene::SceneDesc::images).
    pub image: u32,
    /// Which texture coordinates: 0 or 1.
    pub tex_coord: u8,
    /// From texture coordinates to the image, whose first texel is at (0, 0) and whose last one is at (1, 1): two rows, of
    /// which each gives a coordinate as `a u + b v + c`.
    pub transform: [[f32; 3]; 2],
    /// Beyond the borders, along each axis.
    pub wrap: [Wrap; 2],
    /// The nearest texel, where else texels around are blended.
    pub is_nearest: bool,
}

impl Default for Texture {
    fn default() -> Texture {
        Texture {
            image: 0,
            tex_coord: 0,
            transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            wrap: [Wrap::Repeat; 2],
            is_nearest: false,
        }
    }
}

/// A level of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// First tile, counted from the image's first.
    first_tile: u64,
    /// Column of the tile at which the level begins.
    begin: u32,
}

impl Level {
    /// Where texel (x, y) is: the tile, counted from the image's first, and the place of the texel in it.
    #[inline]
    pub fn place(&self, x: u32, y: u32) -> (u64, usize) {
        let across = u64::from(self.width.div_ceil(TILE_EXTENT));
        let tile = self.first_tile + u64::from(y / TILE_EXTENT) * across + u64::from(x / TILE_EXTENT);
        (tile, (y % TILE_EXTENT * TILE_EXTENT + self.begin + x % TILE_EXTENT) as usize)
    }

    /// Tiles of a level alone.
    fn tiles(&self) -> u64 {
        u64::from(self.width.div_ceil(TILE_EXTENT)) * u64::from(self.height.div_ceil(TILE_EXTENT))
    }
}

/// The levels of an image, the finest first.
pub fn levels(width: u32, height: u32) -> impl Iterator<Item = Level> {
    let is_small = |width: u32, height: u32| width.max(height) <= SMALL_EXTENT;
    let first = Level { width, height, first_tile: 0, begin: 0 };
    std::iter::successors((width > 0 && height > 0).then_some(first), move |level| {
        if level.width == 1 && level.height == 1 {
            return None;
        }
        let (width, height) = ((level.width / 2).max(1), (level.height / 2).max(1));
        let goes_on = is_small(level.width, level.height);
        Some(Level {
            width,
            height,
            first_tile: level.first_tile + if goes_on { 0 } else { level.tiles() },
            // Of long thin levels the height may be more than the width.
            begin: if goes_on { level.begin + level.width.max(level.height) } else { 0 },
        })
    })
}

/// Tiles of an image.
pub fn tile_count(width: u32, height: u32) -> u64 {
    levels(width, height).last().map_or(0, |last| last.first_tile + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn no_two_texels_have_the_same_place() {
        for (width, height) in [(1, 1), (32, 32), (33, 7), (64, 64), (1, 200), (130, 65), (32, 3), (5, 32)] {
            let mut seen = HashSet::new();
            let all: Vec<Level> = levels(width, height).collect();
            assert_eq!((all[0].width, all[0].height), (width, height));
            let last = all[all.len() - 1];
            assert_eq!((last.width, last.height), (1, 1));
            for level in all {
                for (x, y) in (0..level.height).flat_map(|y| (0..level.width).map(move |x| (x, y))) {
                    let (tile, texel) = level.place(x, y);
                    assert!(tile < tile_count(width, height) && texel < TILE_BYTES / TEXEL_BYTES);
                    assert!(seen.insert((tile, texel)), "{width}x{height}: {level:?} {x} {y}");
                }
            }
        }
        assert_eq!((tile_count(0, 5), tile_count(64, 64), tile_count(65, 64)), (0, 2, 3));
    }
}
