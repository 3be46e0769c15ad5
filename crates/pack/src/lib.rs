//! The pack file: bytes in, checked views out.
//!
//! A pack (`*.rsp`) holds a scene ready to be traced: pages of Ray-Strips under wide quantized nodes, a small
//! hierarchy above the pages, and a manifest. `FORMAT.md` beside this crate's manifest describes every byte;
//! `tests/format.rs` and `tests/format_manifest.rs` hold this code against it.
//!
//! Three types for the three states of a page: [`PageBuilder`] makes its bytes, [`check_page`] distrusts them
//! once, [`PageView`] reads what was checked.

#[cfg(target_endian = "big")]
compile_error!(
    "pages are read in place and are little-endian; a big-endian reader would have to swap them first"
);

pub mod attributes;
pub mod error;
pub mod layout;
pub mod manifest;
mod nodes;
pub mod page;
mod proxy;
pub mod reader;
mod sections;
mod shading;
pub mod strand_code;
mod strand_pairs;
pub mod strand_record;
pub mod strip_record;
pub mod tile_code;
mod top;
pub mod vertices;
pub mod writer;

pub use attributes::{AttributeBuilder, AttributeView, check_attributes};
pub use error::PackError;
pub use layout::{
    BlockEntry, Emitter, GeometryBounds, Instance, PageEntry, PageId, TopEntry, TopNode, WideNode,
};
pub use manifest::{ByteCounts, Dropped, Manifest};
pub use page::{ClusterView, PageView, builder::PageBuilder, check::check_checksum, check::check_page};
pub use proxy::ProxyKind;
pub use reader::Pack;
pub use shading::Shading;
pub use strand_code::{StrandCode, StrandPoints};
pub use strand_pairs::{StoredStrands, StrandParts};
pub use strand_record::{STRAND_RECORD_BYTES, StrandView};
pub use strip_record::{StripView, WindowHead};
pub use vertices::VertexCode;
pub use writer::{PackContents, PackWriter, PageRecord};
