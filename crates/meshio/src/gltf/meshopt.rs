//! Compressed views: `EXT_meshopt_compression` and `KHR_meshopt_compression`, which adds a filter and a version of the
//! codec of attributes. Both are read alike. Views are decoded a piece at a time, so that their size costs no memory.

use super::decoded::Writer;
use super::syntax;
use crate::{ImportError, Result};
use gltf::json::buffer::View;
use meshoptimizer_rs::codec::{
    IndexBufferDecoder, IndexSequenceDecoder, Progress, Status, VertexBufferDecoder, decode_filter_color,
    decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_vertex_version,
};
use meshoptimizer_rs::{Error, Limits, Workspace};
use serde::Deserialize;
use std::path::Path;

/// Newest first: where a view has both, they say the same.
const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];
/// Elements that are decoded at a time; an element has up to 256 bytes.
const ELEMENTS: usize = 1 << 12;
/// Sizes are bounded where they are used: what a decoder here takes does not depend on the file.
const LIMITS: Limits = Limits { max_bytes: usize::MAX, max_work: u64::MAX };

/// A compressed view.
pub(super) struct Compressed<'p> {
    path: &'p Path,
    /// Its place in the document.
    at: String,
    extension: Extension,
    mode: Mode,
    filter: Filter,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Extension {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: usize,
    count: usize,
    mode: String,
    filter: Option<String>,
}

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// Turns a piece of `count` elements of `stride` bytes into what they stand for.
type Filter = Option<fn(&mut [u8], usize, usize, &mut Workspace) -> std::result::Result<(), Error>>;

