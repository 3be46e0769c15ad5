//! The header of a PLY file: which elements follow, and how their rows are laid out.

use crate::error::excerpt;
use crate::number::words;
use crate::{ImportError, Place, Result};
use std::path::Path;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn of(name: &[u8]) -> Option<Scalar> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// In a binary file.
    pub fn bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Kind {
    /// The least bytes that a value takes. In text that is a digit, the blank behind it not counted.
    fn min_bytes(self, encoding: Encoding) -> u64 {
        match self {
            _ if encoding == Encoding::Ascii => 1,
            Kind::Scalar(scalar) | Kind::List { count: scalar, .. } => scalar.bytes() as u64,
        }
    }
}

#[derive(Debug)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

#[derive(Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    pub fn find(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|property| names.contains(&property.name.as_str()))
    }

    /// Bytes of a row of a binary file, if all rows have the same.
    pub fn row_bytes(&self) -> Option<usize> {
        let bytes = |property: &Property| match property.kind {
            Kind::Scalar(scalar) => Some(scalar.bytes()),
            Kind::List { .. } => None,
        };
        self.properties.iter().map(bytes).sum()
    }

    /// The least bytes of a row.
    pub fn min_row_bytes(&self, encoding: Encoding) -> u64 {
        self.properties.iter().map(|property| property.kind.min_bytes(encoding)).sum()
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the header ends.
    pub bytes: usize,
}

impl Header {
    pub fn parse(path: &Path, file: &[u8]) -> Result<Header> {
        let syntax = |line: u64, what: String| ImportError::syntax(path, Place::Line(line), what);
        let separator = match file {
            [b'p', b'l', b'y', b'\n', ..] | [b'p', b'l', b'y', b'\r', b'\n', ..] => b'\n',
            // As old as the format itself.
            [b'p', b'l', b'y', b'\r', ..] => b'\r',
            _ => return Err(syntax(1, "the first line is not 'ply'; this is no PLY file".into())),
        };
        let (mut encoding, mut elements, mut at) = (None, Vec::new(), 0);
        for number in 1.. {
            let Some(length) = memchr::memchr(separator, &file[at..]) else { break };
            let line = &file[at..at + length];
            at += length + 1;
            let mut words = words(line);
            match words.next().unwrap_or_default() {
                b"format" => encoding = Some(parse_format(words).map_err(|what| syntax(number, what))?),
                b"element" => elements.push(parse_element(words).map_err(|what| syntax(number, what))?),
                b"property" => {
                    let property = parse_property(words).map_err(|what| syntax(number, what))?;
                    let element: Option<&mut Element> = elements.last_mut();
                    let element = element.ok_or_else(|| {
                        syntax(number, "a property comes before the first element; move it".into())
                    })?;
                    element.properties.push(property);
                }
                b"end_header" => {
                    let encoding = encoding
                        .ok_or_else(|| syntax(number, "there is no 'format' line; add one".into()))?;
                    return Ok(Header { encoding, elements, bytes: at });
                }
                b"" | b"ply" | b"comment" | b"obj_info" => {}
                other => {
                    let what = format!("{} is no header line; remove it, or export again", excerpt(other));
                    return Err(syntax(number, what));
                }
            }
        }
        Err(ImportError::syntax(path, Place::Whole, "the header has no 'end_header'; the file is cut off"))
    }
}

fn parse_format<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> std::result::Result<Encoding, String> {
    let encoding = match words.next().unwrap_or_default() {
        b"ascii" => Encoding::Ascii,
        b"binary_little_endian" => Encoding::LittleEndian,
        b"binary_big_endian" => Encoding::BigEndian,
        other => {
            let known = "ascii, binary_little_endian and binary_big_endian";
            return Err(format!("{} is not a known format, which are {known}", excerpt(other)));
        }
    };
    match words.next() {
        Some(b"1.0") => Ok(encoding),
        other => {
            Err(format!("{} is not a known version; export as PLY 1.0", excerpt(other.unwrap_or_default())))
        }
    }
}

fn parse_element<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> std::result::Result<Element, String> {
    let (Some(name), Some(count)) = (words.next(), words.next()) else {
        return Err("an element needs a name and a count".into());
    };
    let parsed = std::str::from_utf8(count).ok().and_then(|count| count.parse().ok());
    let count = parsed.ok_or_else(|| format!("{} is not a count of rows", excerpt(count)))?;
    Ok(Element { name: String::from_utf8_lossy(name).into_owned(), count, properties: Vec::new() })
}

fn parse_property<'a>(words: impl Iterator<Item = &'a [u8]>) -> std::result::Result<Property, String> {
    let words: Vec<_> = words.take(4).collect();
    let scalar = |name| Scalar::of(name).ok_or_else(|| format!("{} is not a known type", excerpt(name)));
    let (name, kind) = match words[..] {
        [list, count, item, name] if list == b"list" => {
            let count = scalar(count)?;
            if matches!(count, Scalar::F32 | Scalar::F64) {
                return Err("the length of a list must be an integer; export again".into());
            }
            (name, Kind::List { count, item: scalar(item)? })
        }
        [kind, name, ..] if kind != b"list" => (name, Kind::Scalar(scalar(kind)?)),
        _ => return Err("a property needs a type and a name; export again".into()),
    };
    Ok(Property { name: String::from_utf8_lossy(name).into_owned(), kind })
}
