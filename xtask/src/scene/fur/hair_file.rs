//! Files in the hair format of Cem Yuksel, written as a stream: strands of as many segments each.

use super::coat::{POINTS, SEGMENTS};
use crate::output::{rename, temporary};
use anyhow::{Context, Result};
use glam::Vec3;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

const HEADER_BYTES: usize = 128;
/// Arrays of points and thickness.
const ARRAYS: u32 = 2 | 4;

/// A hair file on its way.
pub struct HairWriter {
    path: PathBuf,
    out: BufWriter<NamedTempFile>,
    /// Numbers of its strands.
    strands: Vec<u64>,
}

impl HairWriter {
    /// Begins a file that will have the name `path` once it is finished.
    ///
    /// Memory: 8 bytes a strand.
    pub fn create(path: &Path) -> Result<HairWriter> {
        let mut out = BufWriter::with_capacity(1 << 16, temporary(path)?);
        out.write_all(&[0; HEADER_BYTES]).with_context(|| path.display().to_string())?;
        Ok(HairWriter { path: path.to_owned(), out, strands: Vec::new() })
    }

    /// Adds a strand.
    pub fn strand(&mut self, number: u64, points: &[Vec3; POINTS]) -> Result<()> {
        self.strands.push(number);
        let coordinates = points.iter().flat_map(|p| p.to_array());
        let write = |x: f32| self.out.write_all(&x.to_le_bytes());
        coordinates.into_iter().try_for_each(write).context("hair")
    }

    /// Adds the width of each point of a strand, which `width` tells by the strand's number, and gives the file its name.
    pub fn finish(mut self, width: impl Fn(u64, usize) -> f32) -> Result<()> {
        let path = self.path.clone();
        let mut write = || -> std::io::Result<()> {
            for &strand in &self.strands {
                (0..POINTS).try_for_each(|k| self.out.write_all(&width(strand, k).to_le_bytes()))?;
            }
            self.out.flush()?;
            let count = |n: usize| {
                u32::try_from(n).map_err(|_| std::io::Error::other("too many points for a hair file"))
            };
            let mut header = b"HAIR".to_vec();
            let points = self.strands.len() * POINTS;
            for number in [count(self.strands.len())?, count(points)?, ARRAYS, SEGMENTS as u32] {
                header.extend(number.to_le_bytes());
            }
            // Thickness, transparency and color are those of the scene file.
            for number in [0.0f32, 0.0, 0.5, 0.5, 0.5] {
                header.extend(number.to_le_bytes());
            }
            let file = self.out.get_mut();
            file.seek(SeekFrom::Start(0))?;
            file.write_all(&header)
        };
        write().with_context(|| path.display().to_string())?;
        rename(self.out.into_inner().map_err(|e| e.into_error())?, &path)
    }
}
