//! What a process may hold: memory that it needs for other things than pages is lent by theirs, which are read again when they
//! are needed.

use raystrips_extmem::process_memory;
use raystrips_tracer::{Loan, PagePool};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Bytes lent at a time.
const UNIT_BYTES: usize = 1 << 20;
/// The allocator takes this part of it more, at about: arrays of all sizes come and go.
const ALLOCATOR_PART: usize = 3;
/// Calls between looks at what the process has.
const CALLS: u64 = 4;

/// A limit for all that the process holds. Nobody can tell beforehand how much an allocator keeps.
pub(crate) struct ProcessLimit {
    bytes: u64,
    /// Of the pool, in units.
    loans: Mutex<Vec<Loan>>,
    most_loans: usize,
    calls: AtomicU64,
}

impl ProcessLimit {
    /// Of a process that may hold so many bytes. At most half of what `pool` has now is lent.
    pub fn new(bytes: u64, pool: &PagePool) -> ProcessLimit {
        let most_loans = pool.bytes() as usize / 2 / UNIT_BYTES;
        ProcessLimit { bytes, loans: Mutex::default(), most_loans, calls: AtomicU64::default() }
    }

    /// Borrows memory of `pool` for `bytes`, and for what the process holds beyond its limit. What was borrowed once is kept, as
    /// the allocator keeps it. Where visits hold too many pages that is for the next time.
    pub fn keep(&self, pool: &PagePool, bytes: usize) {
        let units = (bytes + bytes / ALLOCATOR_PART).div_ceil(UNIT_BYTES);
        let over = match self.calls.fetch_add(1, Ordering::Relaxed) % CALLS {
            0 => process_memory().saturating_sub(self.bytes) as usize,
            _ => 0,
        };
        let mut loans = self.loans.lock().unwrap_or_else(PoisonError::into_inner);
        let units = if over > 0 { units.max(loans.len() + over.div_ceil(UNIT_BYTES)) } else { units };
        while loans.len() < units.min(self.most_loans) {
            let Some(loan) = pool.lend(UNIT_BYTES as u64) else { return };
            loans.push(loan);
        }
    }
}
