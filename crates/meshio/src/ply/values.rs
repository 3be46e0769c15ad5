//! The numbers of a PLY body, one after the other, whatever their encoding.

use super::header::Scalar;
use crate::error::excerpt;
use crate::number::{is_space, parse_f64, parse_i64, words};
use crate::{ImportError, Place};
use std::path::Path;

/// Why there is no number. Small, since it comes with every number.
#[derive(Clone, Copy, Debug)]
pub(super) enum Missing {
    End,
    NotANumber,
    NegativeLength,
}

pub(super) type Value<T> = std::result::Result<T, Missing>;

/// A place in the body.
pub(super) trait Values: Clone {
    /// Bytes from the start of the file.
    fn at(&self) -> usize;
    fn bytes_left(&self) -> u64;
    /// Where the next value is.
    fn place(&self) -> Place;
    /// The next value, for messages.
    fn shown(&self) -> String;
    fn number(&mut self, scalar: Scalar) -> Value<f64>;
    fn integer(&mut self, scalar: Scalar) -> Value<i64>;
    fn skip(&mut self, scalar: Scalar, count: u64) -> Value<()>;

    #[inline(always)]
    fn index(&mut self, scalar: Scalar) -> Option<u32> {
        self.integer(scalar).ok().and_then(|index| u32::try_from(index).ok())
    }

    /// Three indices, if they can be some.
    #[inline(always)]
    fn triangle(&mut self, scalar: Scalar) -> Option<[u32; 3]> {
        Some([self.index(scalar)?, self.index(scalar)?, self.index(scalar)?])
    }

    /// Appends `count` indices to `corners`. Gives the first that no vertex can have, if there is one.
    #[inline]
    fn indices(&mut self, scalar: Scalar, count: u64, corners: &mut Vec<u32>) -> Value<Option<i64>> {
        let mut impossible = None;
        for _ in 0..count {
            let index = self.integer(scalar)?;
            corners.push(u32::try_from(index).unwrap_or_else(|_| {
                impossible.get_or_insert(index);
                0
            }));
        }
        Ok(impossible)
    }
}

/// What went wrong, as an error of the file.
pub(super) fn error(
    path: &Path,
    values: &impl Values,
    missing: Missing,
    element: &str,
    row: u64,
) -> ImportError {
    let what = match missing {
        Missing::End => {
            format!("the file ends inside row {row} of element '{element}'; it is cut off, get it again")
        }
        Missing::NotANumber => {
            format!("row {row} of element '{element}' cannot hold {}; export the file again", values.shown())
        }
        Missing::NegativeLength => {
            format!("row {row} of element '{element}' has a list of negative length; export the file again")
        }
    };
    ImportError::syntax(path, values.place(), what)
}

#[derive(Clone)]
pub(super) struct Binary<'a, const BIG_ENDIAN: bool> {
    file: &'a [u8],
    at: usize,
}

impl<'a, const BIG_ENDIAN: bool> Binary<'a, BIG_ENDIAN> {
    /// `at` must not lie behind the end.
    pub fn new(file: &'a [u8], at: usize) -> Self {
        Binary { file, at }
    }

    pub fn skip_bytes(&mut self, count: u64) -> Value<&'a [u8]> {
        let end =
            usize::try_from(count).ok().and_then(|count| self.at.checked_add(count)).ok_or(Missing::End)?;
        let bytes = self.file.get(self.at..end).ok_or(Missing::End)?;
        self.at = end;
        Ok(bytes)
    }

    /// The next bytes, least significant first.
    #[inline(always)]
    fn take<const N: usize>(&mut self) -> Value<[u8; N]> {
        let bytes = self.file.get(self.at..).and_then(|rest| first(rest, BIG_ENDIAN)).ok_or(Missing::End)?;
        self.at += N;
        Ok(bytes)
    }
}

