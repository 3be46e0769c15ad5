//! Eight f32 as an array: for every processor, and what the other implementations are compared with.

use super::{LANES, Simd, Words};
use crate::boxes::{each, max, min};
use std::array::from_fn;

/// Instructions that every processor has.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

impl Simd for Portable {
    type F = [f32; LANES];

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [x; LANES]
    }

    #[inline(always)]
    fn store(self, x: Self::F) -> [f32; LANES] {
        x
    }

    #[inline(always)]
    fn convert(self, x: &[u8; LANES]) -> Self::F {
        from_fn(|i| f32::from(x[i]))
    }

    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn neg(self, a: Self::F) -> Self::F {
        from_fn(|i| -a[i])
    }

    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        from_fn(|i| min(a[i], b[i]))
    }

    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        from_fn(|i| max(a[i], b[i]))
    }

    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> u32 {
        (0..LANES).map(|i| u32::from(a[i] <= b[i]) << i).sum()
    }

    #[inline(always)]
    fn eq(self, a: Self::F, b: Self::F) -> u32 {
        (0..LANES).map(|i| u32::from(a[i] == b[i]) << i).sum()
    }

    #[inline(always)]
    fn permute(self, a: Self::F, lanes: &Words) -> Self::F {
        from_fn(|i| a[lanes.0[i] as usize % LANES])
    }

    #[inline(always)]
    fn select(self, mask: &Words, a: Self::F, b: Self::F) -> Self::F {
        from_fn(|i| if mask.0[i] != 0 { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn gather(self, points: &[f32], refs: &[u8; LANES], order: &[i32; 4]) -> [Self::F; 3] {
        each(|k| from_fn(|i| points[3 * usize::from(refs[i]) + order[k + 1] as usize]))
    }
}
