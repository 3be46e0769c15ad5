//! Buffers: inside the `.glb`, in files of their own, or written into the JSON.

use super::decoded::{Decoded, Store};
use super::document::{Document, entry};
use super::draco::Decompressed;
use super::meshopt::Compressed;
use super::syntax;
use crate::map::Map;
use crate::reference::{percent_decoded, resolve};
use crate::{ImageSource, ImportError, ImportOptions, Result};
use std::cell::OnceCell;
use std::path::{Path, PathBuf};

/// All buffers of a document; each is opened when first asked for.
pub(super) struct Buffers<'a> {
    path: &'a Path,
    document: &'a Document,
    file: &'a Map,
    binary: Option<&'a [u8]>,
    opened: Vec<OnceCell<Opened>>,
    store: Store,
    /// Views that were compressed.
    decompressed: Vec<OnceCell<Decoded>>,
    /// Views that are compressed meshes.
    draco: Vec<OnceCell<Box<Decompressed>>>,
    /// Bytes that a mesh of its own codec may take.
    max_mesh: u64,
    /// Bytes that an accessor may have in memory.
    pub max_resident: u64,
}

enum Opened {
    /// The binary chunk of the file itself.
    Chunk,
    File(PathBuf, Map),
    Inline(Vec<u8>),
}

impl<'a> Buffers<'a> {
    pub fn new(
        path: &'a Path,
        document: &'a Document,
        file: &'a Map,
        binary: Option<&'a [u8]>,
        options: &ImportOptions,
    ) -> Buffers<'a> {
        let opened = document.buffers.iter().map(|_| OnceCell::new()).collect();
        let decompressed = document.buffer_views.iter().map(|_| OnceCell::new()).collect();
        let draco = document.buffer_views.iter().map(|_| OnceCell::new()).collect();
        let decoded_bytes = if document.is_compressed() { options.kept_bytes / 2 } else { 0 };
        // Positions and three kinds of attributes may be read at a time.
        let at_a_time = if options.bare { 1 } else { 4 };
        Buffers {
            path,
            document,
            file,
            binary,
            opened,
            store: Store::new(options, decoded_bytes),
            decompressed,
            draco,
            max_mesh: decoded_bytes,
            max_resident: (options.kept_bytes - decoded_bytes) / at_a_time,
        }
    }

    /// The bytes of a view and its stride.
    pub fn view(&self, view: usize, at: &str) -> Result<(&[u8], Option<usize>)> {
        let json = entry(&self.document.buffer_views, view, self.path, at)?;
        let bytes = match Compressed::of(self.path, view, json)? {
            Some(compressed) => self.decompressed(view, &compressed)?,
            None => {
                let (buffer, offset) = (json.buffer.value(), json.byte_offset.map_or(0, |offset| offset.0));
                self.range(buffer, offset, json.byte_length.0, &format!("bufferViews[{view}]"))?
            }
        };
        // Zero means the same as nothing to some writers.
        Ok((bytes, json.byte_stride.map(|stride| stride.0).filter(|&stride| stride != 0)))
    }

    /// The bytes of a compressed view once it is decompressed: how many it promises, found without doing so.
    pub fn compressed_length(&self, view: usize, at: &str) -> Result<Option<u64>> {
        let json = entry(&self.document.buffer_views, view, self.path, at)?;
        let Some(compressed) = Compressed::of(self.path, view, json)? else { return Ok(None) };
        let (buffer, offset, length) = compressed.source();
        compressed.check(self.range(buffer, offset, length, compressed.at())?)?;
        Ok(Some(compressed.length() as u64))
    }

    /// The mesh that a view holds, which the place `at` names.
    pub fn draco(&self, view: usize, at: &str) -> Result<&Decompressed> {
        let (source, _) = self.view(view, at)?;
        let cell = &self.draco[view];
        if let Some(mesh) = cell.get() {
            return Ok(mesh);
        }
        let at = format!("bufferViews[{view}]");
        let mesh = Decompressed::decode(self.path, source, &self.store, self.max_mesh, &at)?;
        self.release();
        Ok(cell.get_or_init(|| Box::new(mesh)))
    }

    fn decompressed(&self, view: usize, compressed: &Compressed) -> Result<&[u8]> {
        let cell = &self.decompressed[view];
        if let Some(decoded) = cell.get() {
            return Ok(decoded);
        }
        let (buffer, offset, length) = compressed.source();
        let source = self.range(buffer, offset, length, compressed.at())?;
        compressed.check(source)?;
        let mut writer = self.store.writer();
        compressed.decode(source, &mut writer)?;
        let decoded = writer.finish()?;
        // The compressed bytes are not needed any more.
        self.release();
        Ok(cell.get_or_init(|| decoded))
    }

    /// `length` bytes of a buffer from `offset` on, which the place `at` asks for.
    fn range(&self, buffer: usize, offset: u64, length: u64, at: &str) -> Result<&[u8]> {
        let bytes = self.bytes(buffer, at)?;
        let end = offset.checked_add(length);
        let range = end.and_then(|end| Some(usize::try_from(offset).ok()?..usize::try_from(end).ok()?));
        range.and_then(|range| bytes.get(range)).ok_or_else(|| {
            let what = format!(
                "reaches from byte {offset} over {length} bytes, beyond the {} bytes of its buffer; export the file \
                 again",
                bytes.len()
            );
            syntax(self.path, at, what)
        })
    }

    /// Where the bytes of a view are.
    pub fn source(&self, view: usize, path: &Path) -> Result<ImageSource> {
        let (bytes, _) = self.view(view, "images")?;
        let part = |file: &Path, map: &Map| {
            let offset = (bytes.as_ptr() as usize).checked_sub(map.as_ptr() as usize)?;
            let is_inside = offset + bytes.len() <= map.len();
            let (path, bytes) = (file.to_owned(), bytes.len() as u64);
            is_inside.then_some(ImageSource::Part { path, offset: offset as u64, bytes })
        };
        let files = self.opened.iter().filter_map(|opened| match opened.get() {
            Some(Opened::File(path, map)) => Some((path.as_path(), map)),
            _ => None,
        });
        let mut files = files.chain([(path, self.file)]);
        let found = files.find_map(|(path, map)| part(path, map));
        Ok(found.unwrap_or_else(|| ImageSource::Inline(bytes.to_vec())))
    }

    /// Lets mapped pages leave memory.
    pub fn release(&self) {
        self.file.release();
        self.decompressed.iter().filter_map(OnceCell::get).for_each(Decoded::release);
        self.draco.iter().filter_map(OnceCell::get).for_each(|mesh| mesh.release());
        for opened in self.opened.iter().filter_map(OnceCell::get) {
            if let Opened::File(_, map) = opened {
                map.release();
            }
        }
    }

    /// The files that were read.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.opened.iter().filter_map(|opened| match opened.get() {
            Some(Opened::File(path, _)) => Some(path.as_path()),
            _ => None,
        })
    }

    fn bytes(&self, buffer: usize, at: &str) -> Result<&[u8]> {
        let cell = entry(&self.opened, buffer, self.path, format_args!("{at}.buffer"))?;
        let opened = match cell.get() {
            Some(opened) => opened,
            None => {
                let opened = self.open(buffer)?;
                cell.get_or_init(|| opened)
            }
        };
        Ok(match opened {
            Opened::Chunk => self.binary.unwrap_or_default(),
            Opened::File(_, map) => map,
            Opened::Inline(bytes) => bytes,
        })
    }

    fn open(&self, buffer: usize) -> Result<Opened> {
        let (opened, length) = match (&self.document.buffers[buffer].uri, self.binary) {
            (None, Some(chunk)) if buffer == 0 => (Opened::Chunk, chunk.len()),
            (None, _) => return Err(self.error(buffer, "has no contents; export the file again")),
            (Some(uri), _) if uri.starts_with("data:") => {
                let bytes = data_uri(uri).ok_or_else(|| self.error(buffer, "its data URI is not base64"))?;
                let length = bytes.len();
                (Opened::Inline(bytes), length)
            }
            (Some(uri), _) => {
                let (path, map) = self.open_file(buffer, uri)?;
                let length = map.len();
                (Opened::File(path, map), length)
            }
        };
        let promised = self.document.buffers[buffer].byte_length.0;
        if (length as u64) < promised {
            let what = format!("has {length} of its {promised} bytes; it is cut off, get it again");
            return Err(self.error(buffer, &what));
        }
        Ok(opened)
    }

    fn open_file(&self, buffer: usize, uri: &str) -> Result<(PathBuf, Map)> {
        // Some writers encode blanks as a URI needs, some do not.
        let decoded = resolve(self.path, &percent_decoded(uri));
        let literal = resolve(self.path, uri).ok().filter(|path| path.is_file());
        let path = literal.map_or(decoded, Ok);
        let path = path.map_err(|reason| self.error(buffer, &format!("'{uri}' is not read: {reason}")))?;
        let map = Map::open(&path).map_err(|error| match error {
            ImportError::Io { source, .. } => self
                .error(buffer, &format!("'{uri}' cannot be read: {source}; put that file next to this one")),
            other => other,
        })?;
        Ok((path, map))
    }

    fn error(&self, buffer: usize, what: &str) -> ImportError {
        syntax(self.path, format_args!("buffers[{buffer}]"), what)
    }
}

