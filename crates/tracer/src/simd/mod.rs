//! Eight f32 at a time.
//!
//! [`Simd`] is the vocabulary in which box and window tests are written once. Every operation but
//! [`Simd::mul_add`] is defined per lane as IEEE arithmetic without contraction, so all implementations give the
//! same bits.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
pub(crate) mod portable;

use raystrips_pack::{ClusterView, StrandView, VertexCode};

/// Lanes of a vector.
pub(crate) const LANES: usize = 8;

/// A permutation or mask, a word a lane.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(crate) struct Words(pub [i32; LANES]);

/// A set of instructions. The value is the proof that the processor has them.
pub(crate) trait Simd: Copy {
    /// Eight f32.
    type F: Copy;
    /// Eight u32.
    type I: Copy;
    /// Four f64.
    type D: Copy;

    /// `x` in all lanes.
    fn splat(self, x: f32) -> Self::F;
    /// From memory.
    fn load(self, x: &[f32; LANES]) -> Self::F;
    /// From memory.
    fn load_words(self, x: &[u32; LANES]) -> Self::I;
    /// To memory.
    fn store(self, x: Self::F) -> [f32; LANES];
    /// `first`, `first` + 1, ...
    fn count_from(self, first: u32) -> Self::I;
    /// The bytes of a word, the lowest in lane 0.
    fn convert_u8(self, x: u64) -> Self::F;
    /// Four f32, in lanes 0 to 3 and again in 4 to 7.
    fn load_twice(self, x: &[f32; 4]) -> Self::F;
    /// The 16-bit parts of a word, the lowest in lanes 0 and 4.
    fn convert_u16_twice(self, x: u64) -> Self::F;
    /// 2 to the power of each of the signed bytes of a word, which must be above -127, the lowest in lanes 0 and 4.
    fn powers_of_two_twice(self, x: u32) -> Self::F;
    /// Lane `LANE` in lanes 0 to 3, lane `LANE` + 4 in lanes 4 to 7.
    fn spread<const LANE: i32>(self, x: Self::F) -> Self::F;
    /// a + b.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// a - b.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// a * b.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// a * b + c, rounded once or twice: only for what has a slack.
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// |a|.
    fn abs(self, a: Self::F) -> Self::F;
    /// -a.
    fn neg(self, a: Self::F) -> Self::F;
    /// a if a < b, else b: also where one is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// a if a > b, else b: also where one is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Bit *i*: a <= b in lane *i*.
    fn le(self, a: Self::F, b: Self::F) -> u32;
    /// Bit *i*: a = b in lane *i*.
    fn eq(self, a: Self::F, b: Self::F) -> u32;
    /// Lane *i* is lane `lanes[i]` of `a`.
    fn permute(self, a: Self::F, lanes: &Words) -> Self::F;
    /// a where `mask` is -1, b where it is 0.
    fn select(self, mask: &Words, a: Self::F, b: Self::F) -> Self::F;

    /// `x` in all lanes.
    fn splat64(self, x: f64) -> Self::D;
    /// From memory.
    fn widen(self, x: &[f32; 4]) -> Self::D;
    /// To memory.
    fn store64(self, x: Self::D) -> [f64; 4];
    /// a - b.
    fn sub64(self, a: Self::D, b: Self::D) -> Self::D;
    /// a * b.
    fn mul64(self, a: Self::D, b: Self::D) -> Self::D;
    /// Lane *i* of the first three is lane (*i* + `BY`) mod 3 of `a`. `BY` is 1 or 2.
    fn rotate64<const BY: usize>(self, a: Self::D) -> Self::D;

    /// Sorts the lanes below `count` with `tnear <= tfar` by falling `tnear` and writes them to memory: as keys, see
    /// [`greatest_key`], and `links`. Their number is given; what is written behind them means nothing.
    fn store_sorted(
        self,
        boxes: crate::boxes::Slabs<Self::F>,
        count: usize,
        links: Self::I,
        to: (&mut [u32; LANES], &mut [u32; LANES]),
    ) -> usize;

    /// Coordinates x, y, z of the vertices `refs`.
    ///
    /// # Panics
    /// If `vertices` has less than [`raystrips_pack::vertices::VERTEX_REACH`] bytes.
    fn decode(self, vertices: &[u8], code: &VertexCode, refs: &[u8; LANES]) -> [Self::F; 3];

    /// Coordinates x, y, z of the points of a window of a strand, and their radii. The last point stands for those that it
    /// lacks.
    fn decode_strand(self, cluster: &ClusterView, strand: StrandView) -> ([Self::F; 3], Self::F);

    /// Asks for the vertices `refs`, which will be decoded soon.
    fn prefetch_vertices(self, vertices: &[u8], code: &VertexCode, refs: &[u8; LANES]);

    /// Asks for the cache line of `x`, which will be needed soon.
    fn prefetch<T>(self, x: &T);
}

/// Bits of a key that tell its lane.
const KEY_LANE: u32 = LANES as u32 - 1;

/// The greatest key of a box that is met at `distance` or before; a key is the distance of its lane, not below zero,
/// rounded down by at most seven units in the last place.
#[inline(always)]
pub(crate) fn greatest_key(distance: f32) -> u32 {
    (if distance > 0.0 { distance } else { 0.0 }).to_bits() | KEY_LANE
}
