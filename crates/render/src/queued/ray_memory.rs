//! The memory of rays that wait: taken from that of the pages, which are read again when they are needed.

use raystrips_tracer::PagePool;
use std::sync::{Mutex, PoisonError};

/// Bytes taken at a time.
const UNIT_BYTES: usize = 1 << 20;
/// The allocator takes this part of it more, at most: queues of all sizes come and go.
const ALLOCATOR_PART: usize = 3;

/// What rays that wait have of the memory of a pool, in units.
#[derive(Default)]
pub(super) struct RayMemory(Mutex<usize>);

impl RayMemory {
    /// Takes memory of `pool` for rays of so many bytes. What was taken once is kept, as the allocator keeps it. Where visits
    /// hold too many pages that is for the next time.
    pub fn follow(&self, bytes: usize, pool: &PagePool) {
        let units = (bytes + bytes / ALLOCATOR_PART).div_ceil(UNIT_BYTES);
        let mut taken = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while *taken < units && pool.give_away(UNIT_BYTES as u64) {
            *taken += 1;
        }
    }
}
