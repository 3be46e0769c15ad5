//! One number for the memory of the whole process, and who has how much of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Memory that may still be taken. Clones share it.
#[derive(Clone, Debug)]
pub struct MemoryBudget {
    left: Arc<AtomicU64>,
}

/// Part of a budget; given back when dropped.
#[derive(Debug)]
pub struct Reservation {
    budget: MemoryBudget,
    bytes: u64,
}

impl MemoryBudget {
    /// A budget of `bytes`.
    pub fn new(bytes: u64) -> MemoryBudget {
        MemoryBudget { left: Arc::new(AtomicU64::new(bytes)) }
    }

    /// Bytes that nobody has taken.
    pub fn left(&self) -> u64 {
        self.left.load(Ordering::Relaxed)
    }

    /// Takes `bytes`, or nothing if less is left.
    pub fn take(&self, bytes: u64) -> Option<Reservation> {
        let take = |left: u64| left.checked_sub(bytes);
        self.left.try_update(Ordering::Relaxed, Ordering::Relaxed, take).ok()?;
        Some(Reservation { budget: self.clone(), bytes })
    }
}

impl Reservation {
    /// How much it is.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Takes `bytes` more of the same budget; false if less is left.
    pub fn grow(&mut self, bytes: u64) -> bool {
        match self.budget.take(bytes) {
            Some(mut more) => {
                self.bytes += std::mem::take(&mut more.bytes);
                true
            }
            None => false,
        }
    }

    /// Gives back what it is more than `bytes`, and tells how much that is.
    pub fn shrink(&mut self, bytes: u64) -> u64 {
        let back = self.bytes.saturating_sub(bytes);
        self.bytes -= back;
        self.budget.left.fetch_add(back, Ordering::Relaxed);
        back
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.shrink(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_comes_back() {
        let budget = MemoryBudget::new(100);
        let mut a = budget.take(60).unwrap();
        assert!(budget.take(41).is_none());
        let b = budget.take(30).unwrap();
        assert!(a.grow(10) && !a.grow(1));
        drop(b);
        assert_eq!(budget.left(), 30);
        assert_eq!((a.shrink(90), a.shrink(50), budget.left()), (0, 20, 50));
        drop(a);
        assert_eq!(budget.left(), 100);
    }
}
