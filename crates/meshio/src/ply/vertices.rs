//! Vertices of a PLY file: decoded in place whenever they are asked for, or kept.

use super::header::Scalar;
use super::values::decode;
use crate::emit::Vertices;
use crate::kept::Kept;
use crate::map::{Map, open_regular, read_at};
use crate::resident::Resident;
use crate::{ImportError, Result};
use std::fs::File;
use std::ops::Range;
use std::path::Path;

/// Bytes of the longest rows that are read without the map; others are longer than any program writes.
const MAX_ROW_BESIDE: usize = 1 << 10;

pub(super) enum PlyVertices<'a> {
    Mapped(Mapped<'a>),
    Kept(Kept),
}

/// Vertices of a binary file, in place.
pub(super) struct Mapped<'a> {
    map: &'a Map,
    /// The same once more, for reading without the map.
    file: File,
    rows: &'a [u8],
    resident: Resident,
    /// Where the rows are in the map.
    range: Range<usize>,
    layout: RowLayout,
}

/// How rows that are all alike are laid out.
pub(super) struct RowLayout {
    pub stride: usize,
    /// For x, y and z the offset in the row.
    pub axes: [(usize, Scalar); 3],
    pub big_endian: bool,
}

impl<'a> Mapped<'a> {
    /// The rows in `range` of the file at `path`, of which about `memory` bytes may be in memory.
    pub fn new(
        path: &Path,
        map: &'a Map,
        range: Range<usize>,
        layout: RowLayout,
        memory: u64,
    ) -> Result<Mapped<'a>> {
        let file = open_regular(path).map_err(|e| ImportError::io(path, e))?;
        let rows = &map[range.clone()];
        Ok(Mapped { map, file, rows, resident: Resident::new(rows, memory), range, layout })
    }

    #[inline]
    fn position(&self, index: u32) -> [f64; 3] {
        let offset = index as usize * self.layout.stride;
        if self.resident.touch(offset) {
            self.decode(&self.rows[offset..][..self.layout.stride])
        } else {
            self.position_beside(offset)
        }
    }

    #[inline]
    fn decode(&self, row: &[u8]) -> [f64; 3] {
        // Rows are whole: `check_count` and `skip` saw to that.
        let RowLayout { axes, big_endian, .. } = &self.layout;
        let axis = |i: usize| decode(axes[i].1, &row[axes[i].0..], *big_endian).unwrap_or(f64::NAN);
        [axis(0), axis(1), axis(2)]
    }

    /// Reads a vertex whose block does not fit into memory.
    #[cold]
    fn position_beside(&self, offset: usize) -> [f64; 3] {
        if self.resident.is_stale() {
            self.release();
        }
        let mut bytes = [0; MAX_ROW_BESIDE];
        if let Some(row) = bytes.get_mut(..self.layout.stride)
            && read_at(&self.file, (self.range.start + offset) as u64, row).is_ok()
        {
            return self.decode(row);
        }
        self.release();
        self.resident.touch(offset);
        self.decode(&self.rows[offset..][..self.layout.stride])
    }

    fn release(&self) {
        self.map.release_range(self.range.clone());
        self.resident.clear();
    }
}

impl Vertices for PlyVertices<'_> {
    #[inline]
    fn count(&self) -> u64 {
        match self {
            PlyVertices::Mapped(mapped) => (mapped.rows.len() / mapped.layout.stride) as u64,
            PlyVertices::Kept(kept) => kept.count(),
        }
    }

    #[inline]
    fn position(&self, index: u32) -> [f64; 3] {
        match self {
            PlyVertices::Mapped(mapped) => mapped.position(index),
            PlyVertices::Kept(kept) => kept.position(index),
        }
    }

    fn release(&self) {
        match self {
            PlyVertices::Mapped(mapped) => mapped.release(),
            PlyVertices::Kept(kept) => kept.release(),
        }
    }
}