/// The bytes of `data:application/octet-stream;base64,...`.
pub(super) fn data_uri(uri: &str) -> Option<Vec<u8>> {
    let (kind, data) = uri.split_once(',')?;
    kind.ends_with(";base64").then(|| base64(data.as_bytes()))?
}

/// Decodes base64 of either alphabet, with or without padding.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.trim_ascii_end();
    let text = text.strip_suffix(b"==").or(text.strip_suffix(b"=")).unwrap_or(text);
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0;
        for &c in group {
            let value = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        // Two characters give one byte, three give two, four give three.
        bits <<= 6 * (4 - group.len());
        bytes.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
        if group.len() == 1 {
            return None;
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_all_lengths() {
        for (text, bytes) in [
            ("", &b""[..]),
            ("Zg==", b"f"),
            ("Zm8=", b"fo"),
            ("Zm9v", b"foo"),
            ("Zm9vYg", b"foob"),
            ("_-8=", b"\xff\xef"),
        ] {
            assert_eq!(base64(text.as_bytes()).as_deref(), Some(bytes), "{text}");
        }
        for text in ["Z", "Zm9vY", "Zm 9", "Zg==Zg=="] {
            assert_eq!(base64(text.as_bytes()), None, "{text}");
        }
        assert_eq!(data_uri("data:application/octet-stream;base64,Zm9v").as_deref(), Some(&b"foo"[..]));
        assert_eq!(data_uri("data:text/plain,foo"), None);
        assert_eq!(data_uri("data:"), None);
    }
}
