//! Eight f32 at a time.
//!
//! [`Simd`] is the vocabulary in which box and window tests are written once. Every operation is defined per
//! lane as IEEE arithmetic without contraction, so all implementations give the same bits.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
pub(crate) mod portable;

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

    /// `x` in all lanes.
    fn splat(self, x: f32) -> Self::F;
    /// To memory.
    fn store(self, x: Self::F) -> [f32; LANES];
    /// Eight small numbers.
    fn convert(self, x: &[u8; LANES]) -> Self::F;
    /// a + b.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// a - b.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// a * b.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
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
    /// Components `order[1]`, `order[2]`, `order[3]` less one of the points `refs`, which begin at `points[1]`,
    /// three f32 each.
    ///
    /// # Panics
    /// If there is no such point.
    fn gather(self, points: &[f32], refs: &[u8; LANES], order: &[i32; 4]) -> [Self::F; 3];
}
