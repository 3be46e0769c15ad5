//! Caches that forget what was not used for longest (LRU): of blocks, set-associative or not, and of pages.

use std::collections::{BTreeMap, HashMap};

/// How large a cache is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Bytes of a block, a power of two.
    pub block: u64,
    /// Blocks that it holds.
    pub blocks: u64,
    /// Blocks of a set; none: any block can be anywhere.
    pub ways: Option<u64>,
}

/// A cache that is simulated.
pub struct Cache {
    shape: Shape,
    sets: Vec<Set>,
}

impl Cache {
    /// An empty one.
    pub fn new(shape: Shape) -> Cache {
        let ways = shape.ways.unwrap_or(shape.blocks).min(shape.blocks);
        let sets = (shape.blocks / ways).max(1);
        Cache { shape, sets: (0..sets).map(|_| Set::new(ways)).collect() }
    }

    /// Reads some bytes. Tells how many blocks were not there.
    pub fn read(&mut self, place: u64, bytes: u64) -> u64 {
        let (first, last) = (place / self.shape.block, (place + bytes.max(1) - 1) / self.shape.block);
        let sets = self.sets.len() as u64;
        (first..=last).filter(|block| !self.sets[(block % sets) as usize].touch(*block)).count() as u64
    }
}

/// Blocks in the order of their use, as a list through slots.
struct Set {
    ways: usize,
    slot_of: HashMap<u64, u32, std::hash::BuildHasherDefault<BlockHasher>>,
    slots: Vec<Slot>,
    /// The one used last; its `before` is the one used longest ago, so that the slots are a ring.
    newest: u32,
}

#[derive(Clone, Copy)]
struct Slot {
    block: u64,
    /// Neighbors in the ring: used after and before it.
    after: u32,
    before: u32,
}

impl Set {
    fn new(ways: u64) -> Set {
        Set { ways: ways as usize, slot_of: HashMap::default(), slots: Vec::new(), newest: 0 }
    }

    /// Uses a block; false if it had to be brought.
    fn touch(&mut self, block: u64) -> bool {
        if let Some(&slot) = self.slot_of.get(&block) {
            if slot != self.newest {
                self.unlink(slot);
                self.link(slot);
            }
            return true;
        }
        if self.slots.len() < self.ways {
            let slot = self.slots.len() as u32;
            self.slots.push(Slot { block, after: slot, before: slot });
            if slot > 0 {
                self.link(slot);
            }
            self.newest = slot;
        } else {
            // The ring turns by one: the oldest becomes the newest.
            self.newest = self.slots[self.newest as usize].after;
            let slot = &mut self.slots[self.newest as usize];
            self.slot_of.remove(&slot.block);
            slot.block = block;
        }
        self.slot_of.insert(block, self.newest);
        false
    }

    fn unlink(&mut self, slot: u32) {
        let Slot { after, before, .. } = self.slots[slot as usize];
        self.slots[after as usize].before = before;
        self.slots[before as usize].after = after;
    }

    /// Makes a slot that is in no ring the newest.
    fn link(&mut self, slot: u32) {
        let newest = self.newest;
        let oldest = self.slots[newest as usize].after;
        (self.slots[slot as usize].before, self.slots[slot as usize].after) = (newest, oldest);
        self.slots[newest as usize].after = slot;
        self.slots[oldest as usize].before = slot;
        self.newest = slot;
    }
}

/// Spreads block numbers (multiplication by the golden ratio; Knuth).
#[derive(Default)]
struct BlockHasher(u64);

impl std::hash::Hasher for BlockHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u64(byte.into()));
    }

    fn write_u64(&mut self, number: u64) {
        self.0 = (self.0 ^ number).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// A cache of pages of all sizes, as large as so many bytes of them.
pub struct PageCache {
    bytes: u64,
    taken: u64,
    /// Reads so far.
    now: u64,
    /// When each page that is there was used last.
    used: HashMap<usize, u64>,
    /// The pages and their bytes by that.
    by_use: BTreeMap<u64, (usize, u64)>,
}

impl PageCache {
    /// An empty one.
    pub fn new(bytes: u64) -> PageCache {
        PageCache { bytes, taken: 0, now: 0, used: HashMap::new(), by_use: BTreeMap::new() }
    }

    /// Reads something in a page of so many bytes. True if the page was not there.
    pub fn read(&mut self, page: usize, bytes: u64) -> bool {
        self.now += 1;
        let before = self.used.insert(page, self.now).and_then(|before| self.by_use.remove(&before));
        self.by_use.insert(self.now, (page, bytes));
        if before.is_some() {
            return false;
        }
        self.taken += bytes;
        while self.taken > self.bytes
            && let Some((_, (oldest, bytes))) = self.by_use.pop_first()
        {
            self.used.remove(&oldest);
            self.taken -= bytes;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn misses(shape: Shape, places: &[u64]) -> Vec<u64> {
        let mut cache = Cache::new(shape);
        places.iter().map(|&place| cache.read(place, 1)).collect()
    }

    #[test]
    fn what_was_used_longest_ago_goes() {
        let shape = Shape { block: 64, blocks: 3, ways: None };
        assert_eq!(misses(shape, &[0, 64, 128, 0, 192, 0, 64]), [1, 1, 1, 0, 1, 0, 1]);
        assert_eq!(misses(shape, &[0, 1, 63, 64, 127]), [1, 0, 0, 1, 0]);
    }

    #[test]
    fn blocks_of_a_set_push_each_other_out() {
        let shape = Shape { block: 64, blocks: 4, ways: Some(1) };
        assert_eq!(misses(shape, &[0, 256, 0, 64, 320, 128]), [1, 1, 1, 1, 1, 1]);
        assert_eq!(misses(Shape { ways: Some(2), ..shape }, &[0, 128, 0, 128, 256, 0]), [1, 1, 0, 0, 1, 1]);
    }

    #[test]
    fn a_long_read_takes_several_blocks() {
        let mut cache = Cache::new(Shape { block: 64, blocks: 64, ways: Some(8) });
        assert_eq!(cache.read(60, 70), 3);
        assert_eq!(cache.read(64, 64), 0);
    }

    #[test]
    fn pages_go_until_there_is_room() {
        let mut cache = PageCache::new(10);
        let reads = [(1, 4), (2, 4), (1, 4), (3, 5), (1, 4), (2, 4), (3, 5)];
        let misses = reads.map(|(page, bytes)| cache.read(page, bytes));
        assert_eq!(misses, [true, true, false, true, false, true, true]);
    }

    /// The same as a list that is searched.
    #[test]
    fn as_a_plain_list() {
        let shape = Shape { block: 1, blocks: 7, ways: None };
        let mut cache = Cache::new(shape);
        let mut list: Vec<u64> = Vec::new();
        let mut state = 1u64;
        for _ in 0..10_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let block = (state >> 60) + (state >> 33 & 3);
            let found = list.iter().position(|&b| b == block);
            assert_eq!(cache.read(block, 1), u64::from(found.is_none()));
            found.map(|i| list.remove(i));
            list.push(block);
            if list.len() > 7 {
                list.remove(0);
            }
        }
    }
}
