//! Looking at pages that may go.

use crate::page::Page;
use crate::pool::PagePool;
use elsa::FrozenMap;
use raystrips_pack::{PageId, PageView};
use std::cell::Cell;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::Arc;

/// A look at pages: what it has seen stays in memory until it ends.
pub struct Visit<'p> {
    pool: &'p PagePool,
    seen: FrozenMap<PageId, Arc<Page>, BuildHasherDefault<PageHasher>>,
    count: Cell<usize>,
}

impl<'p> Visit<'p> {
    pub(crate) fn new(pool: &'p PagePool) -> Visit<'p> {
        Visit { pool, seen: FrozenMap::default(), count: Cell::new(0) }
    }

    /// The pool that it looks at.
    pub fn pool(&self) -> &PagePool {
        self.pool
    }

    /// Page `id` if it is in memory.
    ///
    /// # Panics
    /// If there is no such page.
    #[inline]
    pub fn page(&self, id: PageId) -> Option<PageView<'_>> {
        if let Some(page) = self.seen.get(&id) {
            return Some(page.view());
        }
        let page = self.pool.get(id)?;
        self.count.set(self.count.get() + 1);
        Some(self.seen.insert(id, page).view())
    }

    /// Pages that it has seen.
    pub fn len(&self) -> usize {
        self.count.get()
    }

    /// True if it has seen none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A page without anything in it.
    pub fn blank(&self) -> PageView<'_> {
        self.pool.blank()
    }
}

/// Spreads page numbers (multiplication by the golden ratio; Knuth).
#[derive(Default)]
struct PageHasher(u64);

impl Hasher for PageHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u32(byte.into()));
    }

    fn write_u32(&mut self, number: u32) {
        self.0 = (self.0 ^ u64::from(number)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}
