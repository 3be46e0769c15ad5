//! The hair format of Cem Yuksel (`.hair`): a header of 128 bytes, then arrays, each of which may be missing.
//!
//! | array | bit | a strand or point |
//! | --- | --- | --- |
//! | segments | 1 | u16 a strand; all have the same number where it is missing |
//! | points | 2 | f32 x 3 a point, one more than segments for each strand |
//! | thickness | 4 | f32 a point: the width |
//! | transparency | 8 | f32 a point |
//! | colors | 16 | f32 x 3 a point |
//!
//! Little-endian (<https://www.cemyuksel.com/research/hairmodels/>). Strands of a file are one geometry, so colors and
//! transparencies of points are averaged.

use crate::emit::Emitter;
use crate::map::Map;
use crate::survey::Survey;
use crate::{ImportError, Place, Result};
use raystrips_geom::scene::Material;
use std::ops::Range;
use std::path::Path;

const HEADER_BYTES: u64 = 128;
/// Bytes read between two reports of progress; their pages leave memory then.
const BYTES_BETWEEN: usize = 1 << 22;
/// What is sampled of colors and transparencies.
const SAMPLES: usize = 1 << 16;

/// Reads the file at `path` and says in words what it holds.
pub(crate) fn read(path: &Path, out: &mut Emitter) -> Result<String> {
    let map = Map::open(path)?;
    let file = HairFile::parse(path, &map)?;
    let width = match (out.strand_width(), &file.thickness) {
        (Some(width), _) => Some(width),
        (None, Some(_)) => None,
        (None, None) => Some(file.default_thickness()?),
    };
    let material = file.material(out);
    let material = out.material(material);
    let geometry = out.geometry("hair", material);
    let (mut point, mut short, mut last_tick) = (0, 0u64, 0);
    for strand in 0..file.strand_count {
        let count = file.segment_count(strand) + 1;
        if count > file.point_count - point {
            let what = format!("strand {strand} has more points than the file; export it again");
            return Err(ImportError::syntax(path, Place::Whole, what));
        }
        let radius = |i: usize| match (width, &file.thickness) {
            (None, Some(thickness)) => f64::from(file.float(thickness, i)) / 2.0,
            (width, _) => width.unwrap_or_default() / 2.0,
        };
        let points = (point..point + count).map(|i| (file.position(i), radius(i)));
        short += u64::from(count < 2);
        out.strand(geometry, points)?;
        point += count;
        if (point - last_tick) * 12 > BYTES_BETWEEN {
            last_tick = point;
            out.advance((map.len() as f64 * (point as f64 / file.point_count as f64)) as u64);
            map.release();
        }
    }
    if short > 0 {
        out.warn(path, format_args!("{short} strands of one point are left out"));
    }
    if point < file.point_count {
        out.warn(path, format_args!("{} points belong to no strand", file.point_count - point));
    }
    Ok(format!("it has {} strands of {} points", file.strand_count, file.point_count))
}

/// Tells what the file at `path` holds.
pub(crate) fn survey(path: &Path) -> Result<Survey> {
    let map = Map::open(path)?;
    let file = HairFile::parse(path, &map)?;
    Ok(Survey {
        instances: 0,
        bytes: map.len() as u64,
        triangles: file.point_count.saturating_sub(file.strand_count) as u64,
        vertices: file.point_count as u64,
        kept_vertices: 0,
        attributed_vertices: 0,
        is_exact: true,
    })
}

/// A file whose arrays are all there.
struct HairFile<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    strand_count: usize,
    point_count: usize,
    /// Where the arrays are.
    segments: Option<Range<usize>>,
    points: Range<usize>,
    thickness: Option<Range<usize>>,
    transparency: Option<Range<usize>>,
    colors: Option<Range<usize>>,
}

