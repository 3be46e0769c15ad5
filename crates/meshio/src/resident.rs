//! Bounds the memory of maps that are read in any order.
//!
//! A page that is missing brings its neighbors with it: 64 KiB on older kernels of Linux, and since 6.18 all of a large
//! folio of the page cache, two megabytes where the file was written at a stretch. Reading a thousand positions without
//! any order may so bring in two gigabytes. Releasing the map after some hundred reads keeps memory small but makes
//! meshes without order twenty times slower: nearly every read then is a fault. So it is counted which blocks have been
//! touched. Those that fit stay; what is in others is read from the file by itself, until so much was that the blocks
//! that are there cannot be the right ones.

use std::cell::Cell;

/// What Linux maps at once at most, as a power of two.
const BLOCK_BITS: u32 = 21;
pub(crate) const BLOCK_BYTES: usize = 1 << BLOCK_BITS;
/// With less memory for them, meshes without order would take forever. Tests shall see full memory in small files.
const MIN_BYTES: u64 = if cfg!(test) { 4 << 20 } else { 96 << 20 };
/// Reads beside the map after which other blocks may come in: these take far longer than that, so that it does no harm
/// where there is no order, and far less than the reads that a block serves where there is.
const MAX_READS_BESIDE: u32 = 1 << 15;

/// Which blocks of a map are in memory, at most.
pub(crate) struct Resident {
    /// Bytes by which the map's start is behind the start of a block.
    skew: usize,
    /// A bit for each block: memory for a 2^24th of the file.
    blocks: Vec<Cell<u64>>,
    max_count: u64,
    count: Cell<u64>,
    reads_beside: Cell<u32>,
}

impl Resident {
    /// For `map`, of which about `max_bytes` may be in memory.
    pub fn new(map: &[u8], max_bytes: u64) -> Resident {
        let max_count = max_bytes.max(MIN_BYTES) >> BLOCK_BITS;
        let mut resident = Resident {
            skew: skew(map),
            blocks: Vec::new(),
            max_count,
            count: Cell::new(0),
            reads_beside: Cell::new(0),
        };
        resident.grow(resident.skew + map.len());
        resident
    }

    /// Makes room for offsets below `bytes`.
    pub fn grow(&mut self, bytes: usize) {
        self.blocks.resize((bytes >> BLOCK_BITS) / 64 + 1, Cell::new(0));
    }

    /// Called before the byte at `offset` is read. True if it may be: its block is there, or still fits.
    #[inline]
    pub fn touch(&self, offset: usize) -> bool {
        let block = (self.skew + offset) >> BLOCK_BITS;
        let bit = 1 << (block % 64);
        self.blocks.get(block / 64).is_none_or(|blocks| blocks.get() & bit != 0) || self.add(block)
    }

    #[cold]
    fn add(&self, block: usize) -> bool {
        if self.count.get() >= self.max_count {
            self.reads_beside.set(self.reads_beside.get().saturating_add(1));
            return false;
        }
        let blocks = &self.blocks[block / 64];
        blocks.set(blocks.get() | 1 << (block % 64));
        self.count.set(self.count.get() + 1);
        true
    }

    /// True if the blocks that are there should be released for others.
    pub fn is_stale(&self) -> bool {
        self.reads_beside.get() >= MAX_READS_BESIDE
    }

    /// All pages have been released.
    pub fn clear(&self) {
        self.blocks.iter().for_each(|blocks| blocks.set(0));
        self.count.set(0);
        self.reads_beside.set(0);
    }

    pub fn is_empty(&self) -> bool {
        self.count.get() == 0
    }
}

/// Bytes by which the start of `map` is behind the start of a block.
pub(crate) fn skew(map: &[u8]) -> usize {
    map.as_ptr() as usize % BLOCK_BYTES
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_count_once() {
        let mut resident = Resident::new(&[], 0);
        let count = MIN_BYTES as usize / BLOCK_BYTES;
        resident.grow((count + 1) * BLOCK_BYTES + BLOCK_BYTES);
        for _ in 0..2 {
            assert!((0..count).all(|block| resident.touch(block * BLOCK_BYTES + block)));
        }
        for _ in 0..MAX_READS_BESIDE {
            assert!(!resident.is_stale() && !resident.touch(count * BLOCK_BYTES) && resident.touch(0));
        }
        assert!(resident.is_stale() && !resident.is_empty());
        resident.clear();
        assert!(resident.is_empty() && !resident.is_stale() && resident.touch(count * BLOCK_BYTES));
    }
}
