//! What an OBJ file holds, estimated from samples all over it: vertices often come first and faces last.

use super::{Statement, refuse_other_encodings};
use crate::map::open_regular;
use crate::number::words;
use crate::survey::Survey;
use crate::{ImportError, ImportOptions, Result};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Together a megabyte, which is read in some milliseconds.
const SAMPLES: u64 = 64;
const SAMPLE_BYTES: u64 = 1 << 14;

/// Sums over whole lines.
#[derive(Default)]
struct Counts {
    bytes: u64,
    vertices: u64,
    tex_coords: u64,
    normals: u64,
    colors: u64,
    triangles: u64,
}

/// Estimates what the file at `path` holds.
pub(crate) fn survey(path: &Path, options: &ImportOptions) -> Result<Survey> {
    let io = |error| ImportError::io(path, error);
    let mut file = open_regular(path).map_err(io)?;
    let bytes = file.metadata().map_err(io)?.len();
    // A small file is one sample.
    let (count, length) = if bytes <= SAMPLES * SAMPLE_BYTES { (1, bytes) } else { (SAMPLES, SAMPLE_BYTES) };
    let first = read(&mut file, 0, length).map_err(io)?;
    refuse_other_encodings(path, &first)?;
    let separator = if !first.contains(&b'\n') && first.contains(&b'\r') { b'\r' } else { b'\n' };
    let mut counts = Counts::default();
    counts.add(&first, separator, true, length == bytes);
    let step = (bytes - length) / (count - 1).max(1);
    for i in 1..count {
        let sample = read(&mut file, i * step, length).map_err(io)?;
        counts.add(&sample, separator, false, false);
    }
    let scaled = |count: u64| match counts.bytes {
        0 => 0,
        sampled => (u128::from(count) * u128::from(bytes) / u128::from(sampled)) as u64,
    };
    let vertices = scaled(counts.vertices);
    let triangles = scaled(counts.triangles);
    let [tex_coords, normals, colors] = match options.bare {
        true => [0; 3],
        false => [counts.tex_coords, counts.normals, counts.colors].map(scaled),
    };
    Ok(Survey {
        instances: 0,
        bytes,
        triangles,
        vertices,
        kept_vertices: vertices + tex_coords + normals + colors,
        attributed_vertices: tex_coords.max(normals).max(colors),
        is_exact: false,
    })
}

fn read(file: &mut File, start: u64, length: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(start))?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

impl Counts {
    /// Adds the whole lines of a sample, which may begin and end within others.
    fn add(&mut self, sample: &[u8], separator: u8, begins_whole: bool, ends_whole: bool) {
        let start = if begins_whole { Some(0) } else { memchr::memchr(separator, sample).map(|at| at + 1) };
        let end = if ends_whole { Some(sample.len()) } else { memchr::memrchr(separator, sample) };
        let Some(lines) = start.zip(end).and_then(|(start, end)| sample.get(start..end)) else { return };
        self.bytes += lines.len() as u64 + u64::from(!ends_whole);
        for line in lines.split(|&c| c == separator) {
            let statement = Statement::of(line);
            match statement.keyword {
                b"v" => {
                    self.vertices += 1;
                    self.colors += u64::from(words(statement.rest).nth(5).is_some());
                }
                b"vt" => self.tex_coords += 1,
                b"vn" => self.normals += 1,
                b"f" => {
                    let corners = words(statement.rest).take_while(|word| !word.starts_with(b"#")).count();
                    self.triangles += corners.saturating_sub(2) as u64;
                }
                _ => {}
            }
        }
    }
}