impl<'a> HairFile<'a> {
    fn parse(path: &'a Path, bytes: &'a [u8]) -> Result<HairFile<'a>> {
        let wrong = |what: String| ImportError::syntax(path, Place::Whole, what);
        if !bytes.starts_with(b"HAIR") {
            return Err(wrong("does not begin with 'HAIR'; give it the ending of its format".into()));
        }
        if (bytes.len() as u64) < HEADER_BYTES {
            return Err(wrong("is cut off within its header; copy it again".into()));
        }
        let field = |i: usize| u32::from_le_bytes([0, 1, 2, 3].map(|k| bytes[4 * i + k]));
        let (strands, points, arrays) = (u64::from(field(1)), u64::from(field(2)), field(3));
        let mut end = HEADER_BYTES;
        let mut array = |bit: u32, length: u64| {
            (arrays & bit != 0).then(|| {
                let begin = end;
                end += length;
                begin as usize..end as usize
            })
        };
        let segments = array(1, 2 * strands);
        let positions = array(2, 12 * points);
        let thickness = array(4, 4 * points);
        let transparency = array(8, 4 * points);
        let colors = array(16, 12 * points);
        if end > bytes.len() as u64 {
            let have = bytes.len();
            return Err(wrong(format!("is cut off: its header speaks of {end} bytes, it has {have}")));
        }
        let positions = positions.ok_or_else(|| wrong("has no points; export it with points".into()))?;
        if strands > points {
            return Err(wrong(format!("has {strands} strands but only {points} points; export it again")));
        }
        Ok(HairFile {
            path,
            bytes,
            strand_count: strands as usize,
            point_count: points as usize,
            segments,
            points: positions,
            thickness,
            transparency,
            colors,
        })
    }

    fn segment_count(&self, strand: usize) -> usize {
        match &self.segments {
            Some(segments) => {
                let at = segments.start + 2 * strand;
                u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]]).into()
            }
            None => u32::from_le_bytes([16, 17, 18, 19].map(|k| self.bytes[k])) as usize,
        }
    }

    /// Number `i` of an array of `f32`.
    fn float(&self, array: &Range<usize>, i: usize) -> f32 {
        let at = array.start + 4 * i;
        f32::from_le_bytes([0, 1, 2, 3].map(|k| self.bytes[at + k]))
    }

    fn position(&self, i: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis| f64::from(self.float(&self.points, 3 * i + axis)))
    }

    /// Number `i` of the floats of the header.
    fn default_float(&self, i: usize) -> f32 {
        self.float(&(20..40), i)
    }

    fn default_thickness(&self) -> Result<f64> {
        let thickness = f64::from(self.default_float(0));
        if thickness > 0.0 && thickness.is_finite() {
            return Ok(thickness);
        }
        let what = "does not say how wide its strands are; give it with --strand-width";
        Err(ImportError::syntax(self.path, Place::Byte(20), what))
    }

    /// The material of all strands.
    fn material(&self, out: &mut Emitter) -> Material {
        let share = |x: f32| if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.0 };
        let mean = |array: &Range<usize>, width: usize, k: usize| {
            let step = self.point_count.div_ceil(SAMPLES).max(1);
            let samples = (0..self.point_count).step_by(step);
            let count = samples.len().max(1) as f64;
            (samples.map(|i| f64::from(share(self.float(array, width * i + k)))).sum::<f64>() / count) as f32
        };
        if self.colors.is_some() || self.transparency.is_some() {
            out.warn(self.path, "colors and transparencies of points are averaged");
        }
        Material {
            name: "hair".into(),
            base_color: [0, 1, 2].map(|k| match &self.colors {
                Some(colors) => mean(colors, 3, k),
                None => share(self.default_float(2 + k)),
            }),
            alpha: 1.0
                - match &self.transparency {
                    Some(transparency) => mean(transparency, 1, 0),
                    None => share(self.default_float(1)),
                },
            ..Material::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{import_all_prefixes, import_bytes};

    /// Strands with these numbers of segments, with all arrays but those of `without`.
    fn hair(segments: &[u16], without: u32) -> Vec<u8> {
        let points: u32 = segments.iter().map(|&count| u32::from(count) + 1).sum();
        let arrays = 31 & !without;
        let mut bytes = b"HAIR".to_vec();
        for number in [segments.len() as u32, points, arrays, 2] {
            bytes.extend(number.to_le_bytes());
        }
        for float in [0.5f32, 0.25, 1.0, 0.5, 0.0] {
            bytes.extend(float.to_le_bytes());
        }
        bytes.resize(HEADER_BYTES as usize, 0);
        if arrays & 1 != 0 {
            bytes.extend(segments.iter().flat_map(|count| count.to_le_bytes()));
        }
        let mut array = |bit: u32, values: Vec<f32>| {
            if arrays & bit != 0 {
                bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
            }
        };
        array(2, (0..3 * points).map(|i| i as f32).collect());
        array(4, vec![0.2; points as usize]);
        array(8, (0..points).map(|i| if i % 2 == 0 { 0.0 } else { 1.0 }).collect());
        array(16, vec![0.25; 3 * points as usize]);
        bytes
    }

    #[test]
    fn all_arrays_are_read() {
        let (done, sink) = import_bytes("a.hair", &hair(&[3, 1], 0)).unwrap();
        let [batch] = &sink.1[..] else { panic!("{} batches", sink.1.len()) };
        assert_eq!((&batch.lengths[..], batch.first_segment_id), (&[4, 2][..], 0));
        assert_eq!(batch.positions[5], [15.0, 16.0, 17.0]);
        assert_eq!(batch.radii, [0.1; 6]);
        assert_eq!(done.report.segments, 4);
        let material = &done.scene.materials[0];
        assert_eq!((material.base_color, material.alpha), ([0.25; 3], 0.5));
    }

    #[test]
    fn the_header_stands_for_what_is_missing() {
        let (done, sink) = import_bytes("a.hair", &hair(&[2, 2], 1 | 4 | 8 | 16)).unwrap();
        let batch = &sink.1[0];
        assert_eq!((&batch.lengths[..], batch.radii[0]), (&[3, 3][..], 0.25));
        let material = &done.scene.materials[0];
        assert_eq!((material.base_color, material.alpha), ([1.0, 0.5, 0.0], 0.75));
        assert!(done.report.warnings.is_empty());
    }

    #[test]
    fn broken_files_are_refused_in_one_line() {
        import_all_prefixes("a.hair", &hair(&[3, 1], 0));
        let message = |bytes: &[u8]| import_bytes("a.hair", bytes).unwrap_err().to_string();
        assert!(message(&hair(&[2, 2], 2)).contains("no points"));
        let mut bytes = hair(&[3, 1], 0);
        bytes[128] = 9;
        assert!(message(&bytes).contains("more points than the file"));
        bytes = hair(&[2, 2], 1 | 4);
        bytes[20..24].copy_from_slice(&0f32.to_le_bytes());
        assert!(message(&bytes).contains("--strand-width"));
        bytes[4..8].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(message(&bytes).contains("strands but only"));
    }

    #[test]
    fn strands_that_are_not_finite_are_dropped_and_counted() {
        let mut bytes = hair(&[2, 2], 1 | 4 | 8 | 16);
        bytes[128..132].copy_from_slice(&f32::NAN.to_le_bytes());
        let (done, sink) = import_bytes("a.hair", &bytes).unwrap();
        assert_eq!((done.report.segments, done.report.dropped.non_finite), (2, 2));
        assert_eq!(sink.1[0].first_segment_id, 2);
    }
}
