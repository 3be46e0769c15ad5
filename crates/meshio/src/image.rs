//! Images of textures: where they are, and what is in them.

use raystrips_geom::scene::SceneDesc;
use raystrips_geom::texture::{Image, MAX_IMAGE_EXTENT, Texture};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::PathBuf;

/// Where an image is, in one of the formats PNG, JPEG, WebP, KTX2 (Basis Universal), BMP and TGA.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ImageSource {
    /// A file.
    File(PathBuf),
    /// A part of a file.
    Part {
        /// The file.
        path: PathBuf,
        /// Where the part begins.
        offset: u64,
        /// Its length.
        bytes: u64,
    },
    /// In the model itself.
    Inline(Vec<u8>),
    /// A file of heights, of which the slopes are wanted, so much steeper than one texel a texel.
    Heights {
        /// The file.
        path: PathBuf,
        /// Bits of the factor.
        scale: u32,
    },
}

/// Texels, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Texels in a row; at least 1.
    pub width: u32,
    /// Rows; at least 1.
    pub height: u32,
    /// Red, green, blue, opacity of each.
    pub rgba: Vec<u8>,
}

/// Begins a KTX2 file.
const KTX2: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

impl ImageSource {
    /// Reads the image, which may take `most_bytes` of memory, the compressed file included.
    ///
    /// # Errors
    /// Why it cannot be read, in words that follow the name of the image.
    pub fn read(&self, most_bytes: u64) -> Result<Pixels, String> {
        let bytes = self.bytes(most_bytes / 2)?;
        let left = most_bytes - bytes.len() as u64;
        let pixels = if bytes.starts_with(KTX2) { ktx2(&bytes, left)? } else { decoded(&bytes, left)? };
        let Pixels { width, height, .. } = pixels;
        if width == 0 || height == 0 || width.max(height) > MAX_IMAGE_EXTENT {
            return Err(format!("has {width} x {height} texels; from 1 to {MAX_IMAGE_EXTENT} are read"));
        }
        match self {
            ImageSource::Heights { scale, .. } => Ok(slopes(pixels, f32::from_bits(*scale))),
            _ => Ok(pixels),
        }
    }

    fn bytes(&self, most_bytes: u64) -> Result<Vec<u8>, String> {
        let (path, offset, bytes) = match self {
            ImageSource::Inline(bytes) => return Ok(bytes.clone()),
            ImageSource::File(path) | ImageSource::Heights { path, .. } => (path, 0, None),
            ImageSource::Part { path, offset, bytes } => (path, *offset, Some(*bytes)),
        };
        let cannot = |e: std::io::Error| format!("cannot be read: {e}");
        let mut file = File::open(path).map_err(cannot)?;
        let length = file.metadata().map_err(cannot)?.len().saturating_sub(offset);
        let wanted = bytes.map_or(length, |bytes| bytes.min(length));
        if wanted > most_bytes {
            return Err(format!(
                "has {wanted} bytes, more than the memory that there is for it; use --memory"
            ));
        }
        let mut contents = Vec::with_capacity(wanted as usize);
        file.seek(SeekFrom::Start(offset)).map_err(cannot)?;
        file.take(wanted).read_to_end(&mut contents).map_err(cannot)?;
        Ok(contents)
    }
}

fn decoded(bytes: &[u8], most_bytes: u64) -> Result<Pixels, String> {
    let mut reader = image::ImageReader::new(Cursor::new(bytes));
    if let Ok(format) = image::guess_format(bytes) {
        reader.set_format(format);
    } else {
        // TGA files do not say what they are.
        reader.set_format(image::ImageFormat::Tga);
    }
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_IMAGE_EXTENT);
    limits.max_image_height = Some(MAX_IMAGE_EXTENT);
    // 8 bits a channel are made of what is decoded.
    limits.max_alloc = Some(most_bytes / 2);
    reader.limits(limits);
    let image =
        reader.decode().map_err(|e| format!("is not read: {}", crate::error::one_line(&e.to_string())))?;
    let image = image.into_rgba8();
    Ok(Pixels { width: image.width(), height: image.height(), rgba: image.into_raw() })
}

fn ktx2(bytes: &[u8], most_bytes: u64) -> Result<Pixels, String> {
    let broken = |e: basisu::Error| {
        format!("is not read: {e:?}; textures in KTX2 must be ETC1S or UASTC of Basis Universal")
    };
    let transcoder = basisu::Transcoder::new(bytes).map_err(broken)?;
    let (width, height) = transcoder.base_dimensions();
    if u64::from(width) * u64::from(height) * 8 > most_bytes {
        return Err(format!("has {width} x {height} texels, more than there is memory for; use --memory"));
    }
    let (format, flags) = (basisu::TargetFormat::Rgba32, basisu::DecodeFlags::NONE);
    let rgba = transcoder.transcode(0, format, flags).map_err(broken)?;
    match rgba.len() as u64 == u64::from(width) * u64::from(height) * 4 {
        true => Ok(Pixels { width, height, rgba }),
        false => Err("is not read: its texels are not as many as it says".into()),
    }
}

