//! Images to tiles of the pack: one after the other, each with all its levels.

use crate::ConvertError;
use rayon::prelude::*;
use raystrips_geom::scene::SceneDesc;
use raystrips_geom::texture::{Level, TEXEL_BYTES, TILE_BYTES, levels, light_of_srgb, tile_count};
use raystrips_meshio::{ImageSource, Pixels};
use raystrips_pack::{BlockEntry, tile_code};
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};

/// Texels of a tile.
type Tile = [u8; TILE_BYTES];

/// Least memory for an image and its levels.
const LEAST_BYTES: u64 = 64 << 20;

/// Tiles of all images of a scene.
pub(crate) struct Tiles {
    /// Their codes, one after the other.
    pub file: File,
    pub entries: Vec<BlockEntry>,
}

impl Tiles {
    /// Reads the images at `sources`, which are those of the scene, into a file of tiles, and tells the scene where they are.
    /// One that cannot be read is told of in `warnings`, and materials lose its textures. `most_bytes` of memory are for one
    /// image.
    pub fn make(
        sources: &[ImageSource],
        scene: &mut SceneDesc,
        mut file: File,
        most_bytes: u64,
        warnings: &mut Vec<String>,
    ) -> Result<Tiles, ConvertError> {
        let mut entries = Vec::new();
        let mut lost = vec![false; scene.images.len()];
        let mut out = BufWriter::new(&mut file);
        for (i, (source, image)) in sources.iter().zip(&mut scene.images).enumerate() {
            // The texels, those of the next level, and a row of tiles.
            let pixels = match source.read(most_bytes.max(LEAST_BYTES) / 2) {
                Ok(pixels) => pixels,
                Err(what) => {
                    let name = if image.name.is_empty() { format!("image {i}") } else { image.name.clone() };
                    warnings.push(format!("{name} {what}; materials are without it"));
                    lost[i] = true;
                    continue;
                }
            };
            (image.width, image.height) = (pixels.width, pixels.height);
            image.first_tile = entries.len() as u64;
            let mut write = |tiles: &[Tile]| {
                let codes: Vec<Vec<u8>> = tiles.par_iter().map(|tile| tile_code::encode(tile)).collect();
                entries.extend(codes.iter().map(|code| BlockEntry::of(code)));
                codes.iter().try_for_each(|code| out.write_all(code))
            };
            write_image(pixels, image.is_srgb, &mut write).map_err(ConvertError::Scratch)?;
        }
        let is_lost = |texture: u32| lost[scene.textures[texture as usize].image as usize];
        scene.materials.iter_mut().for_each(|material| material.drop_textures(is_lost));
        out.flush().map_err(ConvertError::Scratch)?;
        drop(out);
        file.rewind().map_err(ConvertError::Scratch)?;
        Ok(Tiles { file, entries })
    }
}

/// Writes the tiles of an image, level by level.
fn write_image(
    mut pixels: Pixels,
    is_srgb: bool,
    write: &mut impl FnMut(&[Tile]) -> io::Result<()>,
) -> io::Result<()> {
    let linear = Transfer::new(is_srgb);
    let count = tile_count(pixels.width, pixels.height);
    let mut written = 0;
    let mut tiles: Vec<Tile> = Vec::new();
    let mut all = levels(pixels.width, pixels.height).peekable();
    while let Some(level) = all.next() {
        for y in 0..level.height {
            for x in 0..level.width {
                let (tile, texel) = level.place(x, y);
                let place = (tile - written) as usize;
                if tiles.len() <= place {
                    tiles.resize(place + 1, [0; TILE_BYTES]);
                }
                tiles[place][texel * TEXEL_BYTES..][..TEXEL_BYTES].copy_from_slice(texel_of(&pixels, x, y));
            }
            // A row of tiles is whole; small levels share one, which is written at the end.
            let is_last_row = all.peek().is_none() && y + 1 == level.height;
            let next =
                if y + 1 < level.height { Some((level, y + 1)) } else { all.peek().map(|&next| (next, 0)) };
            let next_tile = next.map_or(count, |(level, y)| level.place(0, y).0);
            if next_tile - written >= tiles.len() as u64 || is_last_row {
                write(&tiles)?;
                written += tiles.len() as u64;
                tiles.clear();
            }
        }
        if let Some(&next) = all.peek() {
            pixels = halved(&pixels, next, &linear);
        }
    }
    Ok(())
}

fn texel_of(pixels: &Pixels, x: u32, y: u32) -> &[u8] {
    let place = y as usize * pixels.width as usize + x as usize;
    &pixels.rgba[place * TEXEL_BYTES..][..TEXEL_BYTES]
}

