//! Eight f32 as an AVX register.
#![allow(unsafe_code)]

use super::{LANES, Simd, Words};
use std::arch::x86_64::*;

/// The processor has AVX2.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// Proof that the processor has AVX2.
    ///
    /// # Safety
    /// It has.
    #[inline(always)]
    pub(crate) unsafe fn assume() -> Avx2 {
        Avx2(())
    }
}

/// Operations of one intrinsic each.
macro_rules! lanewise {
    ($($name:ident($($arg:ident),*) = $intrinsic:ident;)*) => {$(
        #[inline(always)]
        fn $name(self, $($arg: __m256),*) -> __m256 {
            // SAFETY: a value of this type proves that the processor has AVX2.
            unsafe { $intrinsic($($arg),*) }
        }
    )*};
}

impl Simd for Avx2 {
    type F = __m256;

    lanewise! {
        add(a, b) = _mm256_add_ps;
        sub(a, b) = _mm256_sub_ps;
        mul(a, b) = _mm256_mul_ps;
        min(a, b) = _mm256_min_ps;
        max(a, b) = _mm256_max_ps;
    }

    #[inline(always)]
    fn splat(self, x: f32) -> __m256 {
        // SAFETY: a value of this type proves that the processor has AVX2.
        unsafe { _mm256_set1_ps(x) }
    }

    #[inline(always)]
    fn store(self, x: __m256) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        // SAFETY: as above; eight f32 are written to eight f32, aligned or not.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), x) };
        out
    }

    #[inline(always)]
    fn convert(self, x: &[u8; LANES]) -> __m256 {
        // SAFETY: as above; eight bytes are read from eight bytes.
        unsafe { _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(x.as_ptr().cast()))) }
    }

    #[inline(always)]
    fn neg(self, a: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_xor_ps(a, _mm256_set1_ps(-0.0)) }
    }

    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
    }

    #[inline(always)]
    fn eq(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(a, b)) as u32 }
    }

    #[inline(always)]
    fn permute(self, a: __m256, lanes: &Words) -> __m256 {
        // SAFETY: as above; 32 bytes are read from 32 bytes.
        unsafe { _mm256_permutevar8x32_ps(a, words(lanes)) }
    }

    #[inline(always)]
    fn select(self, mask: &Words, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_blendv_ps(b, a, _mm256_castsi256_ps(words(mask))) }
    }

    /// Each point is read with the f32 before it, which is why that must be there, then eight by four are
    /// transposed.
    #[inline(always)]
    fn gather(self, points: &[f32], refs: &[u8; LANES], order: &[i32; 4]) -> [__m256; 3] {
        let quad = |i: usize| -> &[f32; 4] {
            let first = 3 * usize::from(refs[i]);
            points[first..first + 4].try_into().expect("four of four")
        };
        // SAFETY: as above; four words are read from four words.
        unsafe {
            let order = _mm256_broadcastsi128_si256(_mm_loadu_si128(order.as_ptr().cast()));
            let row = |i: usize| {
                let low = _mm256_castps128_ps256(_mm_loadu_ps(quad(i).as_ptr()));
                let both = _mm256_insertf128_ps::<1>(low, _mm_loadu_ps(quad(i + 4).as_ptr()));
                _mm256_permutevar_ps(both, order)
            };
            let (r0, r1, r2, r3) = (row(0), row(1), row(2), row(3));
            let (a, b) = (_mm256_unpacklo_ps(r0, r1), _mm256_unpacklo_ps(r2, r3));
            let (c, d) = (_mm256_unpackhi_ps(r0, r1), _mm256_unpackhi_ps(r2, r3));
            [
                _mm256_shuffle_ps::<0b11_10_11_10>(a, b),
                _mm256_shuffle_ps::<0b01_00_01_00>(c, d),
                _mm256_shuffle_ps::<0b11_10_11_10>(c, d),
            ]
        }
    }
}

/// A vector of integers.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn words(x: &Words) -> __m256i {
    // SAFETY: 32 aligned bytes are read from 32 aligned bytes; the caller promises AVX2.
    unsafe { _mm256_load_si256(x.0.as_ptr().cast()) }
}
