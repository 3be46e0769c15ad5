//! The record of a window of a strand: where its points are in the [code](crate::strand_code) of its cluster.

use crate::strip_record::WindowHead;

/// Bytes of a record.
pub const STRAND_RECORD_BYTES: usize = 2;

/// Bit of a head that is set where the window ends in the middle of its pair.
const BACKWARD: u8 = 1 << 3;

/// A window of a strand in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StrandView {
    /// Segments, 1 to 6.
    pub segments: usize,
    /// Number of the pair that it belongs to.
    pub pair: u8,
    /// Whether it ends in the middle of the pair instead of beginning there.
    pub is_backward: bool,
}

impl StrandView {
    /// What the record of a window of a strand says.
    #[inline(always)]
    pub fn of(record: &[u8; STRAND_RECORD_BYTES]) -> StrandView {
        let [head, pair] = *record;
        StrandView { segments: WindowHead(head).segments(), pair, is_backward: head & BACKWARD != 0 }
    }

    /// Its record.
    pub fn record(self) -> [u8; STRAND_RECORD_BYTES] {
        let backward = if self.is_backward { BACKWARD } else { 0 };
        [self.head().0 | backward, self.pair]
    }

    /// Its head, but for the direction.
    #[inline(always)]
    pub fn head(self) -> WindowHead {
        WindowHead::strand(self.segments)
    }
}
