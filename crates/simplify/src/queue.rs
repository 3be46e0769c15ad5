//! Collapses waiting by cost, in buckets.
//!
//! Costs of one bucket differ by at most 1/16, and are first in, first out. Which of two collapses of nearly the same
//! cost comes first does not matter to the result, and appending to a list is many times cheaper than a place in a
//! heap. First in, first out also spreads collapses that cost nothing over a plane instead of feeding one vertex.

use crate::curve::{CLASSES, class};

/// An edge to collapse.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Ends of the edge.
    pub ends: [u32; 2],
    /// Sum of the versions of both ends: they have not changed while it is the same.
    pub stamp: u32,
    /// True if the collapse was found to remove a whole part of the mesh, and the cost is that of the part.
    pub is_priced: bool,
}

#[derive(Default)]
struct Bucket {
    entries: Vec<Entry>,
    /// Entries that have been taken.
    taken: usize,
}

/// A queue of collapses.
pub struct Queue {
    buckets: Vec<Bucket>,
    /// No bucket below has entries.
    lowest: usize,
    /// Entries that have not been taken.
    length: usize,
}

impl Queue {
    /// A queue without entries.
    pub fn new() -> Queue {
        let mut buckets = Vec::new();
        buckets.resize_with(CLASSES, Bucket::default);
        Queue { buckets, lowest: CLASSES, length: 0 }
    }

    /// Adds a collapse of a cost that is not negative.
    pub fn push(&mut self, cost: f64, entry: Entry) {
        let bucket = class(cost);
        self.buckets[bucket].entries.push(entry);
        self.lowest = self.lowest.min(bucket);
        self.length += 1;
    }

    /// Entries in it.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Keeps only what is `wanted`.
    pub fn retain(&mut self, wanted: impl Fn(&Entry) -> bool) {
        self.length = 0;
        for bucket in &mut self.buckets {
            bucket.entries.drain(..bucket.taken);
            bucket.taken = 0;
            bucket.entries.retain(&wanted);
            bucket.entries.shrink_to_fit();
            self.length += bucket.entries.len();
        }
    }

    /// Takes up to `count` of about the least cost that are `wanted` into `batch`, which is empty when there are none.
    pub fn pop(&mut self, count: usize, wanted: impl Fn(&Entry) -> bool, batch: &mut Vec<Entry>) {
        batch.clear();
        while let Some(bucket) = self.buckets.get_mut(self.lowest) {
            while batch.len() < count && bucket.taken < bucket.entries.len() {
                batch.extend(Some(bucket.entries[bucket.taken]).filter(&wanted));
                bucket.taken += 1;
                self.length -= 1;
            }
            if !batch.is_empty() {
                return;
            }
            bucket.entries.clear();
            bucket.taken = 0;
            self.lowest += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn all(queue: &mut Queue) -> Vec<u32> {
        let (mut all, mut batch) = (Vec::new(), Vec::new());
        loop {
            queue.pop(3, |_| true, &mut batch);
            all.extend(batch.iter().map(|entry| entry.ends[0]));
            if batch.is_empty() {
                return all;
            }
        }
    }

    proptest! {
        #[test]
        fn nearly_sorted(costs in prop::collection::vec(0.0f64..1e6, 1..300)) {
            let mut queue = Queue::new();
            for (i, &cost) in costs.iter().enumerate() {
                queue.push(cost, Entry { ends: [i as u32, 0], stamp: 0, is_priced: false });
            }
            let popped: Vec<f64> = all(&mut queue).into_iter().map(|i| costs[i as usize]).collect();
            prop_assert_eq!(popped.len(), costs.len());
            prop_assert!(popped.windows(2).all(|w| w[0] <= w[1] * (1.0 + 1.0 / 16.0)));
        }
    }

    #[test]
    fn equal_costs_are_first_in_first_out() {
        let mut queue = Queue::new();
        for i in 0..3 {
            queue.push(0.0, Entry { ends: [i, 0], stamp: 0, is_priced: false });
        }
        assert!((0..3).eq(all(&mut queue)));
    }
}
