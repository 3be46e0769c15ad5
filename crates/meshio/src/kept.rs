//! Vertices of files that cannot be read in place: in memory as long as they fit, in a scratch file beyond.

use crate::emit::Vertices;
use crate::map::Map;
use crate::resident::{BLOCK_BYTES, Resident, skew};
use crate::scratch::Scratch;
use crate::{ImportOptions, Result};

/// Bytes of a vertex: three `f64`.
const VERTEX_BYTES: usize = 24;
/// Vertices of a chunk, as a power of two. 24 MiB: whole pages, few maps for billions of vertices, and little beside
/// any budget.
const CHUNK_BITS: u32 = 20;
/// The same beside positions, which are what there is room for.
const SMALL_CHUNK_BITS: u32 = 17;

/// Grows by a vertex at a time; those that are there can be asked for in any order.
pub(crate) struct Kept {
    full: Vec<Chunk>,
    /// The last vertices, less than a chunk.
    open: Vec<u8>,
    chunk_bits: u32,
    /// For full chunks.
    memory_left: u64,
    /// Of chunks in the file, one behind the other with a block of room between two.
    resident: Resident,
    scratch: Scratch,
}

enum Chunk {
    Memory(Vec<u8>),
    /// In the scratch file, from the byte `start` on; its map is at `place` for [`Resident`].
    File {
        map: Map,
        start: u64,
        place: usize,
    },
}

impl Kept {
    /// A store that takes about `memory` bytes of memory, a quarter of it for pages of the scratch file.
    pub fn new(options: &ImportOptions, memory: u64) -> Kept {
        Kept::with_chunks(options, memory, CHUNK_BITS)
    }

    /// The same for what is kept beside positions.
    pub fn beside(options: &ImportOptions, memory: u64) -> Kept {
        Kept::with_chunks(options, memory, SMALL_CHUNK_BITS)
    }

    fn with_chunks(options: &ImportOptions, memory: u64, chunk_bits: u32) -> Kept {
        Kept {
            full: Vec::new(),
            open: Vec::new(),
            chunk_bits,
            memory_left: memory - memory / 4,
            resident: Resident::new(&[], memory / 4),
            scratch: Scratch::new(options),
        }
    }

    #[inline]
    pub fn push(&mut self, [x, y, z]: [f64; 3]) -> Result<()> {
        for coordinate in [x, y, z] {
            self.open.extend_from_slice(&coordinate.to_le_bytes());
        }
        if self.open.len() == VERTEX_BYTES << self.chunk_bits { self.close() } else { Ok(()) }
    }

    /// Puts the open chunk away.
    #[cold]
    fn close(&mut self) -> Result<()> {
        let bytes = self.open.len();
        let chunk = match self.memory_left.checked_sub(bytes as u64) {
            Some(left) => {
                self.memory_left = left;
                // Growing by doubling would leave a third of it empty.
                self.open.shrink_to_fit();
                Chunk::Memory(std::mem::replace(&mut self.open, Vec::with_capacity(bytes)))
            }
            None => {
                self.memory_left = 0;
                let start = self.scratch.append(&self.open)?;
                self.open.clear();
                let map = self.scratch.map(start, bytes)?;
                let place = self.full.len() * (bytes + BLOCK_BYTES) + skew(&map);
                self.resident.grow(place + bytes);
                Chunk::File { map, start, place }
            }
        };
        self.full.push(chunk);
        Ok(())
    }

    fn release_maps(&self) {
        for chunk in &self.full {
            if let Chunk::File { map, .. } = chunk {
                map.release();
            }
        }
        self.resident.clear();
    }

    /// Reads a vertex whose block does not fit into memory.
    #[cold]
    fn position_beside(&self, start: u64) -> Option<[f64; 3]> {
        if self.resident.is_stale() {
            self.release_maps();
        }
        let mut bytes = [0; VERTEX_BYTES];
        self.scratch.read_at(start, &mut bytes).then(|| decode(&bytes))
    }
}

impl Vertices for Kept {
    #[inline]
    fn count(&self) -> u64 {
        ((self.full.len() as u64) << self.chunk_bits) + (self.open.len() / VERTEX_BYTES) as u64
    }

    #[inline]
    fn position(&self, index: u32) -> [f64; 3] {
        let vertex = (index & ((1 << self.chunk_bits) - 1)) as usize * VERTEX_BYTES;
        let bytes: &[u8] = match self.full.get((index >> self.chunk_bits) as usize) {
            None => &self.open,
            Some(Chunk::Memory(bytes)) => bytes,
            Some(Chunk::File { map, start, place }) => {
                if !self.resident.touch(place + vertex)
                    && let Some(position) = self.position_beside(start + vertex as u64)
                {
                    return position;
                }
                map
            }
        };
        decode(&bytes[vertex..][..VERTEX_BYTES])
    }

    fn release(&self) {
        if !self.resident.is_empty() {
            self.release_maps();
        }
    }
}

fn decode(vertex: &[u8]) -> [f64; 3] {
    let (coordinates, _) = vertex.as_chunks();
    [0, 1, 2].map(|axis| f64::from_le_bytes(coordinates[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(i: u32) -> [f64; 3] {
        [f64::from(i), 0.1 * f64::from(i), -f64::from(i)]
    }

    #[test]
    fn vertices_come_back_whatever_the_memory() {
        let bytes = 8 * VERTEX_BYTES as u64;
        for (memory, chunks_in_memory) in [(0, 0), (bytes, 0), (4 * bytes, 3), (8 * bytes, 6), (u64::MAX, 12)]
        {
            let mut kept = Kept::with_chunks(&ImportOptions::default(), memory, 3);
            for i in 0..100 {
                kept.push(vertex(i)).unwrap();
                assert_eq!((kept.count(), kept.position(i)), (u64::from(i) + 1, vertex(i)));
            }
            for i in (0..100).rev() {
                assert_eq!(kept.position(i), vertex(i));
                kept.release();
            }
            let in_memory = kept.full.iter().filter(|chunk| matches!(chunk, Chunk::Memory(_))).count();
            assert_eq!(in_memory, chunks_in_memory, "{memory}");
        }
    }

    #[test]
    fn a_folder_that_is_not_there_is_named_when_it_is_needed() {
        let scratch = Some("/not/there".into());
        let mut kept = Kept::with_chunks(&ImportOptions { scratch, ..ImportOptions::default() }, 0, 3);
        (0..7).for_each(|i| kept.push(vertex(i)).unwrap());
        let error = kept.push(vertex(7)).unwrap_err().to_string();
        assert!(error.starts_with("/not/there: "), "{error}");
    }
}
