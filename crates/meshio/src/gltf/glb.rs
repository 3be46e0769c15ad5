//! The binary container: a header of 12 bytes, then chunks, of which the first is the JSON and one may be a buffer.

use crate::{ImportError, Place, Result};
use std::path::Path;

const MAGIC: &[u8] = b"glTF";
const JSON: &[u8] = b"JSON";
const BINARY: &[u8] = b"BIN\0";

/// The parts of a file.
#[derive(Debug, PartialEq)]
pub(super) struct Container<'a> {
    pub json: &'a [u8],
    /// Contents of the first buffer, if it names no file.
    pub binary: Option<&'a [u8]>,
}

/// Takes a `.glb` apart; anything that does not begin like one is all JSON.
pub(super) fn split<'a>(path: &Path, file: &'a [u8]) -> Result<Container<'a>> {
    if !file.starts_with(MAGIC) {
        return Ok(Container { json: file, binary: None });
    }
    let cut_off =
        || ImportError::syntax(path, Place::Byte(file.len() as u64), "the file is cut off; get it again");
    let version = u32_at(file, 4).ok_or_else(cut_off)?;
    if version != 2 {
        let what = format!("is glTF {version}; only version 2 is read, convert it first");
        return Err(ImportError::unsupported(path, Place::Byte(4), what));
    }
    let length = u32_at(file, 8).ok_or_else(cut_off)? as usize;
    let file = file.get(..length).ok_or_else(cut_off)?;

    let (mut json, mut binary, mut at) = (None, None, 12);
    // Up to three bytes behind the last chunk are padding of careless writers.
    while at + 8 <= file.len() {
        let length = u32_at(file, at).ok_or_else(cut_off)? as usize;
        let kind = &file[at + 4..at + 8];
        let data = file[at + 8..].get(..length).ok_or_else(|| {
            let what =
                format!("a chunk of {length} bytes reaches beyond the end of the file; get the file again");
            ImportError::syntax(path, Place::Byte(at as u64), what)
        })?;
        match kind {
            JSON if at == 12 => json = Some(data),
            _ if json.is_none() => break,
            BINARY => binary = binary.or(Some(data)),
            // Unknown chunks must be ignored, and so are second ones of a kind.
            _ => {}
        }
        at += 8 + length;
    }
    let json = json.ok_or_else(|| {
        ImportError::syntax(path, Place::Byte(12), "the first chunk is not JSON; this is no glTF 2.0 file")
    })?;
    Ok(Container { json, binary })
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
