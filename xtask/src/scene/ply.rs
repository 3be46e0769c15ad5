//! PLY files written as a stream: little-endian, f32 positions, lists of u32 indices.
//!
//! A PLY file has all vertices before all faces, and their counts before both. So vertices go to the file behind
//! room for the header, faces to a second file that is appended at the end, and the header is written last.

use super::sink::MeshSink;
use crate::output::{folder_of, rename, temporary};
use anyhow::{Context, Result};
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Bytes of every header; a comment fills what the counts leave free.
const HEADER_BYTES: usize = 256;

/// A PLY file on its way.
pub struct PlyWriter {
    path: PathBuf,
    vertices: BufWriter<NamedTempFile>,
    faces: BufWriter<File>,
    vertex_count: u64,
    face_count: u64,
}

impl PlyWriter {
    /// Begins a file that will have the name `path` once it is finished.
    pub fn create(path: &Path) -> Result<PlyWriter> {
        let name = || path.display().to_string();
        let mut vertices = BufWriter::with_capacity(1 << 16, temporary(path)?);
        vertices.write_all(&[0; HEADER_BYTES]).with_context(name)?;
        let faces = tempfile::tempfile_in(folder_of(path)).with_context(name)?;
        let faces = BufWriter::with_capacity(1 << 16, faces);
        Ok(PlyWriter { path: path.to_owned(), vertices, faces, vertex_count: 0, face_count: 0 })
    }

    /// Triangles so far.
    pub fn triangles(&self) -> u64 {
        self.face_count
    }

    /// Vertices so far: the number of the next one, which is refused if it is too large.
    pub fn vertices(&self) -> u32 {
        self.vertex_count as u32
    }

    /// Joins the parts and gives the file its name.
    pub fn finish(self) -> Result<()> {
        let path = self.path.clone();
        let file = self.joined().with_context(|| path.display().to_string())?;
        rename(file, &path)
    }

    fn joined(self) -> std::io::Result<NamedTempFile> {
        let mut faces = self.faces.into_inner().map_err(|e| e.into_error())?;
        let mut file = self.vertices.into_inner().map_err(|e| e.into_error())?;
        faces.rewind()?;
        std::io::copy(&mut faces, file.as_file_mut())?;
        file.seek(SeekFrom::Start(0))?;
        file.write_all(header(self.vertex_count, self.face_count).as_bytes())?;
        Ok(file)
    }
}

impl MeshSink for PlyWriter {
    fn vertex(&mut self, position: [f32; 3]) -> Result<u32> {
        let number = u32::try_from(self.vertex_count).ok();
        let number = number.with_context(|| {
            format!("{}: more vertices than indices of 32 bits can name; ask for less", self.path.display())
        })?;
        let mut bytes = [0; 12];
        bytes.chunks_exact_mut(4).zip(position).for_each(|(b, x)| b.copy_from_slice(&x.to_le_bytes()));
        self.vertices.write_all(&bytes).with_context(|| self.path.display().to_string())?;
        self.vertex_count += 1;
        Ok(number)
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        let mut bytes = [3; 13];
        bytes[1..].chunks_exact_mut(4).zip(corners).for_each(|(b, c)| b.copy_from_slice(&c.to_le_bytes()));
        self.faces.write_all(&bytes).with_context(|| self.path.display().to_string())?;
        self.face_count += 1;
        Ok(())
    }
}

fn header(vertices: u64, faces: u64) -> String {
    let begin = "ply\nformat binary_little_endian 1.0\ncomment ";
    let end = format!(
        "\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
    );
    let free = HEADER_BYTES - begin.len() - end.len();
    format!("{begin}{:free$}{end}", "made by raystrips xtask")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_have_the_same_length() {
        assert_eq!(header(0, 0).len(), HEADER_BYTES);
        assert_eq!(header(u64::MAX, u64::MAX).len(), HEADER_BYTES);
    }

    #[test]
    fn vertices_come_before_faces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        let mut writer = PlyWriter::create(&path).unwrap();
        let corners = [0.0, 1.0, 2.0].map(|x| writer.vertex([x, x * x, 0.0]).unwrap());
        writer.triangle(corners).unwrap();
        assert_eq!(writer.vertex([7.0; 3]).unwrap(), 3);
        writer.triangle([1, 2, 3]).unwrap();
        writer.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(bytes.len(), HEADER_BYTES + 4 * 12 + 2 * 13);
        assert_eq!(bytes[HEADER_BYTES + 12..][..4], 1f32.to_le_bytes());
        assert_eq!(bytes[HEADER_BYTES + 48..][..5], [3, 0, 0, 0, 0]);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
