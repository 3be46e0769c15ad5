//! A Ray-Strip in memory (paper, Figure 5): two bytes of length, then the nodes of its tree at nine bytes, then the
//! vertices of the strip. Where anything is follows from the length.

use super::traverse::Part;
use super::tree::{LEAF_TRIANGLES, Split, units};

/// Bytes of the length.
const HEADER_BYTES: usize = 2;
/// Bytes of a node: two planes, and axis and order in a byte.
pub const NODE_BYTES: usize = 9;
/// Set in the byte of a node whose left half is the second of the strip.
const REVERSE: u8 = 4;

/// Writes strips one behind the other.
#[derive(Default)]
pub struct RecordWriter {
    bytes: Vec<u8>,
}

impl RecordWriter {
    /// Appends a strip and gives its place.
    pub fn push(&mut self, tree: &[Split], strip: &[u32]) -> u32 {
        let place = u32::try_from(self.bytes.len()).expect("the strips of a mesh fill less than 4 GiB");
        let triangles = u16::try_from(strip.len() - 2).expect("strips are shorter than 65,536 triangles");
        self.bytes.extend(triangles.to_le_bytes());
        for node in tree {
            self.bytes.extend(node.left_max.to_le_bytes());
            self.bytes.extend(node.right_min.to_le_bytes());
            self.bytes.push(node.axis | if node.reverse { REVERSE } else { 0 });
        }
        self.bytes.extend(strip.iter().flat_map(|v| v.to_le_bytes()));
        place
    }

    /// All strips.
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.shrink_to_fit();
        self.bytes
    }
}

/// A strip among others.
#[derive(Clone, Copy)]
pub struct StripRecord<'a> {
    place: u32,
    triangles: usize,
    nodes: &'a [[u8; NODE_BYTES]],
    vertices: &'a [[u8; 4]],
}

impl<'a> StripRecord<'a> {
    /// The strip at `place`.
    #[inline]
    pub fn at(records: &'a [u8], place: usize) -> StripRecord<'a> {
        let record = &records[place..];
        let triangles = usize::from(u16::from_le_bytes([record[0], record[1]]));
        let (nodes, rest) = record[HEADER_BYTES..].split_at((units(triangles) - 1) * NODE_BYTES);
        let vertices = &rest[..(triangles + 2) * 4];
        StripRecord {
            place: place as u32,
            triangles,
            nodes: nodes.as_chunks().0,
            vertices: vertices.as_chunks().0,
        }
    }

    /// All of the strip, for a ray that is inside its box between the given distances.
    #[inline]
    pub fn whole(&self, (tnear, tfar): (f32, f32)) -> Part {
        Part { node: 0, first: 0, units: units(self.triangles) as u32, tnear, tfar }
    }

    /// Leaves of the strip.
    #[inline]
    pub fn units(&self) -> u32 {
        units(self.triangles) as u32
    }

    /// Node `i`.
    #[inline]
    pub fn node(&self, i: u32) -> Split {
        let [a, b, c, d, e, f, g, h, flags] = self.nodes[i as usize];
        Split {
            left_max: f32::from_le_bytes([a, b, c, d]),
            right_min: f32::from_le_bytes([e, f, g, h]),
            axis: flags & 3,
            reverse: flags & REVERSE != 0,
        }
    }

    /// The vertices of leaf `unit` and how many of its two triangles there are; the last vertex of a leaf with one
    /// triangle is repeated.
    #[inline]
    pub fn leaf(&self, unit: u32) -> ([u32; 4], u32) {
        let first = unit as usize * LEAF_TRIANGLES;
        let vertex = |i: usize| u32::from_le_bytes(self.vertices[i]);
        let last = self.triangles + 1;
        let vertices = [vertex(first), vertex(first + 1), vertex(first + 2), vertex((first + 3).min(last))];
        (vertices, if first + 3 > last { 1 } else { 2 })
    }

    /// All vertices.
    #[cfg(test)]
    pub fn vertices(&self) -> Vec<u32> {
        self.vertices.iter().map(|&v| u32::from_le_bytes(v)).collect()
    }

    /// Bytes of the record.
    #[cfg(test)]
    pub fn bytes(&self) -> usize {
        HEADER_BYTES + size_of_val(self.nodes) + size_of_val(self.vertices)
    }

    /// Number of the first triangle of leaf `unit`, unlike all others of the mesh.
    #[inline]
    pub fn prim_id(&self, unit: u32) -> u64 {
        (u64::from(self.place) << 16) + u64::from(unit) * LEAF_TRIANGLES as u64
    }
}
