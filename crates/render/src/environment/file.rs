//! Reads environments: Radiance `.hdr` (RGBE) and OpenEXR with the channels R, G and B.
//!
//! The size is read alone first, so that whoever has a budget can refuse it before anything is allocated.

use super::Environment;
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers};
use image::{ImageDecoder, codecs::hdr::HdrDecoder};
use std::{
    fs::File,
    io::{BufReader, Read},
    path::{Path, PathBuf},
};
use thiserror::Error;

/// Most pixels of an environment.
pub const MAX_ENVIRONMENT_PIXELS: u64 = 64 << 20;

/// The header of a `.hdr` file is within so many bytes.
const MOST_HEADER_BYTES: u64 = 64 << 10;

/// A pixel of a `.hdr` file takes at least a part of a byte: runs of 127 in each of four channels take two bytes.
const MOST_PIXELS_A_BYTE: u64 = 16;

/// Blocks of an EXR file that are in memory at once: as read, unpacked, and between the steps of that.
const BLOCKS: u64 = 4;

/// A picture that has been looked at but not read.
#[derive(Clone, Debug)]
pub struct EnvironmentFile {
    path: PathBuf,
    format: Format,
    width: usize,
    height: usize,
    /// For reading.
    block_bytes: u64,
}

/// What is known before pixels are read.
struct Header {
    width: u64,
    height: u64,
    block_bytes: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Hdr,
    Exr,
}

/// Why there is no environment.
#[derive(Debug, Error)]
#[error("{}: {problem}", path.display())]
pub struct EnvironmentError {
    path: PathBuf,
    problem: String,
}

impl EnvironmentFile {
    /// Looks at the header of a file, whose format its ending tells.
    ///
    /// # Errors
    /// Where the file cannot be read, is none of its format, or has too many pixels or none.
    pub fn open(path: &Path) -> Result<EnvironmentFile, EnvironmentError> {
        let problem = |problem| EnvironmentError { path: path.into(), problem };
        let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        let format = match ending.as_deref() {
            Some("hdr" | "pic") => Format::Hdr,
            Some("exr") => Format::Exr,
            _ => return Err(problem("an environment's name must end in .hdr or .exr".into())),
        };
        let file = File::open(path).map_err(|error| problem(error.to_string()))?;
        let header = match format {
            Format::Hdr => look_at_hdr(&file),
            Format::Exr => look_at_exr(&file),
        };
        let Header { width, height, block_bytes } = header.map_err(problem)?;
        let pixels = width.saturating_mul(height);
        if pixels == 0 || pixels > MAX_ENVIRONMENT_PIXELS {
            let most = MAX_ENVIRONMENT_PIXELS >> 20;
            return Err(problem(format!(
                "has {width}x{height} pixels; an environment has 1 to {most} million; scale it down"
            )));
        }
        Ok(EnvironmentFile {
            path: path.into(),
            format,
            width: width as usize,
            height: height as usize,
            block_bytes,
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Most bytes of memory that it takes to read it and to have it.
    pub fn bytes(&self) -> u64 {
        Environment::bytes_of(self.width, self.height).saturating_add(self.block_bytes)
    }

    /// Reads the pixels.
    ///
    /// # Errors
    /// Where the file is damaged.
    pub fn read(&self) -> Result<Environment, EnvironmentError> {
        let file = File::open(&self.path).map_err(|error| error.to_string());
        let texels = file.and_then(|file| match self.format {
            Format::Hdr => self.read_hdr(file),
            Format::Exr => self.read_exr(file),
        });
        match texels {
            Ok(texels) => Ok(Environment::new(self.width, self.height, texels)),
            Err(problem) => Err(EnvironmentError { path: self.path.clone(), problem }),
        }
    }

    fn read_hdr(&self, file: File) -> Result<Vec<[f32; 3]>, String> {
        let decoder = HdrDecoder::new_nonstrict(BufReader::new(file)).map_err(|error| error.to_string())?;
        self.check_size(decoder.dimensions())?;
        let mut texels = vec![[0.0; 3]; self.width * self.height];
        let read = decoder.read_image(bytemuck::cast_slice_mut(&mut texels));
        read.map_err(|error| error.to_string())?;
        Ok(texels)
    }

    fn read_exr(&self, file: File) -> Result<Vec<[f32; 3]>, String> {
        let (width, height) = (self.width, self.height);
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                move |_, _| vec![[0.0; 3]; width * height],
                move |texels: &mut Vec<[f32; 3]>, at, (r, g, b): (f32, f32, f32)| {
                    if let Some(texel) = texels.get_mut(at.y() * width + at.x()) {
                        *texel = [r, g, b];
                    }
                },
            )
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(BufReader::new(file))
            .map_err(|error| error.to_string())?;
        let size = image.layer_data.size;
        self.check_size((size.width() as u32, size.height() as u32))?;
        Ok(image.layer_data.channel_data.pixels)
    }

    /// Refuses a file that has become another one since it was looked at.
    fn check_size(&self, found: (u32, u32)) -> Result<(), String> {
        match found == (self.width as u32, self.height as u32) {
            true => Ok(()),
            false => Err("was changed while it was read; try again".into()),
        }
    }
}

fn look_at_hdr(file: &File) -> Result<Header, String> {
    let file_bytes = file.metadata().map_err(|error| error.to_string())?.len();
    let mut head = Vec::new();
    file.take(MOST_HEADER_BYTES).read_to_end(&mut head).map_err(|error| error.to_string())?;
    if !head.starts_with(b"#?") {
        return Err("is no Radiance file: it does not begin with #?".into());
    }
    let decoder = HdrDecoder::new_nonstrict(&head[..]).map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (u64::from(width), u64::from(height));
    if width * height > file_bytes.saturating_mul(MOST_PIXELS_A_BYTE) {
        return Err(format!("is cut off: {width}x{height} pixels do not fit into {file_bytes} bytes"));
    }
    Ok(Header { width, height, block_bytes: 4 * width })
}

fn look_at_exr(file: &File) -> Result<Header, String> {
    let meta =
        MetaData::read_from_buffered(BufReader::new(file), false).map_err(|error| error.to_string())?;
    let has_rgb = |header: &&exr::meta::header::Header| {
        let names = header.channels.list.iter().map(|channel| channel.name.to_string());
        !header.deep && names.filter(|name| ["R", "G", "B"].contains(&name.as_str())).count() == 3
    };
    let header = meta.headers.iter().find(has_rgb).ok_or("has no layer with the channels R, G and B")?;
    let largest = meta.headers.iter().map(|header| header.max_block_byte_size() as u64).max();
    let size = header.layer_size;
    let block_bytes = largest.unwrap_or(0).saturating_mul(BLOCKS);
    Ok(Header { width: size.width() as u64, height: size.height() as u64, block_bytes })
}
