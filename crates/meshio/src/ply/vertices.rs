//! Vertices of a PLY file: decoded in place whenever they are asked for, or kept.

use super::colors;
use super::header::Scalar;
use super::values::decode;
use crate::emit::Vertices;
use crate::kept::Kept;
use crate::map::{Map, open_regular, read_at};
use crate::resident::Resident;
use crate::{ImportError, ImportOptions, Result};
use raystrips_geom::{Attributes, Streams};
use std::fs::File;
use std::ops::Range;
use std::path::Path;

/// Bytes of the longest rows that are read without the map; others are longer than any program writes.
const MAX_ROW_BESIDE: usize = 1 << 10;

pub(super) enum PlyVertices<'a> {
    Mapped(Mapped<'a>),
    Kept { positions: Kept, colors: Option<(Kept, [Scalar; 3])> },
}

impl PlyVertices<'_> {
    pub fn none(options: &ImportOptions) -> Self {
        PlyVertices::Kept { positions: Kept::new(options, 0), colors: None }
    }
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
    /// The same for red, green and blue.
    pub colors: Option<[(usize, Scalar); 3]>,
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

    /// What three numbers of a row are.
    #[inline]
    fn numbers(&self, index: u32, places: &[(usize, Scalar); 3]) -> [f64; 3] {
        let offset = index as usize * self.layout.stride;
        if self.resident.touch(offset) {
            self.decode(&self.rows[offset..][..self.layout.stride], places)
        } else {
            self.numbers_beside(offset, places)
        }
    }

    #[inline]
    fn decode(&self, row: &[u8], places: &[(usize, Scalar); 3]) -> [f64; 3] {
        // Rows are whole: `check_count` and `skip` saw to that.
        let big_endian = self.layout.big_endian;
        places.map(|(offset, scalar)| decode(scalar, &row[offset..], big_endian).unwrap_or(f64::NAN))
    }

    /// Reads a vertex whose block does not fit into memory.
    #[cold]
    fn numbers_beside(&self, offset: usize, places: &[(usize, Scalar); 3]) -> [f64; 3] {
        if self.resident.is_stale() {
            self.release();
        }
        let mut bytes = [0; MAX_ROW_BESIDE];
        if let Some(row) = bytes.get_mut(..self.layout.stride)
            && read_at(&self.file, (self.range.start + offset) as u64, row).is_ok()
        {
            return self.decode(row, places);
        }
        self.release();
        self.resident.touch(offset);
        self.decode(&self.rows[offset..][..self.layout.stride], places)
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
            PlyVertices::Kept { positions, .. } => positions.count(),
        }
    }

    #[inline]
    fn position(&self, index: u32) -> [f64; 3] {
        match self {
            PlyVertices::Mapped(mapped) => mapped.numbers(index, &mapped.layout.axes),
            PlyVertices::Kept { positions, .. } => positions.position(index),
        }
    }

    fn release(&self) {
        match self {
            PlyVertices::Mapped(mapped) => mapped.release(),
            PlyVertices::Kept { positions, colors } => {
                positions.release();
                colors.iter().for_each(|(colors, _)| colors.release());
            }
        }
    }

    fn streams(&self) -> Streams {
        let has_colors = match self {
            PlyVertices::Mapped(mapped) => mapped.layout.colors.is_some(),
            PlyVertices::Kept { colors, .. } => colors.is_some(),
        };
        if has_colors { Streams::COLORS } else { Streams::NONE }
    }

    fn attributes(&self, _place: usize, index: u32) -> Attributes {
        let (numbers, scalars) = match self {
            PlyVertices::Mapped(mapped) => match &mapped.layout.colors {
                Some(places) => (mapped.numbers(index, places), places.map(|(_, scalar)| scalar)),
                None => return Attributes::default(),
            },
            PlyVertices::Kept { colors: Some((colors, scalars)), .. } => (colors.position(index), *scalars),
            PlyVertices::Kept { colors: None, .. } => return Attributes::default(),
        };
        colors::attributes(numbers, scalars)
    }
}
