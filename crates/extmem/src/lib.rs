//! Work larger than memory: a budget that everything large is taken from, bytes that go to disk when it is spent, a
//! journal of what is done, and sorting.
//!
//! Knows nothing of meshes.

mod block_file;
mod budget;
pub mod disk;
mod journal;
mod scratch;
mod sort;
mod spool;
mod system;

pub use block_file::{BlockBuffer, BlockFile};
pub use budget::{MemoryBudget, Reservation};
pub use journal::Journal;
pub use scratch::{Begun, ScratchDir};
pub use sort::ExternalSort;
pub use spool::{Extent, Spool};
pub use system::{peak_process_memory, process_memory, refuse_huge_pages, spare_memory};
