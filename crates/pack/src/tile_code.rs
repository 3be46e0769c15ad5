//! Tiles of images as they are in the file: differences of neighbors, deflated.
//!
//! Channel after channel, each texel less the one to its left, or the one above where it is the first of its row. That makes
//! smooth pictures small numbers, and the tile a fifth of its size.

use crate::PackError;
use miniz_oxide::deflate::compress_to_vec;
use miniz_oxide::inflate::decompress_slice_iter_to_slice;
use raystrips_geom::texture::{TEXEL_BYTES, TILE_BYTES, TILE_EXTENT};

const EXTENT: usize = TILE_EXTENT as usize;
/// Of those of deflate: more takes much longer and saves little.
const LEVEL: u8 = 6;

/// The code of a tile.
///
/// # Panics
/// If it does not have [`TILE_BYTES`].
pub fn encode(tile: &[u8]) -> Vec<u8> {
    assert_eq!(tile.len(), TILE_BYTES, "bytes of a tile");
    let mut differences = vec![0; TILE_BYTES];
    for_each_place(|planar, interleaved, before| {
        let before = before.map_or(0, |before| tile[before]);
        differences[planar] = tile[interleaved].wrapping_sub(before);
    });
    compress_to_vec(&differences, LEVEL)
}

/// The tile of a code.
///
/// # Errors
/// If it is no code of a tile.
pub fn decode(code: &[u8]) -> Result<Vec<u8>, PackError> {
    let mut differences = vec![0; TILE_BYTES];
    let length = decompress_slice_iter_to_slice(&mut differences, std::iter::once(code), false, false);
    if length != Ok(TILE_BYTES) {
        return Err(PackError::corrupt("a tile of an image cannot be decoded"));
    }
    let mut tile = vec![0; TILE_BYTES];
    for_each_place(|planar, interleaved, before| {
        let before = before.map_or(0, |before| tile[before]);
        tile[interleaved] = differences[planar].wrapping_add(before);
    });
    Ok(tile)
}

/// Calls `take` with the place of each difference, that of its byte in the tile, and that of the byte before.
fn for_each_place(mut take: impl FnMut(usize, usize, Option<usize>)) {
    const ROW_BYTES: usize = EXTENT * TEXEL_BYTES;
    let mut planar = 0;
    for channel in 0..TEXEL_BYTES {
        for y in 0..EXTENT {
            let begin = y * ROW_BYTES + channel;
            take(planar, begin, begin.checked_sub(ROW_BYTES));
            for x in 1..EXTENT {
                let place = begin + x * TEXEL_BYTES;
                take(planar + x, place, Some(place - TEXEL_BYTES));
            }
            planar += EXTENT;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_come_back() {
        let noise = |i: usize| (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) as u8;
        let gradient = |i: usize| (i / TEXEL_BYTES % EXTENT + i % TEXEL_BYTES) as u8;
        for (texel, most) in [(&noise as &dyn Fn(usize) -> u8, 2 * TILE_BYTES), (&gradient, 400)] {
            let tile: Vec<u8> = (0..TILE_BYTES).map(texel).collect();
            let code = encode(&tile);
            assert!(code.len() <= most, "{}", code.len());
            assert!(decode(&code).unwrap() == tile);
            // Cut off, or with something behind.
            assert!((0..code.len()).step_by(1 + code.len() / 64).all(|end| decode(&code[..end]).is_err()));
        }
    }

    #[test]
    fn what_gives_too_much_or_too_little_is_refused() {
        for bytes in [0, 1, TILE_BYTES - 1, TILE_BYTES + 1, 10 * TILE_BYTES] {
            assert!(decode(&compress_to_vec(&vec![7; bytes], LEVEL)).is_err(), "{bytes}");
        }
        assert!(decode(&[]).is_err() && decode(&[0xFF; 64]).is_err());
    }
}
