//! The record of a strip in a page.
//!
//! Most strips are of one window and fill [`WINDOW_RECORD_BYTES`] bytes: a head and eight references, the last one
//! repeated where there are fewer triangles. So in a page of such strips the number of a strip says where it is.
//! A page with longer strips has a table of places before the records, each the number of windows, the tree over
//! them, their heads, and n + 2 references.

use crate::layout::MAX_STRIP_TRIANGLES;
use crate::strand_record::{STRAND_RECORD_BYTES, StrandView};
use raystrips_geom::strip::{WINDOW_TRIANGLES, WINDOW_VERTICES, strip_triangle, window_count};

/// Bytes of one [`SplitNode`].
pub const SPLIT_BYTES: usize = 4;
/// Bytes of a strip in a page whose strips have one window each.
pub const WINDOW_RECORD_BYTES: usize = 1 + WINDOW_VERTICES;
/// Most windows of a strip.
pub const MAX_STRIP_WINDOWS: usize = MAX_STRIP_TRIANGLES.div_ceil(WINDOW_TRIANGLES);
/// Planes of the page's grid from one plane of a split to the next.
pub const SPLIT_PLANE_STEP: u16 = 4;

/// A split of a strip into a left and a right part along one axis: the spatial kd-tree of Lauterbach et al.
/// 2007. Planes are every fourth of the page's grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SplitNode {
    /// 0 to 2.
    pub axis: u8,
    /// True where the right part of the strip is the lower one along the axis.
    pub reversed: bool,
    /// Greatest plane of the lower part, of 14 bits.
    pub lower_max: u16,
    /// Least plane of the upper part, of 14 bits.
    pub upper_min: u16,
}

impl SplitNode {
    /// As stored.
    pub fn to_bits(self) -> u32 {
        u32::from(self.axis)
            | u32::from(self.reversed) << 2
            | u32::from(self.lower_max) << 3
            | u32::from(self.upper_min) << 17
    }

    /// From what was stored. The bit that a checked page never has set is left out.
    #[inline]
    pub fn from_bits(bits: u32) -> SplitNode {
        let plane = |shift: u32| (bits >> shift & 0x3FFF) as u16;
        SplitNode {
            axis: (bits & 3) as u8,
            reversed: bits & 4 != 0,
            lower_max: plane(3),
            upper_min: plane(17),
        }
    }
}

/// Bits of a head that all are set for a window of a strand.
const STRAND: u8 = 7 << 5;

/// What a window's first byte says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowHead(pub u8);

impl WindowHead {
    /// Head of a window of `count` triangles with the given turn bits.
    pub fn new(count: usize, turns: u8) -> WindowHead {
        WindowHead(((count - 1) as u8) << 5 | turns >> 1)
    }

    /// Triangles.
    #[inline(always)]
    pub fn count(self) -> usize {
        usize::from(self.0 >> 5) + 1
    }

    /// Turn bits; bit 0 is clear.
    #[inline(always)]
    pub fn turns(self) -> u8 {
        (self.0 & 31) << 1
    }

    /// Head of a window of a strand: a count that no window of triangles has, then that of its segments.
    pub fn strand(segments: usize) -> WindowHead {
        WindowHead(STRAND | (segments - 1) as u8)
    }

    /// Whether the window is of a strand.
    #[inline(always)]
    pub fn is_strand(self) -> bool {
        self.0 & STRAND == STRAND
    }

    /// Segments, if it is of a strand.
    #[inline(always)]
    pub fn segments(self) -> usize {
        usize::from(self.0 & 7) + 1
    }
}

/// A strip in place. Cheap to copy.
#[derive(Clone, Copy, Debug)]
pub struct StripView<'a> {
    /// (w - 1) splits.
    tree: &'a [u8],
    /// A byte a window.
    heads: &'a [u8],
    /// A byte a vertex, and after them whatever the record is filled up with.
    refs: &'a [u8],
}

/// A window of a strip: its head, and at least as many references as it has vertices.
pub type Window<'a> = (WindowHead, &'a [u8]);

