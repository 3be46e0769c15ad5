//! Strands of hair on their way to the pack.
//!
//! The import cuts them into [windows](cut) of a few segments. From then on a window is to strands what a triangle is to
//! a mesh: it is counted, distributed to a piece, and found again there beside the others of its strand.

mod cut;
mod piece;
mod range;
mod select;
mod thin;

pub(crate) use cut::of_batch;
pub(crate) use piece::{PieceOfStrands, SortedStrands};
pub(crate) use range::RadiusRange;
pub(crate) use select::Selected;
pub(crate) use thin::StrandThinning;