/// The next level: means of the texels that each of its texels covers, of light where colors are coded as sRGB.
fn halved(pixels: &Pixels, level: Level, transfer: &Transfer) -> Pixels {
    let across = covered(pixels.width, level.width);
    let down = covered(pixels.height, level.height);
    let mut rgba = Vec::with_capacity(level.width as usize * level.height as usize * TEXEL_BYTES);
    for (y, dy) in &down {
        for (x, dx) in &across {
            let mut sums = [0.0f32; TEXEL_BYTES];
            for (j, wy) in (*y..).zip(dy) {
                for (i, wx) in (*x..).zip(dx) {
                    let texel = texel_of(pixels, i, j);
                    for (channel, sum) in sums.iter_mut().enumerate() {
                        *sum += transfer.decode(channel, texel[channel]) * (wx * wy);
                    }
                }
            }
            rgba.extend((0..TEXEL_BYTES).map(|channel| transfer.encode(channel, sums[channel])));
        }
    }
    Pixels { width: level.width, height: level.height, rgba }
}

/// For each of `to` texels the first of `from` that it covers, and the share that it, and each after it, has in the mean.
fn covered(from: u32, to: u32) -> Vec<(u32, Vec<f32>)> {
    let width = f64::from(from) / f64::from(to);
    let of = |i: u32| {
        let (begin, end) = (f64::from(i) * width, (f64::from(i) + 1.0) * width);
        let first = begin.floor() as u32;
        let last = ((end - 1e-9).ceil() as u32).min(from);
        let share = |j: u32| (f64::from(j + 1).min(end) - f64::from(j).max(begin)) / width;
        (first, (first..last).map(|j| share(j) as f32).collect())
    };
    (0..to).map(of).collect()
}

/// How channels are coded.
struct Transfer {
    is_srgb: bool,
    linear: [f32; 256],
}

impl Transfer {
    fn new(is_srgb: bool) -> Transfer {
        let decode = |code: usize| light_of_srgb(code as f64 / 255.0) as f32;
        Transfer { is_srgb, linear: std::array::from_fn(decode) }
    }

    fn decode(&self, channel: usize, code: u8) -> f32 {
        if self.is_srgb && channel < 3 { self.linear[usize::from(code)] } else { f32::from(code) / 255.0 }
    }

    fn encode(&self, channel: usize, x: f32) -> u8 {
        if !(self.is_srgb && channel < 3) {
            return (x * 255.0 + 0.5) as u8;
        }
        // The code whose light is the nearest.
        let above = self.linear.partition_point(|&light| light < x).min(255);
        let below = above.saturating_sub(1);
        if x - self.linear[below] < self.linear[above] - x { below as u8 } else { above as u8 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texel_of_every_level_is_where_it_belongs() {
        for (width, height) in [(1, 1), (64, 64), (100, 70), (200, 3), (31, 31)] {
            let texel = |x: u32, y: u32| [x as u8, y as u8, 200, 255];
            let rgba = (0..height).flat_map(|y| (0..width).flat_map(move |x| texel(x, y))).collect();
            let mut tiles: Vec<Tile> = Vec::new();
            let mut write = |row: &[Tile]| {
                tiles.extend(row);
                Ok(())
            };
            write_image(Pixels { width, height, rgba }, false, &mut write).unwrap();
            assert_eq!(tiles.len() as u64, tile_count(width, height), "{width}x{height}");
            let all: Vec<Level> = levels(width, height).collect();
            let at = |level: &Level, x, y| {
                let (tile, place) = level.place(x, y);
                tiles[tile as usize][place * TEXEL_BYTES..][..TEXEL_BYTES].to_vec()
            };
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                assert_eq!(at(&all[0], x, y), texel(x, y));
            }
            let mean = at(&all[all.len() - 1], 0, 0);
            let expected = [(width - 1) as f32 / 2.0, (height - 1) as f32 / 2.0];
            for (code, expected) in mean.iter().zip(expected) {
                assert!((f32::from(*code) - expected).abs() < 3.0, "{width}x{height}: {mean:?}");
            }
            assert_eq!(mean[2..], [200, 255]);
        }
    }

    #[test]
    fn light_is_averaged_and_not_its_code() {
        let rgba = [[0, 0, 0, 0], [255, 255, 255, 255]].concat();
        let level = levels(2, 1).nth(1).unwrap();
        let half = |is_srgb| {
            halved(&Pixels { width: 2, height: 1, rgba: rgba.clone() }, level, &Transfer::new(is_srgb)).rgba
        };
        assert_eq!((half(false), half(true)), (vec![128; 4], vec![188, 188, 188, 128]));
        let transfer = Transfer::new(true);
        assert!((0..=255).all(|code| transfer.encode(0, transfer.decode(0, code)) == code));
    }
}
