//! PLY, the polygon file format, in all three encodings.
//!
//! The file is mapped. In binary files vertices stay where they are and are decoded whenever a face names them, so
//! that memory does not grow with the file; only those of text, and those with lists among their properties, are kept
//! apart. Elements may come in any order with any properties; colors of vertices are read, those that do not matter are
//! skipped.

mod colors;
mod header;
mod survey;
mod values;
mod vertices;

pub(crate) use survey::survey;

use crate::emit::{Emitter, Vertices, check_corners};
use crate::kept::Kept;
use crate::map::Map;
use crate::{ImportError, Place, Result};
use colors::colors;
use header::{Element, Encoding, Header, Kind, Scalar};
use raystrips_geom::Streams;
use std::path::Path;
use values::{Binary, Missing, Text, Value, Values};
use vertices::{Mapped, PlyVertices, RowLayout};

/// Bytes read between two reports of progress; their pages leave memory then.
const BYTES_BETWEEN: usize = 1 << 21;

/// Reads the file at `path` and says in words what it holds.
pub(crate) fn read(path: &Path, out: &mut Emitter) -> Result<String> {
    let map = Map::open(path)?;
    let header = Header::parse(path, &map)?;
    let mut reader =
        Reader { path, map: &map, header: &header, out, last_tick: 0, corners: Vec::new(), small_faces: 0 };
    match header.encoding {
        Encoding::Ascii => reader.body(Text::new(&map, header.bytes))?,
        Encoding::LittleEndian => reader.body(Binary::<false>::new(&map, header.bytes))?,
        Encoding::BigEndian => reader.body(Binary::<true>::new(&map, header.bytes))?,
    }
    if reader.small_faces > 0 {
        let count = reader.small_faces;
        reader.out.warn(path, format_args!("{count} faces with less than three corners are left out"));
    }
    let elements: Vec<_> =
        header.elements.iter().map(|e| format!("{} rows of '{}'", e.count, e.name)).collect();
    Ok(if elements.is_empty() {
        "it has no elements".into()
    } else {
        format!("it has {}", elements.join(", "))
    })
}

struct Reader<'a, 'b> {
    path: &'a Path,
    map: &'a Map,
    header: &'a Header,
    out: &'a mut Emitter<'b>,
    /// Where in the file the last tick was.
    last_tick: usize,
    corners: Vec<u32>,
    small_faces: u64,
}

