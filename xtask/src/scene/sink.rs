//! Where generators put what they make: vertices first, then triangles that name them.

use anyhow::Result;

/// Takes a mesh piece by piece.
pub trait MeshSink {
    /// Takes a vertex and tells its number.
    fn vertex(&mut self, position: [f32; 3]) -> Result<u32>;

    /// Takes a triangle of vertices that were taken before.
    fn triangle(&mut self, corners: [u32; 3]) -> Result<()>;
}

/// Counts triangles and forgets them.
#[derive(Default)]
pub struct Counter {
    /// Triangles so far.
    pub triangles: u64,
}

impl MeshSink for Counter {
    fn vertex(&mut self, _position: [f32; 3]) -> Result<u32> {
        Ok(0)
    }

    fn triangle(&mut self, _corners: [u32; 3]) -> Result<()> {
        self.triangles += 1;
        Ok(())
    }
}

/// Keeps all.
#[derive(Default)]
pub struct Kept {
    /// By their numbers.
    pub positions: Vec<[f32; 3]>,
    /// In the order in which they came.
    pub triangles: Vec<[u32; 3]>,
}

impl MeshSink for Kept {
    fn vertex(&mut self, position: [f32; 3]) -> Result<u32> {
        self.positions.push(position);
        Ok(self.positions.len() as u32 - 1)
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        debug_assert!(corners.iter().all(|&c| (c as usize) < self.positions.len()));
        self.triangles.push(corners);
        Ok(())
    }
}