/// The slopes of heights, as a normal texture has them. What has such slopes already stays: MTL files name both kinds alike.
fn slopes(heights: Pixels, scale: f32) -> Pixels {
    let count = heights.rgba.len() as u64 / 4;
    let mean =
        |channel: usize| heights.rgba.chunks_exact(4).map(|p| u64::from(p[channel])).sum::<u64>() / count;
    if mean(2) > 200 && mean(0).abs_diff(128) < 32 && mean(1).abs_diff(128) < 32 {
        return heights;
    }
    let Pixels { width, height, rgba } = heights;
    let at = |x: u32, y: u32| f32::from(rgba[4 * (y as usize * width as usize + x as usize)]) / 255.0;
    let mut slopes = Vec::with_capacity(rgba.len());
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let (left, right) = ((x + width - 1) % width, (x + 1) % width);
        let (above, below) = ((y + height - 1) % height, (y + 1) % height);
        // A texel of height a texel is steep: heights of files are some texels high.
        let steps = 0.5 * HEIGHT_TEXELS * scale;
        let normal =
            glam::Vec3::new((at(left, y) - at(right, y)) * steps, (at(x, below) - at(x, above)) * steps, 1.0);
        let code = (normal.normalize() * 0.5 + 0.5) * 255.0;
        slopes.extend(code.to_array().map(|c| c.round() as u8));
        slopes.push(255);
    }
    Pixels { width, height, rgba: slopes }
}

/// Texels that white is higher than black.
const HEIGHT_TEXELS: f32 = 4.0;

/// Images and textures of a scene on its way, each of them once.
#[derive(Default)]
pub(crate) struct Images {
    /// Where the images are, as many as the scene has.
    pub sources: Vec<ImageSource>,
    images: HashMap<(ImageSource, bool), u32>,
}

impl Images {
    /// The number of the texture, which shows the image at `source`.
    pub fn texture(
        &mut self,
        scene: &mut SceneDesc,
        source: ImageSource,
        is_srgb: bool,
        texture: Texture,
    ) -> u32 {
        let key = (source, is_srgb);
        let image = match self.images.get(&key) {
            Some(&image) => image,
            None => {
                let name = match &key.0 {
                    ImageSource::File(path) => path.file_name().unwrap_or_default().to_string_lossy().into(),
                    _ => String::new(),
                };
                scene.images.push(Image { name, is_srgb, ..Image::default() });
                self.sources.push(key.0.clone());
                *self.images.entry(key).or_insert(scene.images.len() as u32 - 1)
            }
        };
        let texture = Texture { image, ..texture };
        let number = scene.textures.iter().position(|known| *known == texture).unwrap_or_else(|| {
            scene.textures.push(texture);
            scene.textures.len() - 1
        });
        number as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let image = image::RgbImage::from_fn(width, height, |x, y| image::Rgb([x as u8, y as u8, 7]));
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn texels_come_in_rows_from_the_top() {
        let pixels = ImageSource::Inline(png(3, 2)).read(1 << 20).unwrap();
        assert_eq!((pixels.width, pixels.height), (3, 2));
        assert_eq!(pixels.rgba[4 * 4..4 * 5], [1, 1, 7, 255]);
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut bytes = b"junk".to_vec();
        bytes.extend(png(3, 2));
        std::fs::write(file.path(), &bytes).unwrap();
        let path = file.path().to_owned();
        let part = ImageSource::Part { path, offset: 4, bytes: bytes.len() as u64 - 4 };
        assert_eq!(part.read(1 << 20).unwrap(), pixels);
    }

    #[test]
    fn slopes_of_heights_and_of_slopes() {
        let rgba = [0, 0, 0, 0, 100, 200, 0, 0].iter().flat_map(|&h| [h, h, h, 255]).collect();
        let heights = Pixels { width: 4, height: 2, rgba };
        let slopes = slopes(heights, 1.0);
        // The upper row is level; the lower one rises to the right at first. Above and below both, the other one is.
        assert_eq!(slopes.rgba[..3], [128, 128, 255]);
        assert!(slopes.rgba[16] < 128 && slopes.rgba[17] == 128);
        assert_eq!(super::slopes(slopes.clone(), 1.0).width, 4);
        let blue = Pixels { width: 1, height: 1, rgba: vec![128, 127, 255, 255] };
        assert_eq!(super::slopes(blue.clone(), 1.0), blue);
    }

    #[test]
    fn what_is_no_image_or_too_large_is_refused() {
        for bytes in [&b""[..], b"junk", KTX2, &png(3, 2)[..40]] {
            assert!(ImageSource::Inline(bytes.to_vec()).read(1 << 20).is_err(), "{bytes:?}");
        }
        let large = ImageSource::Inline(png(300, 300));
        assert!(large.read(1 << 20).is_ok());
        assert!(large.read(200_000).is_err());
        assert!(ImageSource::File("no/such.png".into()).read(1 << 20).unwrap_err().starts_with("cannot"));
    }
}