impl<'a> Reader<'a, '_> {
    fn body<V: Values>(&mut self, mut values: V) -> Result<()> {
        let mut vertices = None;
        let mut before_vertices = Vec::new();
        let header = self.header;
        for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
            check_count(self.path, header.encoding, element, values.bytes_left(), || values.place())?;
            match (element.name.as_str(), &vertices) {
                ("vertex", None) => vertices = Some(self.vertices(element, &mut values)?),
                ("vertex", Some(_)) => {
                    return Err(element_error(self.path, element, "comes twice; export again"));
                }
                ("face" | "tristrips", Some(vertices)) => self.faces(element, &mut values, vertices)?,
                ("face" | "tristrips", None) => {
                    before_vertices.push((element, values.clone()));
                    self.skip(element, &mut values)?;
                }
                _ => self.skip(element, &mut values)?,
            }
        }
        let vertices = vertices.unwrap_or_else(|| PlyVertices::none(self.out.options));
        before_vertices
            .into_iter()
            .try_for_each(|(element, mut values)| self.faces(element, &mut values, &vertices))
    }

    fn vertices<V: Values>(&mut self, element: &Element, values: &mut V) -> Result<PlyVertices<'a>> {
        let axes = axes(self.path, element)?;
        let colors = if self.out.wants_colors() { colors(element) } else { None };
        if let (Some(stride), true) = (element.row_bytes(), is_in_place(element, self.header.encoding)) {
            let start = values.at();
            self.skip(element, values)?;
            let in_row = |(property, scalar)| (row_offset(element, property), scalar);
            let layout = RowLayout {
                stride,
                axes: axes.map(in_row),
                colors: colors.map(|colors| colors.map(in_row)),
                big_endian: self.header.encoding == Encoding::BigEndian,
            };
            let memory = self.out.options.kept_bytes;
            let mapped = Mapped::new(self.path, self.map, start..values.at(), layout, memory)?;
            return Ok(PlyVertices::Mapped(mapped));
        }
        let options = self.out.options;
        let part = if colors.is_some() { options.kept_bytes / 2 } else { 0 };
        let mut positions = Kept::new(options, options.kept_bytes - part);
        let scalars = colors.map(|colors| colors.map(|(_, scalar)| scalar));
        let mut kept_colors = scalars.map(|scalars| (Kept::beside(options, part), scalars));
        let wanted: Vec<_> =
            axes.iter().chain(colors.iter().flatten()).map(|&(property, _)| property).collect();
        let mut numbers = [0.0; 6];
        for row in 0..element.count {
            row_numbers(element, values, &wanted, &mut numbers)
                .map_err(|missing| self.row_error(values, missing, element, row))?;
            let [x, y, z, red, green, blue] = numbers;
            positions.push([x, y, z])?;
            if let Some((colors, _)) = &mut kept_colors {
                colors.push([red, green, blue])?;
            }
            self.tick(values);
        }
        Ok(PlyVertices::Kept { positions, colors: kept_colors })
    }

    fn faces<V: Values>(&mut self, element: &Element, values: &mut V, vertices: &PlyVertices) -> Result<()> {
        if element.count == 0 {
            return Ok(());
        }
        let indices = index_list(self.path, element)?;
        let material = self.out.default_material(vertices.streams().has(Streams::COLORS));
        let geometry = self.out.geometry("", material);
        for row in 0..element.count {
            for (i, property) in element.properties.iter().enumerate() {
                match property.kind {
                    Kind::List { count, item } if i == indices => {
                        let length = list_length(values, count);
                        let length =
                            length.map_err(|missing| self.row_error(values, missing, element, row))?;
                        if element.name == "face" {
                            self.face(geometry, element, values, vertices, (row, length, item))?;
                        } else {
                            self.strip(geometry, element, values, vertices, (row, length, item))?;
                        }
                    }
                    kind => skip_value(values, kind)
                        .map_err(|missing| self.row_error(values, missing, element, row))?,
                }
            }
            self.tick(values);
        }
        Ok(())
    }

    #[inline]
    fn face<V: Values>(
        &mut self,
        geometry: u32,
        element: &Element,
        values: &mut V,
        vertices: &PlyVertices,
        (row, length, item): (u64, u64, Scalar),
    ) -> Result<()> {
        let start = values.clone();
        // Nearly all faces of large files; what is odd about others is found below.
        if length == 3
            && let Some([a, b, c]) = values.triangle(item)
        {
            return self.out.polygon(geometry, vertices, &[a, b, c], self.path, || start.place());
        }
        *values = start.clone();
        check_corners(length.min(values.bytes_left()), self.path, || start.place())?;
        self.corners.clear();
        let impossible = values.indices(item, length, &mut self.corners);
        let impossible = impossible.map_err(|missing| self.row_error(values, missing, element, row))?;
        if length < 3 {
            self.small_faces += 1;
            return Ok(());
        }
        if let Some(index) = impossible {
            return self.out.out_of_range(length - 2, self.path, || start.place(), index, vertices.count());
        }
        self.out.polygon(geometry, vertices, &self.corners, self.path, || start.place())
    }

    /// A row of triangle strips, separated by -1. Every other triangle of a strip is turned; those that only lead
    /// from one strip to the next, naming a vertex twice, are left out.
    fn strip<V: Values>(
        &mut self,
        geometry: u32,
        element: &Element,
        values: &mut V,
        vertices: &PlyVertices,
        (row, length, item): (u64, u64, Scalar),
    ) -> Result<()> {
        let (mut a, mut b, mut position) = (0, 0, 0u64);
        for _ in 0..length {
            let start = values.clone();
            let index =
                values.integer(item).map_err(|missing| self.row_error(values, missing, element, row))?;
            if index == -1 {
                position = 0;
                continue;
            }
            let Ok(c) = u32::try_from(index) else {
                self.out.out_of_range(1, self.path, || start.place(), index, vertices.count())?;
                position = 0;
                continue;
            };
            if position >= 2 && a != b && b != c && a != c {
                let corners = if position % 2 == 0 { [a, b, c] } else { [b, a, c] };
                self.out.polygon(geometry, vertices, &corners, self.path, || start.place())?;
            }
            (a, b) = (b, c);
            position += 1;
            self.tick(values);
        }
        Ok(())
    }

    fn skip<V: Values>(&mut self, element: &Element, values: &mut V) -> Result<()> {
        if let (Some(row_bytes), true) = (element.row_bytes(), self.header.encoding != Encoding::Ascii) {
            let skipped = values.skip(Scalar::U8, element.count * row_bytes as u64);
            return skipped.map_err(|missing| self.row_error(values, missing, element, 0));
        }
        for row in 0..element.count {
            for property in &element.properties {
                skip_value(values, property.kind)
                    .map_err(|missing| self.row_error(values, missing, element, row))?;
            }
            self.tick(values);
        }
        Ok(())
    }

    #[cold]
    fn row_error(&self, values: &impl Values, missing: Missing, element: &Element, row: u64) -> ImportError {
        values::error(self.path, values, missing, &element.name, row)
    }

    /// Called after each row and wherever much is read at once.
    #[inline]
    fn tick(&mut self, values: &impl Values) {
        if values.at().abs_diff(self.last_tick) >= BYTES_BETWEEN {
            self.move_on(values.at());
        }
    }

    #[cold]
    fn move_on(&mut self, at: usize) {
        // Empty after a step back, to faces that come before the vertices.
        self.map.release_range(self.last_tick..at);
        self.last_tick = at;
        self.out.advance(at as u64);
    }
}

