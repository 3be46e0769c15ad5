//! Looking at pages that may go.

use crate::page::Page;
use crate::pool::PagePool;
use raystrips_pack::{PageId, PageView};
use std::cell::{Cell, OnceCell};
use std::sync::Arc;

/// A look at pages: what it has seen stays in memory until it ends.
pub struct Visit<'p> {
    pool: &'p PagePool,
    /// By page, as many as the pack has: a ray asks for one after the other, and a table is asked the fastest.
    seen: Vec<OnceCell<Arc<Page>>>,
    count: Cell<usize>,
}

impl<'p> Visit<'p> {
    pub(crate) fn new(pool: &'p PagePool) -> Visit<'p> {
        let pages = pool.pack().directory.len();
        Visit { pool, seen: (0..pages).map(|_| OnceCell::new()).collect(), count: Cell::new(0) }
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
        let seen = &self.seen[id as usize];
        if let Some(page) = seen.get() {
            return Some(page.view());
        }
        let page = self.pool.get(id)?;
        self.count.set(self.count.get() + 1);
        Some(seen.get_or_init(|| page).view())
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
