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
    /// Eight words.
    type W: Copy;

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
    /// The lanes whose bit of `mask` is set, in their order, in the first lanes; what the others hold is not said.
    fn compress(self, mask: u32, a: Self::F, w: Self::W) -> (Self::F, Self::W);
    /// From memory.
    fn words(self, w: &[u32; LANES]) -> Self::W;
    /// From memory, each word with `high` as its upper half.
    fn half_words(self, w: &[u16; LANES], high: u16) -> Self::W;
    /// Lane *i* is lane `lanes[i]` of `w`.
    fn permute_words(self, w: Self::W, lanes: &Words) -> Self::W;
    /// To memory.
    fn store_words(self, w: Self::W) -> [u32; LANES];
    /// a where `mask` is -1, b where it is 0.
    fn select(self, mask: &Words, a: Self::F, b: Self::F) -> Self::F;
    /// Components `order[1]`, `order[2]`, `order[3]` less one of the points `refs`, which begin at `points[1]`,
    /// three f32 each.
    ///
    /// # Panics
    /// If there is no such point.
    fn gather(self, points: &[f32], refs: &[u8; LANES], order: &[i32; 4]) -> [Self::F; 3];
}

/// For each mask of lanes: the lanes that are set, in their order, a byte each.
static SET_LANES: [[u8; LANES]; 256] = {
    let mut table = [[0; LANES]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < LANES {
            if mask >> lane & 1 == 1 {
                table[mask][count] = lane as u8;
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};
