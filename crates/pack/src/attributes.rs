//! What vertices have besides positions, page by page, apart from the pages so that tracing does not read it.
//!
//! The block of a page has each different record once, and for each triangle which records its corners have.

use crate::PackError;
use crate::layout::{AttributeHeader, PageId};
use raystrips_geom::{Attributes, Streams};
use std::collections::HashMap;

/// Most records that are named by 16 bits.
const MOST_SHORT: usize = 1 << 16;

/// Makes the block of a page.
#[derive(Default)]
pub struct AttributeBuilder {
    streams: Streams,
    records: Vec<u8>,
    numbers: HashMap<Vec<u8>, u32>,
    corners: Vec<u32>,
}

impl AttributeBuilder {
    /// A block of records with these streams, at least one.
    pub fn new(streams: Streams) -> AttributeBuilder {
        AttributeBuilder { streams, ..AttributeBuilder::default() }
    }

    /// Adds the next triangle of the page.
    pub fn triangle(&mut self, corners: &[Attributes; 3]) {
        for attributes in corners {
            let mut record = Vec::with_capacity(self.streams.record_bytes());
            attributes.encode(self.streams, &mut record);
            let next = self.numbers.len() as u32;
            let number = *self.numbers.entry(record).or_insert_with_key(|record| {
                self.records.extend_from_slice(record);
                next
            });
            self.corners.push(number);
        }
    }

    /// The bytes of the block.
    pub fn finish(self) -> Vec<u8> {
        let header = AttributeHeader {
            record_count: self.numbers.len() as u32,
            triangle_count: (self.corners.len() / 3) as u32,
            streams: self.streams.bits().into(),
        };
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        bytes.extend_from_slice(&self.records);
        match self.numbers.len() <= MOST_SHORT {
            true => self.corners.iter().for_each(|&c| bytes.extend_from_slice(&(c as u16).to_le_bytes())),
            false => self.corners.iter().for_each(|&c| bytes.extend_from_slice(&c.to_le_bytes())),
        }
        bytes
    }
}

/// The block of a page, checked.
#[derive(Clone, Copy, Debug)]
pub struct AttributeView<'a> {
    streams: Streams,
    records: &'a [u8],
    corners: &'a [u8],
    corner_bytes: usize,
}

/// Checks the block of page `id`, which has so many triangles: afterwards it can be viewed.
///
/// # Errors
/// If it is not what a builder makes.
pub fn check_attributes(bytes: &[u8], id: PageId, triangle_count: u32) -> Result<(), PackError> {
    let wrong = |what: &str| Err(PackError::CorruptPage { page: id, what: format!("attributes: {what}") });
    let Some((header, view)) = parse(bytes) else { return wrong("their length is wrong") };
    if header.triangle_count != triangle_count {
        return wrong("of another number of triangles");
    }
    let count = triangle_count as usize * 3;
    if (0..count).any(|i| view.corner(i) >= header.record_count) {
        return wrong("a corner names a record that is not there");
    }
    Ok(())
}

fn parse(bytes: &[u8]) -> Option<(AttributeHeader, AttributeView<'_>)> {
    let (header, rest) = bytes.split_first_chunk::<{ size_of::<AttributeHeader>() }>()?;
    let header: AttributeHeader = bytemuck::pod_read_unaligned(header);
    let streams = u8::try_from(header.streams).ok().and_then(Streams::from_bits).filter(|s| !s.is_empty())?;
    let record_count = header.record_count as usize;
    let (records, corners) = rest.split_at_checked(record_count.checked_mul(streams.record_bytes())?)?;
    let corner_bytes = if record_count <= MOST_SHORT { 2 } else { 4 };
    let is_whole = corners.len() as u64 == u64::from(header.triangle_count) * 3 * corner_bytes as u64;
    is_whole.then_some((header, AttributeView { streams, records, corners, corner_bytes }))
}

impl<'a> AttributeView<'a> {
    /// The block in `bytes`; `None` if there is none.
    ///
    /// # Panics
    /// If they are no block, which [`check_attributes`] finds.
    pub fn new(bytes: &'a [u8]) -> Option<AttributeView<'a>> {
        (!bytes.is_empty()).then(|| parse(bytes).expect("attributes are checked when they come").1)
    }

    /// Which attributes there are.
    pub fn streams(&self) -> Streams {
        self.streams
    }

    /// The attributes of the corners of triangle `i` of the page.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn triangle(&self, i: usize) -> [Attributes; 3] {
        let record_bytes = self.streams.record_bytes();
        [0, 1, 2].map(|k| {
            let record = self.corner(3 * i + k) as usize * record_bytes;
            Attributes::decode(&self.records[record..][..record_bytes], self.streams)
        })
    }

    fn corner(&self, i: usize) -> u32 {
        let bytes = &self.corners[i * self.corner_bytes..][..self.corner_bytes];
        match *bytes {
            [a, b] => u16::from_le_bytes([a, b]).into(),
            _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};

    fn corner(i: u32) -> Attributes {
        Attributes { tex_coords: [Vec2::new(i as f32, 0.5), Vec2::ZERO], ..Attributes::default() }
    }

    #[test]
    fn corners_come_back_and_equal_ones_are_shared() {
        for count in [1, 40_000] {
            let mut builder = AttributeBuilder::new(Streams::TEX_COORDS_0);
            let triangle = |i: u32| [corner(2 * i), corner(2 * i + 1), corner(2 * i + 2)];
            (0..count).for_each(|i| builder.triangle(&triangle(i)));
            let bytes = builder.finish();
            let corner_bytes = if 2 * count < 65536 { 2 } else { 4 };
            assert_eq!(bytes.len() as u32, 12 + (2 * count + 1) * 8 + count * 3 * corner_bytes);
            check_attributes(&bytes, 0, count).unwrap();
            let view = AttributeView::new(&bytes).unwrap();
            assert!((0..count).all(|i| view.triangle(i as usize) == triangle(i)));
        }
        assert!(AttributeView::new(&[]).is_none());
    }

    #[test]
    fn broken_blocks_are_refused() {
        let mut builder = AttributeBuilder::new(Streams::NORMALS);
        let normal = |normal| Attributes { normal, ..Attributes::default() };
        builder.triangle(&[normal(Vec3::X), normal(Vec3::Y), normal(Vec3::Z)]);
        let bytes = builder.finish();
        assert!((0..bytes.len()).all(|end| check_attributes(&bytes[..end], 0, 1).is_err()));
        assert!(check_attributes(&bytes, 0, 2).is_err());
        for (at, value) in [(0, 4), (8, 32), (8, 0), (24, 3)] {
            let mut damaged = bytes.clone();
            damaged[at] = value;
            assert!(check_attributes(&damaged, 0, 1).is_err(), "{at}");
        }
    }
}
