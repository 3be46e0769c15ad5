//! Triangles or windows of strands as bytes in scratch files: some thousand of one geometry at a time, with the vertices
//! they name.
//!
//! A block is a head, then positions, then the record of attributes of each, if there are any, then *items*: corners of triangles as places in them, or [`StoredWindow`]s, then the
//! radius of each position of strands, then, where ids are kept, the place of each triangle in the batch that it came
//! from, then, where the mesh was simplified, the quadric of each position. Little-endian; nothing is aligned. Memory and disk: 12 to 14 bytes a triangle where neighbors in the mesh are
//! neighbors in the file, and 22 more with quadrics.

use crate::mesh::has_area;
use crate::positions::ToPack;
use bytemuck::{Pod, Zeroable, pod_read_unaligned};
use glam::Vec3;
use raystrips_geom::strand::ball_bounds;
use raystrips_geom::{Aabb, Streams};
use raystrips_meshio::TriangleBatch;
use raystrips_simplify::StoredQuadric;
use std::io;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Head {
    first_id: u64,
    geometry: u32,
    vertex_count: u32,
    item_count: u32,
    flags: u32,
    /// CRC-32C of the block with zero here.
    checksum: u32,
    reserved: u32,
}

/// Positions are f64, not f32.
const WIDE_POSITIONS: u32 = 1;
/// There are places in the batch.
const PLACES: u32 = 2;
/// There are quadrics.
const QUADRICS: u32 = 4;
/// Items are windows of strands, and positions have radii.
const STRANDS: u32 = 8;
/// From this bit on, which attributes there are.
const STREAMS_SHIFT: u32 = 8;

/// A window of a strand.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct StoredWindow {
    /// Place of its first point among the positions; the others follow.
    pub first: u16,
    /// Segments.
    pub segments: u16,
    /// Number of its first segment in the batch that it came from.
    pub segment: u16,
    /// Number there of the first segment of its strand.
    pub strand: u16,
}

/// A block that is read.
#[derive(Clone, Copy)]
pub(crate) struct Block<'a> {
    head: Head,
    positions: &'a [u8],
    attributes: &'a [u8],
    items: &'a [u8],
    radii: &'a [u8],
    places: &'a [u8],
    quadrics: &'a [u8],
}

/// Triangles to make a block of.
#[derive(Clone, Copy, Default)]
pub(crate) struct Contents<'a> {
    /// Geometry of all of them.
    pub geometry: u32,
    /// Number of the first triangle of the batch that they came from.
    pub first_id: u64,
    /// At most 2^16.
    pub positions: &'a [Vec3],
    /// What positions have besides.
    pub streams: Streams,
    /// A record of that for each.
    pub attributes: &'a [u8],
    /// Corners as places among the positions.
    pub triangles: &'a [[u32; 3]],
    /// Place of each triangle in its batch; empty if ids are not kept.
    pub places: &'a [u16],
    /// Quadric of each position; empty if the mesh is as it was imported.
    pub quadrics: &'a [StoredQuadric],
}

/// A batch of the import; positions are f32 where that loses nothing.
pub(crate) fn of_batch(batch: &TriangleBatch) -> Vec<u8> {
    let is_f32 = |&x: &f64| f64::from(x as f32) == x;
    let narrow = batch.positions.iter().flatten().all(is_f32);
    let mut writer = Writer::new(batch.geometry, batch.first_triangle_id, batch.triangles.len());
    if narrow {
        writer.positions(batch.positions.iter().map(|p| p.map(|x| x as f32)), 0);
    } else {
        writer.positions(batch.positions.iter().copied(), WIDE_POSITIONS);
    }
    writer.attributes(batch.streams, &batch.attributes);
    writer.corners(&batch.triangles);
    writer.finish()
}

