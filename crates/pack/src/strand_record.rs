//! The record of a window of a strand: as long as that of a strip of one window, so that both are found the same way.
//!
//! Points of a strand follow each other among the vertices of the cluster, so the first one's place tells all; the other
//! bytes are their radii.

use crate::strip_record::{WINDOW_RECORD_BYTES, WindowHead};
use raystrips_geom::strand::WINDOW_SEGMENTS;
use raystrips_geom::strip::WINDOW_VERTICES;

/// Points of a full window.
pub const STRAND_POINTS: usize = WINDOW_SEGMENTS + 1;

/// A window of a strand in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StrandView<'a> {
    /// Segments, 1 to 6.
    pub segments: usize,
    /// Vertex of the cluster that is its first point; the others follow.
    pub first: u8,
    /// Codes of the radii of its points, and behind them whatever fills up the record.
    pub radii: &'a [u8; STRAND_POINTS],
}

impl<'a> StrandView<'a> {
    /// What a window with this head and these references is, if it is of a strand.
    #[inline(always)]
    pub fn of(head: WindowHead, refs: &'a [u8; WINDOW_VERTICES]) -> Option<StrandView<'a>> {
        let [first, radii @ ..] = refs;
        head.is_strand().then_some(StrandView { segments: head.segments(), first: *first, radii })
    }

    /// Vertices of its points; the last one stands for those that it lacks.
    #[inline(always)]
    pub fn refs(&self) -> [u8; WINDOW_VERTICES] {
        std::array::from_fn(|k| self.first.wrapping_add(k.min(self.segments) as u8))
    }
}

/// Appends the record of a window whose first point is vertex `first` of the cluster.
///
/// # Panics
/// If there are too few or too many radii.
pub fn push_strand(out: &mut Vec<u8>, first: u8, radii: &[u8]) {
    let segments = radii.len() - 1;
    assert!((1..=WINDOW_SEGMENTS).contains(&segments), "{segments} segments in a window");
    let begin = out.len();
    out.extend([WindowHead::strand(segments).0, first]);
    out.extend_from_slice(radii);
    out.resize(begin + WINDOW_RECORD_BYTES, 0);
}
