//! Closest hit and any hit over the pages of a pack.
//!
//! A ray descends the nodes above the pages, then the nodes of a page, then the tree along a strip, and is
//! tested against windows of six triangles. Two promises hold for every ray and are what makes the rest of the
//! program simple:
//!
//! - **Watertight**: a ray that meets a closed mesh hits it, also at edges and vertices ([`window`]), and no box
//!   on the way loses it ([`boxes`]).
//! - **One answer**: the hit does not depend on the order in which triangles are met, on threads, or on the
//!   instructions used. It is the least of (distance, instance, place in the pack) over all triangles hit. Boxes are wide
//!   enough that their entry is never behind a hit in them, so that skipping what lies behind the best hit can
//!   never skip a better one.

mod boxes;
mod kernel;
mod observe;
mod opacity;
mod packet;
mod pages;
mod placed;
mod prepared;
mod rays;
mod scene;
mod simd;
mod strand;
mod stream;
mod strip;
mod walk;
mod window;

pub use kernel::{Buffered, Kernel, SetAside, Tracer, VisitTracer};
pub use observe::{Access, Part};
pub use packet::PACKET;
pub use placed::{placed, placed_attributes};
pub use rays::{Cursor, Parked, Place, RayBuffer};
pub use raystrips_pack::{
    AttributeView, Emitter, GeometryBounds, Instance, PackError, PageId, PageView, ProxyKind,
};
pub use raystrips_paging::{Loan, OpenError, PagePool, PoolCounts, Runs, Visit};
pub use scene::{ResolvedHit, Scene, locate_in, page_of};
