//! Memory for pages: frames as large as the pages in them, within a budget.

use memmap2::MmapMut;
use raystrips_extmem::{MemoryBudget, Reservation};
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Frames without a page may take this part of the budget.
const SPARE_PART: u64 = 64;
/// And this many bytes.
const MOST_SPARE_BYTES: u64 = 1 << 20;

/// Memory for one page after the other of the same size. It is mapped, so that the system gets it back when it is used
/// for something else: an allocator would keep it for the thread that asked for it.
pub(crate) struct Frame {
    bytes: MmapMut,
    /// Its share of the budget.
    memory: Reservation,
}

impl Frame {
    /// As large as `memory`; `None` where the system has no memory to map.
    fn new(memory: Reservation) -> Option<Frame> {
        Some(Frame { bytes: MmapMut::map_anon(memory.bytes() as usize).ok()?, memory })
    }

    /// Its bytes, which begin at a page of the system's.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The same, to be filled.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.bytes
    }
}

/// Gives out frames. Some that come back are kept for pages of their size: to unmap and map memory for each page stops
/// all threads for a moment.
pub(crate) struct Frames {
    budget: MemoryBudget,
    /// The one that came back last is at the end.
    spares: Mutex<VecDeque<Frame>>,
    most_spare_bytes: u64,
}

impl Frames {
    /// Frames of so many bytes in all.
    pub fn new(bytes: u64) -> Frames {
        Frames {
            budget: MemoryBudget::new(bytes),
            spares: Mutex::default(),
            most_spare_bytes: (bytes / SPARE_PART).min(MOST_SPARE_BYTES),
        }
    }

    /// A frame of so many bytes, if there is memory for it.
    pub fn take(&self, bytes: u64) -> Option<Frame> {
        let mut spares = self.spares();
        if let Some(i) = spares.iter().position(|frame| frame.memory.bytes() == bytes) {
            return spares.remove(i);
        }
        drop(spares);
        self.take_memory(bytes).and_then(Frame::new)
    }

    /// Memory of the budget for something else.
    pub fn take_memory(&self, bytes: u64) -> Option<Reservation> {
        self.budget.take(bytes)
    }

    /// Takes a frame back.
    pub fn put(&self, frame: Frame) {
        let mut spares = self.spares();
        spares.push_back(frame);
        while spares.iter().map(|frame| frame.memory.bytes()).sum::<u64>() > self.most_spare_bytes {
            spares.pop_front();
        }
    }

    /// Gives the memory of a frame without a page back to the budget; false if there is none.
    pub fn drop_spare(&self) -> bool {
        self.spares().pop_front().is_some()
    }

    fn spares(&self) -> MutexGuard<'_, VecDeque<Frame>> {
        self.spares.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIB: u64 = 1024;

    #[test]
    fn frames_fit_and_their_memory_comes_back() {
        let frames = Frames::new(64 * 8 * KIB);
        let all: Vec<Frame> = (0..64).map_while(|_| frames.take(8 * KIB)).collect();
        assert!(all.len() == 64 && frames.take(4 * KIB).is_none());
        all.into_iter().for_each(|frame| frames.put(frame));
        // One of them is kept, and is given to who wants one of its size.
        assert!(frames.take(8 * KIB).is_some_and(|frame| frame.bytes().len() as u64 == 8 * KIB));
        frames.put(frames.take(8 * KIB).unwrap());
        assert!(frames.take_memory(64 * 8 * KIB).is_none());
        assert!(frames.drop_spare() && !frames.drop_spare());
        assert!(frames.take_memory(64 * 8 * KIB).is_some());
    }
}
