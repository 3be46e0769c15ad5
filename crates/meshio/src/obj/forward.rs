//! Faces that name vertices further on, until the end of the file.

use crate::spool::{Spool, SpoolReader};
use crate::{ImportError, ImportOptions, Result};
use std::path::Path;

/// A face that has to wait.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Face {
    pub first_triangle_id: u64,
    pub geometry: u32,
    pub line: u64,
    pub corners: Vec<u32>,
}

/// Faces in the order of the file, as differences to what came before: about ten bytes each.
pub(super) struct ForwardFaces {
    spool: Spool,
    last_triangle_id: u64,
    last_line: u64,
}

/// Gives the faces back.
pub(super) struct ForwardReader {
    spool: SpoolReader,
    face: Face,
}

impl ForwardFaces {
    /// Keeps about `memory` bytes in memory.
    pub fn new(options: &ImportOptions, memory: u64) -> ForwardFaces {
        ForwardFaces { spool: Spool::new(options, memory), last_triangle_id: 0, last_line: 0 }
    }

    pub fn push(&mut self, first_triangle_id: u64, geometry: u32, line: u64, corners: &[u32]) -> Result<()> {
        self.spool.push(first_triangle_id - self.last_triangle_id)?;
        self.spool.push(geometry.into())?;
        self.spool.push(line - self.last_line)?;
        self.spool.push(corners.len() as u64)?;
        (self.last_triangle_id, self.last_line) = (first_triangle_id, line);
        let mut last = 0;
        for &corner in corners {
            self.spool.push(zigzag(i64::from(corner) - last))?;
            last = corner.into();
        }
        Ok(())
    }

    pub fn into_reader(self) -> Result<ForwardReader> {
        Ok(ForwardReader { spool: self.spool.into_reader()?, face: Face::default() })
    }
}

impl ForwardReader {
    /// The next face of the file at `path`.
    pub fn next(&mut self, path: &Path) -> Result<Option<&Face>> {
        self.try_next().map_err(|e| ImportError::io(path, e))
    }

    fn try_next(&mut self) -> std::io::Result<Option<&Face>> {
        let Some(id_step) = self.spool.next()? else { return Ok(None) };
        self.face.first_triangle_id += id_step;
        self.face.geometry = self.number()? as u32;
        self.face.line += self.number()?;
        self.face.corners.clear();
        let mut last = 0;
        for _ in 0..self.number()? {
            last += unzigzag(self.number()?);
            self.face.corners.push(last as u32);
        }
        Ok(Some(&self.face))
    }

    fn number(&mut self) -> std::io::Result<u64> {
        self.spool.next()?.ok_or_else(|| std::io::ErrorKind::UnexpectedEof.into())
    }
}

/// Small integers of either sign as small ones without.
fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

fn unzigzag(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_come_back() {
        let face = |i: u32| Face {
            first_triangle_id: 5 * u64::from(i),
            geometry: i % 3,
            line: 7 + u64::from(i),
            corners: (0..3 + i % 4)
                .map(|corner| if corner == 1 { u32::MAX - i } else { i * corner })
                .collect(),
        };
        let mut faces = ForwardFaces::new(&ImportOptions::default(), 0);
        for Face { first_triangle_id, geometry, line, corners } in (0..20_000).map(face) {
            faces.push(first_triangle_id, geometry, line, &corners).unwrap();
        }
        let mut reader = faces.into_reader().unwrap();
        (0..20_000).for_each(|i| assert_eq!(reader.next(Path::new("")).unwrap(), Some(&face(i))));
        assert_eq!(reader.next(Path::new("")).unwrap(), None);
    }
}
