//! What a PLY file holds, told from its header, and from its length where faces may have more than three corners.

use super::colors::colors;
use super::header::{Element, Encoding, Header, Kind};
use super::values::{Text, Values};
use super::{axes, check_count, element_error, index_list, is_in_place};
use crate::map::Map;
use crate::number::{parse_i64, words};
use crate::survey::Survey;
use crate::{ImportOptions, Place, Result};
use std::path::Path;

/// The end of a text, as a sample of its faces.
const SAMPLE_BYTES: usize = 1 << 16;

/// Tells what the file at `path` holds.
pub(crate) fn survey(path: &Path, options: &ImportOptions) -> Result<Survey> {
    let map = Map::open(path)?;
    let header = Header::parse(path, &map)?;
    let mut survey = Survey { is_exact: true, bytes: map.len() as u64, ..Survey::default() };
    let mut bytes_left = (map.len() - header.bytes) as u64;
    let mut has_vertices = false;
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        let place = || match header.encoding {
            Encoding::Ascii => Text::new(&map, header.bytes).place(),
            _ => Place::Byte(map.len() as u64 - bytes_left),
        };
        check_count(path, header.encoding, element, bytes_left, place)?;
        bytes_left -= element.count * element.min_row_bytes(header.encoding);
        match element.name.as_str() {
            "vertex" if has_vertices => {
                return Err(element_error(path, element, "comes twice; export again"));
            }
            "vertex" => {
                axes(path, element)?;
                has_vertices = true;
                survey.vertices = element.count;
                let has_colors = !options.bare && colors(element).is_some();
                let colored = if has_colors { element.count } else { 0 };
                survey.attributed_vertices = colored;
                let is_kept = !is_in_place(element, header.encoding);
                survey.kept_vertices = if is_kept { element.count.saturating_add(colored) } else { 0 };
            }
            "face" | "tristrips" if element.count > 0 => {
                let indices = index_list(path, element)?;
                let corners = corners(&header, element, indices, &map);
                let triangles = corners.map_or(element.count, |corners| corners - 2 * element.count);
                let is_exact = element.name == "face" && corners == Some(3 * element.count);
                survey.triangles = survey.triangles.saturating_add(triangles);
                survey.is_exact &= is_exact && header.encoding != Encoding::Ascii;
            }
            _ => {}
        }
    }
    Ok(survey)
}

/// How many corners all rows of `element` have, if that can be told; not less than three each.
fn corners(header: &Header, element: &Element, indices: usize, file: &[u8]) -> Option<u64> {
    let corners = match header.encoding {
        Encoding::Ascii if element.name == "face" => corners_of_text(header, element, indices, file),
        Encoding::Ascii => None,
        _ => corners_by_length(header, element, indices, file),
    };
    corners.filter(|&corners| element.count.checked_mul(3).is_some_and(|least| corners >= least))
}

/// What all else in a binary file leaves over, if all else has a length that is known.
fn corners_by_length(header: &Header, element: &Element, indices: usize, file: &[u8]) -> Option<u64> {
    let mut left = (file.len() - header.bytes) as u64;
    for other in header.elements.iter().filter(|&other| !std::ptr::eq(other, element)) {
        left = left.checked_sub(other.count.checked_mul(other.row_bytes()? as u64)?)?;
    }
    let mut item_bytes = 0;
    for (i, property) in element.properties.iter().enumerate() {
        let row_bytes = match property.kind {
            Kind::Scalar(scalar) => scalar.bytes(),
            Kind::List { count, item } if i == indices => {
                item_bytes = item.bytes() as u64;
                count.bytes()
            }
            Kind::List { .. } => return None,
        };
        left = left.checked_sub(element.count.checked_mul(row_bytes as u64)?)?;
    }
    left.checked_div(item_bytes)
}

/// As many for each face as the last faces of the file have, if there is a face to a line.
fn corners_of_text(header: &Header, element: &Element, indices: usize, file: &[u8]) -> Option<u64> {
    if indices != 0 || !header.elements.last().is_some_and(|last| std::ptr::eq(last, element)) {
        return None;
    }
    let start = file.len().saturating_sub(SAMPLE_BYTES).max(header.bytes);
    let lines = file[start..].rsplit(|c| matches!(c, b'\n' | b'\r')).filter(|line| !line.is_empty());
    let (mut sum, mut count) = (0u64, 0u64);
    // The lines before the faces are vertices; half a line at the start of the sample does little harm.
    for line in lines.take(usize::try_from(element.count).unwrap_or(usize::MAX)) {
        let length = parse_i64(words(line).next()?)?;
        if words(line).count() as i64 > length {
            (sum, count) = (sum.checked_add(u64::try_from(length).ok()?)?, count + 1);
        }
    }
    u64::try_from(u128::from(element.count) * u128::from(sum) / u128::from(count.max(1))).ok()
}
