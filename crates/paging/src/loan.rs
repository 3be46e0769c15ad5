//! Memory of a pool that is in other use for a while.

use raystrips_extmem::Reservation;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Memory that a pool lends for something other than pages. It comes back when this is dropped.
pub struct Loan {
    memory: Reservation,
    /// Of the pool, in all.
    lent: Arc<AtomicU64>,
}

impl Loan {
    pub(crate) fn new(memory: Reservation, lent: Arc<AtomicU64>) -> Loan {
        lent.fetch_add(memory.bytes(), Ordering::Relaxed);
        Loan { memory, lent }
    }

    /// How much it is.
    pub fn bytes(&self) -> u64 {
        self.memory.bytes()
    }

    /// Gives back what it is more than `bytes`.
    pub fn shrink(&mut self, bytes: u64) {
        let back = self.memory.shrink(bytes);
        self.lent.fetch_sub(back, Ordering::Relaxed);
    }
}

impl Drop for Loan {
    fn drop(&mut self) {
        self.shrink(0);
    }
}
