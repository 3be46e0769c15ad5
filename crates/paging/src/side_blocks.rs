//! Attributes of pages and tiles of images of a pack that does not fit in memory: as many as a budget allows, those used
//! last.

use crate::OpenError;
use raystrips_extmem::{BlockBuffer, BlockFile};
use raystrips_pack::{Pack, PackError, PageId};
use std::collections::{HashMap, VecDeque};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Parts of the cache, each with a lock of its own.
const SHARDS: u64 = 16;
/// Memory of a block beside its bytes.
const ENTRY_BYTES: u64 = 96;

/// Blocks of a pack beside its pages.
pub(crate) struct SideBlocks {
    file: BlockFile,
    path: PathBuf,
    shards: Vec<Mutex<Shard>>,
    /// Bytes of a shard.
    most_bytes: u64,
}

/// What a block is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Key {
    Attributes(PageId),
    Tile(u64),
}

#[derive(Default)]
struct Shard {
    blocks: HashMap<Key, Block>,
    /// In the order in which they came, but that those used since go to the end.
    order: VecDeque<Key>,
    bytes: u64,
    buffer: BlockBuffer,
}

struct Block {
    bytes: Arc<[u8]>,
    is_used: bool,
}

impl SideBlocks {
    pub fn new(file: BlockFile, path: PathBuf, bytes: u64) -> SideBlocks {
        let shards = (0..SHARDS).map(|_| Mutex::default()).collect();
        SideBlocks { file, path, shards, most_bytes: bytes / SHARDS }
    }

    /// Bytes of memory in which some blocks of each kind fit.
    pub fn least_bytes(pack: &Pack) -> u64 {
        match pack.shading.is_empty() {
            true => 0,
            false => SHARDS * (2 * pack.shading.most_block_bytes() + ENTRY_BYTES),
        }
    }

    /// The attributes of a page; empty if it has none.
    pub fn attributes(&self, pack: &Pack, page: PageId) -> Result<Arc<[u8]>, OpenError> {
        let triangles = pack.directory[page as usize].triangle_count;
        self.get(Key::Attributes(page), pack, |bytes| {
            pack.shading.check_attributes(bytes, page, triangles)?;
            Ok(bytes.into())
        })
    }

    /// A tile, which must exist.
    pub fn tile(&self, pack: &Pack, tile: u64) -> Result<Arc<[u8]>, OpenError> {
        self.get(Key::Tile(tile), pack, |bytes| Ok(pack.shading.decode_tile(bytes, tile)?.into()))
    }

    fn get(
        &self,
        key: Key,
        pack: &Pack,
        checked: impl Fn(&[u8]) -> Result<Arc<[u8]>, PackError>,
    ) -> Result<Arc<[u8]>, OpenError> {
        let (shard, place) = match key {
            Key::Attributes(page) => (u64::from(page) % SHARDS, pack.shading.attributes(page)),
            Key::Tile(tile) => (tile % SHARDS, pack.shading.tile(tile)),
        };
        let mut shard = self.shards[shard as usize].lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(block) = shard.blocks.get_mut(&key) {
            block.is_used = true;
            return Ok(block.bytes.clone());
        }
        let error = |source| OpenError { path: self.path.clone(), source };
        let bytes = self.file.read(place, &mut shard.buffer).map_err(|e| error(e.into()))?;
        let bytes = checked(bytes).map_err(error)?;
        shard.make_room(bytes.len() as u64 + ENTRY_BYTES, self.most_bytes);
        shard.bytes += bytes.len() as u64 + ENTRY_BYTES;
        shard.order.push_back(key);
        shard.blocks.insert(key, Block { bytes: bytes.clone(), is_used: false });
        Ok(bytes)
    }
}

impl Shard {
    /// Lets blocks go until there is room for so many bytes.
    fn make_room(&mut self, bytes: u64, most_bytes: u64) {
        while self.bytes + bytes > most_bytes
            && let Some(key) = self.order.pop_front()
        {
            let Some(block) = self.blocks.get_mut(&key) else { continue };
            if std::mem::take(&mut block.is_used) {
                self.order.push_back(key);
                continue;
            }
            self.bytes -= block.bytes.len() as u64 + ENTRY_BYTES;
            self.blocks.remove(&key);
        }
    }
}
