//! What was imported, as blocks in a spool, gone through as often as need be.

use crate::block::Block;
use crate::mesh::Welded;
use crate::queue::in_order_within;
use crate::{ConvertError, Observer, Stage};
use raystrips_extmem::{Extent, Spool};
use std::io;
use std::sync::Arc;

/// Blocks in the order of the import.
pub(crate) struct Blocks {
    pub spool: Arc<Spool>,
    /// Where they are, some at a time.
    pub chunks: Vec<Extent>,
    /// Triangles, or windows of strands, in them.
    pub triangles: u64,
    /// Chunks that are worked on, or wait for those before them, at a time.
    pub at_a_time: usize,
    /// Give chunks back to the disk once they were distributed.
    pub is_consumed: bool,
    /// Triangles without area go on: without them a simplified mesh would have open edges.
    pub keeps_flat: bool,
}

impl Blocks {
    /// All triangles as one mesh.
    pub fn weld(&self) -> Result<Welded, ConvertError> {
        let mut welded = Welded::with_capacity(self.triangles as usize);
        for &chunk in &self.chunks {
            let bytes = self.spool.read(chunk).map_err(ConvertError::Scratch)?;
            welded.add(&bytes).map_err(ConvertError::Scratch)?;
        }
        Ok(welded.finish())
    }

    /// Calls `work` with every block, on all threads, and `take` with what comes of it, in order.
    pub fn for_each<T: Send>(
        &self,
        stage: Stage,
        observer: &dyn Observer,
        work: impl Fn(Block) -> T + Sync,
        mut take: impl FnMut(T) -> Result<(), ConvertError> + Send,
    ) -> Result<(), ConvertError> {
        let work_on_chunk = |number: usize| -> Result<Vec<(usize, T)>, ConvertError> {
            let bytes = self.spool.read(self.chunks[number]).map_err(ConvertError::Scratch)?;
            let work = |block: Block| (block.item_count(), work(block));
            let results = Block::all(&bytes).map(|block| block.map(work)).collect::<io::Result<_>>();
            results.map_err(ConvertError::Scratch)
        };
        let mut done = 0;
        let mut take_chunk = |number: usize, results: Vec<(usize, T)>| {
            for (triangles, result) in results {
                done += triangles as u64;
                take(result)?;
            }
            if self.is_consumed && stage == Stage::Distribute {
                self.spool.discard(self.chunks[number]);
            }
            observer.progress(stage, done, self.triangles);
            Ok(())
        };
        let at_a_time = (self.at_a_time, self.at_a_time);
        in_order_within(0..self.chunks.len(), at_a_time, observer, &work_on_chunk, &mut take_chunk)?;
        if done == self.triangles { Ok(()) } else { Err(ConvertError::Scratch(lost_triangles())) }
    }
}

/// What is wrong if there are not as many triangles in a scratch file as were put there.
pub(crate) fn lost_triangles() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "triangles are missing in a scratch file; try again")
}
