//! The memory of rays that wait: taken from that of the pages, which are read again when they are needed.

use raystrips_extmem::process_memory;
use raystrips_tracer::PagePool;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Bytes taken at a time.
const UNIT_BYTES: usize = 1 << 20;
/// The allocator takes this part of it more, at about: queues of all sizes come and go.
const ALLOCATOR_PART: usize = 3;
/// Calls between looks at what the process has.
const CALLS: u64 = 16;

/// What rays that wait have of the memory of a pool, in units.
pub(super) struct RayMemory {
    /// For all that the process holds.
    process_bytes: u64,
    taken: Mutex<usize>,
    calls: AtomicU64,
}

impl RayMemory {
    /// Of a process that may hold so many bytes.
    pub fn new(process_bytes: u64) -> RayMemory {
        RayMemory { process_bytes, taken: Mutex::default(), calls: AtomicU64::default() }
    }

    /// Takes memory of `pool` for rays of so many bytes. What was taken once is kept, as the allocator keeps it. Where visits
    /// hold too many pages that is for the next time.
    pub fn follow(&self, bytes: usize, pool: &PagePool) {
        let units = (bytes + bytes / ALLOCATOR_PART).div_ceil(UNIT_BYTES);
        let over = match self.calls.fetch_add(1, Ordering::Relaxed) % CALLS {
            0 => process_memory().saturating_sub(self.process_bytes) as usize,
            _ => 0,
        };
        let mut taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let units = if over > 0 { units.max(*taken + over.div_ceil(UNIT_BYTES)) } else { units };
        while *taken < units && pool.give_away(UNIT_BYTES as u64) {
            *taken += 1;
        }
    }
}
