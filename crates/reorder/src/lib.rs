//! Holds rays back and hands them out in a better order. Knows nothing of meshes or shading.
//!
//! [`PageQueues`] hold rays that wait for pages of a scene that is larger than memory, and say which page is read next.

mod page_queues;

pub use page_queues::{Amount, Limits, PageQueues, Parcel, Work};
