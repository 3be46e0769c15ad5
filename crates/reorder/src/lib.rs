//! Holds rays back and hands them out in a better order. Knows nothing of meshes or shading.
//!
//! [`PageQueues`] hold rays that wait for pages of a scene that is larger than memory, and say which page is read next.
//! [`Keys`] give rays places on a curve, by one of several [`Ordering`]s, and a [`RayStore`] sorts them.

mod ordering;
mod page_queues;
mod radix_sort;
mod ray_store;

pub use ordering::{Keys, Ordering};
pub use page_queues::{Amount, Limits, PageQueues, Parcel, Work};
pub use ray_store::{RayStore, SortedRays};
pub use raystrips_geom::curve::Curve;