impl<'p> Compressed<'p> {
    /// The checked extension of a view, if it has one.
    pub fn of(path: &'p Path, index: usize, view: &View) -> Result<Option<Compressed<'p>>> {
        let Some(extensions) = &view.extensions else { return Ok(None) };
        let found = NAMES.iter().find_map(|&name| Some((name, extensions.others.get(name)?)));
        let Some((name, json)) = found else { return Ok(None) };
        let at = format!("bufferViews[{index}].extensions.{name}");
        let wrong = |what: &str| syntax(path, &at, format_args!("{what}; export the file again"));
        let extension = Extension::deserialize(json).map_err(|error| wrong(&error.to_string()))?;
        let mode = match extension.mode.as_str() {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            other => return Err(wrong(&format!("there is no mode '{other}'"))),
        };
        let stride = extension.byte_stride;
        let (filter, strides): (Filter, &[usize]) = match extension.filter.as_deref() {
            None | Some("NONE") => (None, &[]),
            Some("OCTAHEDRAL") => (Some(decode_filter_oct), &[4, 8]),
            Some("QUATERNION") => (Some(decode_filter_quat), &[8]),
            Some("EXPONENTIAL") => (Some(decode_filter_exp), &[]),
            Some("COLOR") => (Some(decode_filter_color), &[4, 8]),
            Some(other) => return Err(wrong(&format!("there is no filter '{other}'"))),
        };
        let fits = match mode {
            Mode::Attributes => stride % 4 == 0 && (4..=256).contains(&stride),
            Mode::Triangles | Mode::Indices => (stride == 2 || stride == 4) && filter.is_none(),
        };
        if !fits || !(strides.is_empty() || strides.contains(&stride)) {
            return Err(wrong(&format!("elements of {stride} bytes do not fit its mode and filter")));
        }
        if mode == Mode::Triangles && !extension.count.is_multiple_of(3) {
            return Err(wrong(&format!("{} indices are no triangles", extension.count)));
        }
        if extension.count.checked_mul(stride).is_none() {
            return Err(wrong(&format!("{} elements of {stride} bytes are too many", extension.count)));
        }
        if view.byte_stride.is_some_and(|whole| whole.0 != 0 && whole.0 != stride) {
            return Err(wrong("byteStride differs from that of the view"));
        }
        Ok(Some(Compressed { path, at, extension, mode, filter }))
    }

    pub fn at(&self) -> &str {
        &self.at
    }

    /// The buffer, and where in it the compressed bytes begin and how many they are.
    pub fn source(&self) -> (usize, u64, u64) {
        (self.extension.buffer, self.extension.byte_offset, self.extension.byte_length)
    }

    /// Bytes of the view.
    pub fn length(&self) -> usize {
        self.extension.count * self.extension.byte_stride
    }

    /// Fails if `source` is too short for so many elements.
    pub fn check(&self, source: &[u8]) -> Result<()> {
        let Extension { count, byte_stride: stride, .. } = self.extension;
        let least = match self.mode {
            // A block has 2^13 bytes at most, and at least some bits for each byte of an element.
            Mode::Attributes => self.length() / (1 << 13) * (stride / 4),
            Mode::Triangles => count / 3,
            Mode::Indices => count,
        };
        if source.len() > least { Ok(()) } else { Err(self.broken(Error::InvalidStream)) }
    }

    pub fn decode(&self, source: &[u8], out: &mut Writer) -> Result<()> {
        let Extension { count, byte_stride: stride, .. } = self.extension;
        if count == 0 {
            return Ok(());
        }
        let broken = |error| self.broken(error);
        let part = |from: usize, to: usize| source.get(from..to).ok_or_else(|| broken(Error::InvalidStream));
        match self.mode {
            Mode::Attributes => {
                let header = *source.first().ok_or_else(|| broken(Error::InvalidStream))?;
                let tail = match decode_vertex_version(source).map_err(broken)? {
                    0 => stride.max(32),
                    _ => (stride + stride / 4).max(24),
                };
                let end = source.len().saturating_sub(tail);
                let (body, tail) = (part(1, end)?, part(end, source.len())?);
                let mut decoder = VertexBufferDecoder::new(count, stride, header, tail, body.len(), LIMITS)
                    .map_err(broken)?;
                let mut workspace = Workspace::new(LIMITS);
                self.run(
                    body,
                    vec![0u8; ELEMENTS * stride],
                    |input, output| decoder.push(input, output),
                    |piece| {
                        if let Some(filter) = self.filter {
                            filter(piece, piece.len() / stride, stride, &mut workspace).map_err(broken)?;
                        }
                        out.write(piece)
                    },
                )?;
                decoder.finish().map_err(broken)
            }
            Mode::Triangles => {
                let codes = 1 + count / 3;
                let end = source.len().saturating_sub(16);
                let (codes, body, tail) = (part(0, codes)?, part(codes, end)?, part(end, source.len())?);
                let mut decoder =
                    IndexBufferDecoder::new(count, codes, tail, body.len(), LIMITS).map_err(broken)?;
                let write = |piece: &mut [u32]| write_indices(piece, stride, out);
                self.run(body, vec![0u32; ELEMENTS], |input, output| decoder.push(input, output), write)?;
                decoder.finish().map_err(broken)
            }
            Mode::Indices => {
                let mut decoder = IndexSequenceDecoder::new(count, LIMITS).map_err(broken)?;
                let write = |piece: &mut [u32]| write_indices(piece, stride, out);
                self.run(source, vec![0u32; ELEMENTS], |input, output| decoder.push(input, output), write)?;
                decoder.finish().map_err(broken)
            }
        }
    }

    /// Lets `push` decode all of `input` through `piece`, which `take` gets each time it is full.
    fn run<T>(
        &self,
        mut input: &[u8],
        mut piece: Vec<T>,
        mut push: impl FnMut(&[u8], &mut [T]) -> std::result::Result<Progress, Error>,
        mut take: impl FnMut(&mut [T]) -> Result<()>,
    ) -> Result<()> {
        let mut filled = 0;
        loop {
            let progress = push(input, &mut piece[filled..]).map_err(|error| self.broken(error))?;
            input = input.get(progress.consumed..).unwrap_or_default();
            filled += progress.written;
            let is_done = match progress.status {
                Status::Done => true,
                _ => progress.consumed == 0 && progress.written == 0,
            };
            if filled == piece.len() || is_done {
                take(&mut piece[..filled])?;
                filled = 0;
            }
            if is_done {
                return Ok(());
            }
        }
    }

    fn broken(&self, error: Error) -> ImportError {
        let what = format!("cannot be decoded: {error}; get the file again, or export it again");
        syntax(self.path, &self.at, what)
    }
}

fn write_indices(indices: &[u32], stride: usize, out: &mut Writer) -> Result<()> {
    let bytes: Vec<u8> = match stride {
        2 => indices.iter().flat_map(|&index| (index as u16).to_le_bytes()).collect(),
        _ => indices.iter().flat_map(|index| index.to_le_bytes()).collect(),
    };
    out.write(&bytes)
}