impl<'a> StripView<'a> {
    /// The strip of one window whose record begins `record`. `None` where it is cut off.
    #[inline(always)]
    pub(crate) fn single(record: &'a [u8]) -> Option<StripView<'a>> {
        let record: &[u8; WINDOW_RECORD_BYTES] = record.first_chunk()?;
        let (heads, refs) = record.split_at(1);
        Some(StripView { tree: &[], heads, refs })
    }

    /// The window of a strand whose record this is.
    #[inline(always)]
    pub(crate) fn strand_window(record: &'a [u8; STRAND_RECORD_BYTES]) -> StripView<'a> {
        let (heads, refs) = record.split_at(1);
        StripView { tree: &[], heads, refs }
    }

    /// The strip of any length whose record begins `record`. `None` where it is cut off, which never happens in a
    /// checked page.
    #[inline]
    pub(crate) fn long(record: &'a [u8]) -> Option<StripView<'a>> {
        let windows = usize::from(*record.first()?);
        let tree_end = 1 + windows.checked_sub(1)? * SPLIT_BYTES;
        let heads = record.get(tree_end..tree_end + windows)?;
        let vertices = (windows - 1) * WINDOW_TRIANGLES + WindowHead(*heads.last()?).count() + 2;
        Some(StripView {
            tree: &record[1..tree_end],
            heads,
            refs: record.get(tree_end + windows..tree_end + windows + vertices)?,
        })
    }

    /// Triangles, or segments of a strand.
    #[inline]
    pub fn primitive_count(&self) -> usize {
        self.strand().map_or_else(|| self.triangle_count(), |strand| strand.segments)
    }

    /// The window of a strand that it is, if it is one.
    #[inline]
    pub fn strand(&self) -> Option<StrandView> {
        WindowHead(self.heads[0]).is_strand().then(|| StrandView::of(&[self.heads[0], self.refs[0]]))
    }

    /// Triangles of a strip that is no strand.
    #[inline]
    fn triangle_count(&self) -> usize {
        let full = self.heads.len() - 1;
        full * WINDOW_TRIANGLES + WindowHead(self.heads[full]).count()
    }

    /// Windows.
    #[inline(always)]
    pub fn window_count(&self) -> usize {
        self.heads.len()
    }

    /// Bytes of the tree.
    pub(crate) fn tree_bytes(&self) -> usize {
        self.tree.len()
    }

    /// Length of the record of a strip of any length.
    pub(crate) fn long_record_bytes(&self) -> usize {
        1 + self.tree.len() + self.heads.len() + self.refs.len()
    }

    /// Node `i` of the strip's tree.
    #[inline]
    pub fn split(&self, i: usize) -> SplitNode {
        SplitNode::from_bits(self.split_bits(i))
    }

    pub(crate) fn split_bits(&self, i: usize) -> u32 {
        let b = &self.tree[i * SPLIT_BYTES..];
        u32::from_le_bytes([b[0], b[1], b[2], b[3]])
    }

    /// Heads of the windows, a byte each.
    pub fn heads(&self) -> &'a [u8] {
        self.heads
    }

    /// Vertices of the cluster, by first use in the strip, if it is no strand.
    pub fn refs(&self) -> &'a [u8] {
        &self.refs[..self.triangle_count() + 2]
    }

    /// Everything stored as references, also what fills up a record.
    pub(crate) fn all_refs(&self) -> &'a [u8] {
        self.refs
    }

    /// Window `w`.
    #[inline(always)]
    pub fn window(&self, w: usize) -> Window<'a> {
        (WindowHead(self.heads[w]), &self.refs[w * WINDOW_TRIANGLES..])
    }

    /// Whether the strip's triangles before window `w` flip the winding of those after.
    #[inline]
    pub fn is_reversed_before(&self, w: usize) -> bool {
        let flips = |&head: &u8| WINDOW_TRIANGLES as u32 - WindowHead(head).turns().count_ones();
        self.heads[..w].iter().map(flips).sum::<u32>() & 1 == 1
    }

    /// Cluster vertices of triangle `i` of a strip that is no strand, wound as in the mesh.
    pub fn triangle(&self, i: usize) -> [u8; 3] {
        let mut turns = [0; MAX_STRIP_WINDOWS];
        for (turns, &head) in turns.iter_mut().zip(self.heads) {
            *turns = WindowHead(head).turns();
        }
        strip_triangle(&turns, i).map(|k| self.refs[k])
    }
}

/// Appends the record of a strip of one window.
///
/// # Panics
/// If it has more triangles.
pub fn push_window(out: &mut Vec<u8>, turns: u8, refs: &[u8]) {
    let n = refs.len() - 2;
    assert!((1..=WINDOW_TRIANGLES).contains(&n), "{n} triangles in a window");
    out.push(WindowHead::new(n, turns).0);
    out.extend((0..WINDOW_VERTICES).map(|k| refs[k.min(n + 1)]));
}

/// Appends the record of a strip of any length.
///
/// # Panics
/// If the parts do not fit each other.
pub fn push_long(out: &mut Vec<u8>, tree: &[SplitNode], turns: &[u8], refs: &[u8]) {
    let n = refs.len() - 2;
    assert!((1..=MAX_STRIP_TRIANGLES).contains(&n), "{n} triangles in a strip");
    assert_eq!(turns.len(), window_count(n));
    assert_eq!(tree.len(), turns.len() - 1);
    out.push(turns.len() as u8);
    out.extend(tree.iter().flat_map(|node| node.to_bits().to_le_bytes()));
    let count = |w: usize| (n - w * WINDOW_TRIANGLES).min(WINDOW_TRIANGLES);
    out.extend(turns.iter().enumerate().map(|(w, &bits)| WindowHead::new(count(w), bits).0));
    out.extend_from_slice(refs);
}

/// Bytes of an entry of the table of places.
pub const PLACE_BYTES: usize = 4;

/// Bytes of strips in a page, without padding, from the number of triangles of each.
pub fn strips_bytes(triangle_counts: impl Iterator<Item = usize> + Clone) -> usize {
    let windows = triangle_counts.clone().map(window_count);
    match windows.clone().max() {
        Some(1) => windows.count() * WINDOW_RECORD_BYTES,
        _ => triangle_counts.map(|n| PLACE_BYTES + long_record_bytes(n)).sum(),
    }
}

/// Length of the record of a strip of `n` triangles in a cluster with strips of several windows.
fn long_record_bytes(n: usize) -> usize {
    let windows = window_count(n);
    1 + (windows - 1) * SPLIT_BYTES + windows + n + 2
}