/// Triangles on their way to a piece.
pub(crate) fn of_triangles(contents: &Contents) -> Vec<u8> {
    let Contents { geometry, first_id, positions, streams, attributes, triangles, places, quadrics } =
        contents;
    let mut writer = Writer::new(*geometry, *first_id, triangles.len());
    writer.positions(positions.iter().map(|p| p.to_array()), 0);
    writer.attributes(*streams, attributes);
    writer.corners(triangles);
    for (flag, bytes) in [(PLACES, bytemuck::cast_slice(places)), (QUADRICS, bytemuck::cast_slice(quadrics))]
    {
        if !bytes.is_empty() {
            writer.head.flags |= flag;
            writer.bytes.extend_from_slice(bytes);
        }
    }
    writer.finish()
}

/// Windows of strands; `radii` as many as `positions`.
pub(crate) fn of_windows(
    (geometry, first_id): (u32, u64),
    positions: Points,
    radii: &[f32],
    windows: &[StoredWindow],
) -> Vec<u8> {
    let mut writer = Writer::new(geometry, first_id, windows.len());
    match positions {
        Points::Narrow(positions) => writer.positions(positions.iter().map(|p| p.to_array()), STRANDS),
        Points::Wide(positions) => writer.positions(positions.iter().copied(), STRANDS | WIDE_POSITIONS),
    }
    writer.bytes.extend_from_slice(bytemuck::cast_slice(windows));
    writer.bytes.extend_from_slice(bytemuck::cast_slice(radii));
    writer.finish()
}