impl<const BIG_ENDIAN: bool> Values for Binary<'_, BIG_ENDIAN> {
    fn at(&self) -> usize {
        self.at
    }

    fn bytes_left(&self) -> u64 {
        (self.file.len() - self.at) as u64
    }

    fn place(&self) -> Place {
        Place::Byte(self.at as u64)
    }

    fn shown(&self) -> String {
        "a number that is not whole".into()
    }

    #[inline]
    fn number(&mut self, scalar: Scalar) -> Value<f64> {
        let number = self.file.get(self.at..).and_then(|rest| decode(scalar, rest, BIG_ENDIAN));
        self.at += if number.is_some() { scalar.bytes() } else { 0 };
        number.ok_or(Missing::End)
    }

    #[inline(always)]
    fn integer(&mut self, scalar: Scalar) -> Value<i64> {
        // Nearly all indices are of these types.
        match scalar {
            Scalar::I32 => return Ok(i64::from(i32::from_le_bytes(self.take()?))),
            Scalar::U32 => return Ok(i64::from(u32::from_le_bytes(self.take()?))),
            Scalar::U8 => return Ok(i64::from(u8::from_le_bytes(self.take()?))),
            _ => {}
        }
        let number = self.clone().number(scalar)?;
        let integer = whole(number).ok_or(Missing::NotANumber)?;
        self.at += scalar.bytes();
        Ok(integer)
    }

    fn skip(&mut self, scalar: Scalar, count: u64) -> Value<()> {
        let bytes = count.checked_mul(scalar.bytes() as u64).ok_or(Missing::End)?;
        self.skip_bytes(bytes).map(|_| ())
    }
}

/// The number at the start of `bytes`, if they are enough.
#[inline(always)]
pub(super) fn decode(scalar: Scalar, bytes: &[u8], big_endian: bool) -> Option<f64> {
    Some(match scalar {
        Scalar::I8 => f64::from(i8::from_le_bytes(first(bytes, big_endian)?)),
        Scalar::U8 => f64::from(u8::from_le_bytes(first(bytes, big_endian)?)),
        Scalar::I16 => f64::from(i16::from_le_bytes(first(bytes, big_endian)?)),
        Scalar::U16 => f64::from(u16::from_le_bytes(first(bytes, big_endian)?)),
        Scalar::I32 => f64::from(i32::from_le_bytes(first(bytes, big_endian)?)),
        Scalar::U32 => f64::from(u32::from_le_bytes(first(bytes, big_endian)?)),
        Scalar::F32 => f64::from(f32::from_le_bytes(first(bytes, big_endian)?)),
        Scalar::F64 => f64::from_le_bytes(first(bytes, big_endian)?),
    })
}

/// The first bytes, least significant first.
#[inline(always)]
fn first<const N: usize>(bytes: &[u8], big_endian: bool) -> Option<[u8; N]> {
    let mut bytes = *bytes.first_chunk()?;
    if big_endian {
        bytes.reverse();
    }
    Some(bytes)
}

/// Numbers in text, separated by white space; ends of lines mean nothing.
#[derive(Clone)]
pub(super) struct Text<'a> {
    file: &'a [u8],
    at: usize,
}

impl<'a> Text<'a> {
    /// `at` must not lie behind the end.
    pub fn new(file: &'a [u8], at: usize) -> Self {
        Text { file, at }
    }

    /// The next word, and what it means.
    #[inline]
    fn next<T>(&mut self, meaning: impl Fn(&[u8]) -> Option<T>) -> Value<T> {
        let rest = &self.file[self.at..];
        let start = rest.iter().position(|&c| !is_space(c)).ok_or(Missing::End)?;
        let word = &rest[start..];
        let word = &word[..word.iter().position(|&c| is_space(c)).unwrap_or(word.len())];
        let value = meaning(word).ok_or(Missing::NotANumber)?;
        self.at += start + word.len();
        Ok(value)
    }
}

impl Values for Text<'_> {
    fn at(&self) -> usize {
        self.at
    }

    fn bytes_left(&self) -> u64 {
        (self.file.len() - self.at) as u64
    }

    fn place(&self) -> Place {
        let blanks = self.file[self.at..].iter().take_while(|&&c| is_space(c)).count();
        let before = match self.at + blanks {
            end if end == self.file.len() => self.file.trim_ascii_end(),
            next => &self.file[..next],
        };
        let feeds = memchr::memchr_iter(b'\n', before).count();
        // Files without line feeds separate lines by carriage returns.
        Place::Line(1 + if feeds > 0 { feeds } else { memchr::memchr_iter(b'\r', before).count() } as u64)
    }

    fn shown(&self) -> String {
        excerpt(words(&self.file[self.at..]).next().unwrap_or_default())
    }

    #[inline]
    fn number(&mut self, _: Scalar) -> Value<f64> {
        self.next(parse_f64)
    }

    #[inline]
    fn integer(&mut self, _: Scalar) -> Value<i64> {
        self.next(|word| parse_i64(word).or_else(|| parse_f64(word).and_then(whole)))
    }

    fn skip(&mut self, _: Scalar, count: u64) -> Value<()> {
        (0..count).try_for_each(|_| self.next(|_| Some(())))
    }
}

/// Some programs write indices as floats.
fn whole(number: f64) -> Option<i64> {
    (number.fract() == 0.0 && number.abs() < 9e15).then_some(number as i64)
}