/// A count that the rest of the file cannot hold is refused before anything is done with it.
fn check_count(
    path: &Path,
    encoding: Encoding,
    element: &Element,
    bytes_left: u64,
    place: impl FnOnce() -> Place,
) -> Result<()> {
    let least = element.count.checked_mul(element.min_row_bytes(encoding));
    if least.is_some_and(|least| least <= bytes_left) {
        return Ok(());
    }
    let what = format!(
        "element '{}' has {} rows, which the {bytes_left} bytes left cannot hold; the file is cut off, get it again",
        element.name, element.count
    );
    Err(ImportError::syntax(path, place(), what))
}

fn element_error(path: &Path, element: &Element, what: &str) -> ImportError {
    ImportError::syntax(path, Place::Whole, format_args!("element '{}' {what}", element.name))
}

/// Which properties are x, y and z, and their types.
fn axes(path: &Path, element: &Element) -> Result<[(usize, Scalar); 3]> {
    let mut axes = [(0, Scalar::F32); 3];
    for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
        let property = element.find(&[name]);
        *axis = match property.map(|property| (property, element.properties[property].kind)) {
            Some((property, Kind::Scalar(scalar))) => (property, scalar),
            _ => return Err(element_error(path, element, "lacks x, y or z; export it with positions")),
        };
    }
    Ok(axes)
}

/// Which property of faces or strips lists their vertices.
fn index_list(path: &Path, element: &Element) -> Result<usize> {
    element
        .find(&["vertex_indices", "vertex_index"])
        .filter(|&i| matches!(element.properties[i].kind, Kind::List { .. }))
        .ok_or_else(|| element_error(path, element, "lacks the list vertex_indices; export it with faces"))
}

/// True if vertices can be decoded where they are in the file.
fn is_in_place(element: &Element, encoding: Encoding) -> bool {
    encoding != Encoding::Ascii && element.row_bytes().is_some()
}

/// Reads a row and puts the properties `wanted` into `numbers`.
fn row_numbers(
    element: &Element,
    values: &mut impl Values,
    wanted: &[usize],
    numbers: &mut [f64; 6],
) -> Value<()> {
    for (i, property) in element.properties.iter().enumerate() {
        match (property.kind, wanted.iter().position(|&wanted| wanted == i)) {
            (Kind::Scalar(scalar), Some(place)) => numbers[place] = values.number(scalar)?,
            (kind, _) => skip_value(values, kind)?,
        }
    }
    Ok(())
}

#[inline]
fn list_length(values: &mut impl Values, count: Scalar) -> Value<u64> {
    let length = values.integer(count)?;
    u64::try_from(length).map_err(|_| Missing::NegativeLength)
}

#[inline]
fn skip_value(values: &mut impl Values, kind: Kind) -> Value<()> {
    match kind {
        Kind::Scalar(scalar) => values.skip(scalar, 1),
        Kind::List { count, item } => {
            let length = list_length(values, count)?;
            values.skip(item, length)
        }
    }
}

fn row_offset(element: &Element, property: usize) -> usize {
    let bytes = |kind| if let Kind::Scalar(scalar) = kind { scalar.bytes() } else { 0 };
    element.properties[..property].iter().map(|property| bytes(property.kind)).sum()
}

#[cfg(test)]
mod tests;
