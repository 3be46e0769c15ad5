//! What a process may hold: where it comes to more, pages go for that.

use raystrips_extmem::process_memory;
use raystrips_tracer::{Loan, PagePool};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Bytes lent at a time.
const UNIT_BYTES: u64 = 1 << 20;
/// Calls between looks at what the process has.
const CALLS: u64 = 4;

/// A limit for all that the process holds. An allocator keeps holes where arrays of all sizes come and go, of which nobody
/// can tell beforehand how much they will be.
pub(crate) struct ProcessLimit {
    bytes: u64,
    /// Of the pool, until the end.
    loans: Mutex<Vec<Loan>>,
    most_loans: usize,
    calls: AtomicU64,
}

impl ProcessLimit {
    /// At most half of what `pool` has now is lent.
    pub fn new(bytes: u64, pool: &PagePool) -> ProcessLimit {
        let most_loans = (pool.bytes() / 2 / UNIT_BYTES) as usize;
        ProcessLimit { bytes, loans: Mutex::default(), most_loans, calls: AtomicU64::default() }
    }

    /// Lets pages of `pool` go for what the process holds beyond the limit. Where visits hold too many of them that is for the
    /// next time.
    pub fn keep(&self, pool: &PagePool) {
        if !self.calls.fetch_add(1, Ordering::Relaxed).is_multiple_of(CALLS) {
            return;
        }
        let over = process_memory().saturating_sub(self.bytes).div_ceil(UNIT_BYTES);
        let mut loans = self.loans.lock().unwrap_or_else(PoisonError::into_inner);
        let units = over.min((self.most_loans - loans.len()) as u64);
        loans.extend((0..units).map_while(|_| pool.lend(UNIT_BYTES)));
    }
}
