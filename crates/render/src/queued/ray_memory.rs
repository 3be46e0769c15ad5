//! The memory of rays that wait: taken from that of the pages, which are read again when they are needed.

use raystrips_extmem::Reservation;
use raystrips_tracer::PagePool;
use std::sync::{Mutex, PoisonError};

/// Bytes taken or given back at a time.
const UNIT_BYTES: usize = 1 << 20;

/// What rays that wait have of the memory of a pool.
#[derive(Default)]
pub(super) struct RayMemory(Mutex<Vec<Reservation>>);

impl RayMemory {
    /// Takes memory of `pool` for rays of so many bytes, or gives some back. Where visits hold too many pages that is for
    /// the next time.
    pub fn follow(&self, bytes: usize, pool: &PagePool) {
        let units = bytes.div_ceil(UNIT_BYTES);
        let mut taken = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // One to spare, so that it does not go to and fro.
        if units + 1 < taken.len() {
            taken.truncate(units);
        }
        while taken.len() < units {
            let Some(unit) = pool.take(UNIT_BYTES as u64) else { return };
            taken.push(unit);
        }
    }
}