/// At most 2^16 positions.
#[derive(Clone, Copy)]
pub(crate) enum Points<'a> {
    Narrow(&'a [Vec3]),
    Wide(&'a [[f64; 3]]),
}

struct Writer {
    head: Head,
    bytes: Vec<u8>,
}

impl Writer {
    fn new(geometry: u32, first_id: u64, item_count: usize) -> Writer {
        let head = Head { first_id, geometry, item_count: item_count as u32, ..Head::zeroed() };
        Writer { head, bytes: vec![0; size_of::<Head>()] }
    }

    fn positions<T: Pod>(&mut self, positions: impl ExactSizeIterator<Item = T>, flags: u32) {
        self.head.vertex_count = positions.len() as u32;
        self.head.flags |= flags;
        self.bytes.reserve(positions.len() * size_of::<T>());
        positions.for_each(|p| self.bytes.extend_from_slice(bytemuck::bytes_of(&p)));
    }

    fn attributes(&mut self, streams: Streams, records: &[u8]) {
        debug_assert_eq!(records.len(), self.head.vertex_count as usize * streams.record_bytes());
        self.head.flags |= u32::from(streams.bits()) << STREAMS_SHIFT;
        self.bytes.extend_from_slice(records);
    }

    /// Batches have at most 2^16 positions.
    fn corners(&mut self, triangles: &[[u32; 3]]) {
        self.bytes.reserve(triangles.len() * size_of::<[u16; 3]>());
        for triangle in triangles {
            self.bytes.extend_from_slice(bytemuck::bytes_of(&triangle.map(|v| v as u16)));
        }
    }

    fn finish(mut self) -> Vec<u8> {
        self.head.checksum = checksum(self.head, &self.bytes[size_of::<Head>()..]);
        self.bytes[..size_of::<Head>()].copy_from_slice(bytemuck::bytes_of(&self.head));
        self.bytes
    }
}

fn checksum(head: Head, body: &[u8]) -> u32 {
    let head = Head { checksum: 0, ..head };
    crc32c::crc32c_append(crc32c::crc32c(bytemuck::bytes_of(&head)), body)
}

fn streams(head: Head) -> Option<Streams> {
    Streams::from_bits(u8::try_from(head.flags >> STREAMS_SHIFT).ok()?)
}

impl<'a> Block<'a> {
    /// All blocks in `bytes`, one after the other.
    pub fn all(mut bytes: &'a [u8]) -> impl Iterator<Item = io::Result<Block<'a>>> {
        std::iter::from_fn(move || {
            if bytes.is_empty() {
                return None;
            }
            let Some((block, rest)) = Block::split(bytes) else {
                bytes = &[];
                let what = "a scratch file is damaged; try again, with --scratch on another disk if that does not help";
                return Some(Err(io::Error::new(io::ErrorKind::InvalidData, what)));
            };
            bytes = rest;
            Some(Ok(block))
        })
    }

    fn split(bytes: &'a [u8]) -> Option<(Block<'a>, &'a [u8])> {
        let (head, body) = bytes.split_first_chunk::<{ size_of::<Head>() }>()?;
        let head: Head = pod_read_unaligned(head);
        let has = |flag| head.flags & flag != 0;
        let position_bytes = if has(WIDE_POSITIONS) { 24 } else { 12 };
        let (count, vertex_count) = (head.item_count as usize, head.vertex_count as usize);
        let (item_bytes, radius_bytes) = match has(STRANDS) {
            true => (size_of::<StoredWindow>(), size_of::<f32>()),
            false => (size_of::<[u16; 3]>(), 0),
        };
        let streams = streams(head)?;
        let (positions, rest) = body.split_at_checked(vertex_count * position_bytes)?;
        let (attributes, rest) = rest.split_at_checked(vertex_count * streams.record_bytes())?;
        let (items, rest) = rest.split_at_checked(count * item_bytes)?;
        let (radii, rest) = rest.split_at_checked(vertex_count * radius_bytes)?;
        let (places, rest) = rest.split_at_checked(if has(PLACES) { 2 * count } else { 0 })?;
        let quadric_bytes = if has(QUADRICS) { size_of::<StoredQuadric>() } else { 0 };
        let (quadrics, rest) = rest.split_at_checked(vertex_count * quadric_bytes)?;
        let whole = checksum(head, &body[..body.len() - rest.len()]) == head.checksum;
        whole.then_some((Block { head, positions, attributes, items, radii, places, quadrics }, rest))
    }

    /// Geometry of all of it.
    pub fn geometry(&self) -> u32 {
        self.head.geometry
    }

    /// Number of the first triangle or segment of the batch that it came from.
    pub fn first_id(&self) -> u64 {
        self.head.first_id
    }

    /// What positions have besides.
    pub fn streams(&self) -> Streams {
        streams(self.head).unwrap_or_default()
    }

    /// The record of that of each position.
    pub fn attributes(&self) -> &'a [u8] {
        self.attributes
    }

    pub fn item_count(&self) -> usize {
        self.head.item_count as usize
    }

    /// True if it holds windows of strands.
    pub fn is_of_strands(&self) -> bool {
        self.head.flags & STRANDS != 0
    }

    /// Calls `take` with the place of each item and its box, `positions` being those of the pack. Of triangles, those without
    /// an area have none unless that `keeps_flat`.
    pub fn for_each_box(
        &self,
        positions: &[Vec3],
        to_pack: &ToPack,
        keeps_flat: bool,
        mut take: impl FnMut(u32, Option<Aabb>),
    ) {
        if self.is_of_strands() {
            let balls: Vec<Aabb> = positions
                .iter()
                .zip(self.radii())
                .map(|(&center, radius)| ball_bounds(center, to_pack.radii.rounded(radius)))
                .collect();
            for (window, place) in self.windows().zip(0..) {
                let points = window.first.into()..=usize::from(window.first + window.segments);
                take(place, Some(balls[points].iter().fold(Aabb::EMPTY, |all, ball| all.union(*ball))));
            }
            return;
        }
        for (triangle, place) in self.triangles().zip(0..) {
            let corners = triangle.map(|v| positions[v as usize]);
            take(place, (keeps_flat || has_area(corners)).then(|| Aabb::of_points(corners)));
        }
    }

    /// Its windows of strands.
    pub fn windows(&self) -> impl Iterator<Item = StoredWindow> + 'a {
        self.items.chunks_exact(size_of::<StoredWindow>()).map(pod_read_unaligned)
    }

    /// Radii of the positions of strands.
    pub fn radii(&self) -> impl Iterator<Item = f32> + 'a {
        self.radii.chunks_exact(size_of::<f32>()).map(pod_read_unaligned)
    }

    pub fn positions(&self) -> impl Iterator<Item = [f64; 3]> + 'a {
        let wide = self.head.flags & WIDE_POSITIONS != 0;
        self.positions.chunks_exact(if wide { 24 } else { 12 }).map(move |bytes| {
            if wide {
                pod_read_unaligned(bytes)
            } else {
                pod_read_unaligned::<[f32; 3]>(bytes).map(f64::from)
            }
        })
    }

    /// The same for blocks whose positions are those of the pack, which are f32.
    pub fn points(&self) -> impl Iterator<Item = Vec3> + 'a {
        self.positions().map(|p| Vec3::from_array(p.map(|x| x as f32)))
    }

    /// Corners of the triangles as places among the positions.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + 'a {
        let corners = self.items.chunks_exact(size_of::<[u16; 3]>());
        corners.map(|bytes| pod_read_unaligned::<[u16; 3]>(bytes).map(u32::from))
    }

    /// Quadrics of the positions; none if the mesh is as it was imported.
    pub fn quadrics(&self) -> impl Iterator<Item = StoredQuadric> + 'a {
        self.quadrics.chunks_exact(size_of::<StoredQuadric>()).map(pod_read_unaligned)
    }

    /// True if the mesh was simplified.
    pub fn is_simplified(&self) -> bool {
        self.head.flags & QUADRICS != 0
    }

    /// Number in the input of each triangle; none if ids are not kept.
    pub fn ids(&self) -> impl Iterator<Item = u64> + 'a {
        let first = self.head.first_id;
        self.places.chunks_exact(2).map(move |bytes| first + u64::from(pod_read_unaligned::<u16>(bytes)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Vec<u8> {
        of_triangles(&Contents {
            geometry: 1,
            first_id: 5,
            positions: &[Vec3::X, Vec3::Y, Vec3::Z],
            streams: Streams::NORMALS,
            attributes: &[7; 12],
            triangles: &[[2, 1, 0]],
            places: &[9],
            quadrics: &[StoredQuadric::default(); 3],
        })
    }

    #[test]
    fn blocks_come_back() {
        let mut batch = TriangleBatch {
            geometry: 7,
            positions: (0..1 << 16).map(|i| [f64::from(i), 0.5, -1.0]).collect(),
            triangles: vec![[0, 1, 2], [65_535, 5, 1]],
            first_triangle_id: 1 << 40,
            ..TriangleBatch::default()
        };
        let mut bytes = of_batch(&batch);
        batch.positions[3][0] = 0.1;
        batch.positions.truncate(9);
        batch.triangles.truncate(1);
        bytes.extend(of_batch(&batch));
        bytes.extend(triangle());
        let blocks: Vec<Block> = Block::all(&bytes).map(|b| b.unwrap()).collect();
        assert_eq!(blocks.len(), 3);
        assert_eq!(blocks[0].positions().nth(65_535), Some([65_535.0, 0.5, -1.0]));
        assert_eq!(blocks[0].triangles().collect::<Vec<_>>(), [[0, 1, 2], [65_535, 5, 1]]);
        assert_eq!(blocks[1].positions().nth(3), Some([0.1, 0.5, -1.0]));
        assert_eq!((blocks[1].geometry(), blocks[1].first_id(), blocks[1].ids().next()), (7, 1 << 40, None));
        assert_eq!(blocks[2].ids().collect::<Vec<_>>(), [14]);
        assert_eq!(blocks[2].triangles().next(), Some([2, 1, 0]));
        assert_eq!((blocks[2].streams(), blocks[2].attributes()), (Streams::NORMALS, &[7; 12][..]));
        assert_eq!(blocks.iter().map(|b| b.quadrics().count()).collect::<Vec<_>>(), [0, 0, 3]);
    }

    #[test]
    fn damage_is_found() {
        let bytes = triangle();
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            assert!(Block::all(&damaged).next().unwrap().is_err());
            assert!(at == 0 || Block::all(&bytes[..at]).next().unwrap().is_err());
        }
        assert!(Block::all(&[0; 256]).next().unwrap().is_err());
    }
}
