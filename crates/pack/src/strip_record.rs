//! One Ray-Strip in the bytes of a cluster.
//!
//! `n | tree: (w - 1) x 3 bytes | turns: w bytes | refs: n + 2 bytes` for *n* triangles in *w* windows. The tree
//! is balanced and implied by *n*: it splits the windows in halves, the left one the greater, and stands in
//! pre-order, so the left child of node *i* is *i* + 1 and the right one *i* + (windows on the left).
//! (Lauterbach et al. 2007, section 4.1, split the triangles and give up pre-order for heap order; splitting
//! units of the leaf size keeps the node count at *w* - 1 for every *n*.)

use crate::layout::MAX_STRIP_TRIANGLES;
use raystrips_geom::strip::{WINDOW_TRIANGLES, strip_triangle, window_count};

/// Bytes of one [`SplitNode`].
pub const SPLIT_BYTES: usize = 3;

/// A split of a strip into a left and a right part along one axis: the spatial kd-tree of Lauterbach et al.
/// 2007. Planes are on the grid of the node that holds the strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SplitNode {
    /// 0 to 2.
    pub axis: u8,
    /// True where the right part of the strip is the lower one along the axis.
    pub reversed: bool,
    /// Greatest plane of the lower part.
    pub lower_max: u8,
    /// Least plane of the upper part.
    pub upper_min: u8,
}

impl SplitNode {
    /// As stored.
    pub fn to_bytes(self) -> [u8; SPLIT_BYTES] {
        [self.axis | u8::from(self.reversed) << 2, self.lower_max, self.upper_min]
    }

    /// From what was stored. Bits that a checked page never has set are left out.
    #[inline]
    pub fn from_bytes(b: [u8; SPLIT_BYTES]) -> SplitNode {
        SplitNode { axis: b[0] & 3, reversed: b[0] & 4 != 0, lower_max: b[1], upper_min: b[2] }
    }
}

/// A strip in place. Cheap to copy.
#[derive(Clone, Copy, Debug)]
pub struct StripView<'a> {
    /// (w - 1) x 3 bytes.
    tree: &'a [u8],
    /// A byte a window.
    turns: &'a [u8],
    /// A byte a vertex.
    refs: &'a [u8],
}

impl<'a> StripView<'a> {
    /// The strip that begins at `offset` of a cluster's strips. `None` where it does not fit, which never
    /// happens in a checked page.
    #[inline]
    pub fn at(strips: &'a [u8], offset: usize) -> Option<StripView<'a>> {
        let bytes = strips.get(offset..)?;
        let n = usize::from(*bytes.first()?);
        if n == 0 {
            return None;
        }
        let windows = window_count(n);
        let tree_end = 1 + (windows - 1) * SPLIT_BYTES;
        let turns_end = tree_end + windows;
        Some(StripView {
            tree: bytes.get(1..tree_end)?,
            turns: bytes.get(tree_end..turns_end)?,
            refs: bytes.get(turns_end..turns_end + n + 2)?,
        })
    }

    /// Triangles.
    #[inline]
    pub fn triangle_count(&self) -> usize {
        self.refs.len() - 2
    }

    /// Windows.
    #[inline]
    pub fn window_count(&self) -> usize {
        self.turns.len()
    }

    /// Length of the whole record.
    pub fn record_bytes(&self) -> usize {
        1 + self.tree.len() + self.turns.len() + self.refs.len()
    }

    /// Node `i` of the strip's tree.
    #[inline]
    pub fn split(&self, i: usize) -> SplitNode {
        let b = &self.tree[i * SPLIT_BYTES..];
        SplitNode::from_bytes([b[0], b[1], b[2]])
    }

    /// The tree as stored, [`SPLIT_BYTES`] a node.
    pub(crate) fn tree(&self) -> &'a [u8] {
        self.tree
    }

    /// Turn bits, a byte a window.
    #[inline]
    pub fn turns(&self) -> &'a [u8] {
        self.turns
    }

    /// Vertices of the cluster, by first use in the strip.
    pub fn refs(&self) -> &'a [u8] {
        self.refs
    }

    /// Triangles of window `w`, turn bits, and its vertices.
    #[inline]
    pub fn window(&self, w: usize) -> (usize, u8, &'a [u8]) {
        let first = w * WINDOW_TRIANGLES;
        let count = (self.triangle_count() - first).min(WINDOW_TRIANGLES);
        (count, self.turns[w], &self.refs[first..first + count + 2])
    }

    /// Cluster vertices of triangle `i`, wound as in the mesh.
    pub fn triangle(&self, i: usize) -> [u8; 3] {
        strip_triangle(self.turns, i).map(|k| self.refs[k])
    }
}

/// Appends a strip to the strips of a cluster and says where it begins.
///
/// # Panics
/// If the parts do not fit each other.
pub fn push_strip(out: &mut Vec<u8>, tree: &[SplitNode], turns: &[u8], refs: &[u8]) -> usize {
    let n = refs.len() - 2;
    assert!((1..=MAX_STRIP_TRIANGLES).contains(&n), "{n} triangles in a strip");
    assert_eq!(turns.len(), window_count(n));
    assert_eq!(tree.len(), turns.len() - 1);
    let offset = out.len();
    out.push(n as u8);
    out.extend(tree.iter().flat_map(|node| node.to_bytes()));
    out.extend_from_slice(turns);
    out.extend_from_slice(refs);
    offset
}

/// Length of the record of a strip of `n` triangles.
pub fn record_bytes(n: usize) -> usize {
    let windows = window_count(n);
    1 + (windows - 1) * SPLIT_BYTES + windows + n + 2
}
