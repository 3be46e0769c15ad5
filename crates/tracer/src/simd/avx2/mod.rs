//! Eight f32 as an AVX register.
#![allow(unsafe_code)]

mod strands;

use super::{KEY_LANE, LANES, Simd, Words};
use crate::boxes::Slabs;
use raystrips_pack::vertices::VERTEX_REACH;
use raystrips_pack::{ClusterView, StrandView, VertexCode};
use std::arch::x86_64::*;

/// The processor has AVX2 and FMA.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// Proof that the processor has AVX2 and FMA.
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
            // SAFETY: a value of this type proves that the processor has AVX2 and FMA.
            unsafe { $intrinsic($($arg),*) }
        }
    )*};
}

const IOTA: Words = Words([0, 1, 2, 3, 4, 5, 6, 7]);
/// For each count the lanes below it.
static FIRST: [Words; 16] = {
    let mut table = [Words([0; LANES]); 16];
    let mut count = 0;
    while count < 16 {
        let mut lane = 0;
        while lane < LANES {
            table[count].0[lane] = -((lane < count) as i32);
            lane += 1;
        }
        count += 1;
    }
    table
};
const REVERSED: Words = Words([7, 6, 5, 4, 3, 2, 1, 0]);

impl Simd for Avx2 {
    type F = __m256;
    type I = __m256i;
    type D = __m256d;

    lanewise! {
        add(a, b) = _mm256_add_ps;
        sub(a, b) = _mm256_sub_ps;
        mul(a, b) = _mm256_mul_ps;
        mul_add(a, b, c) = _mm256_fmadd_ps;
        min(a, b) = _mm256_min_ps;
        max(a, b) = _mm256_max_ps;
    }

    #[inline(always)]
    fn splat(self, x: f32) -> __m256 {
        // SAFETY: a value of this type proves that the processor has AVX2 and FMA.
        unsafe { _mm256_set1_ps(x) }
    }

    #[inline(always)]
    fn load(self, x: &[f32; LANES]) -> __m256 {
        // SAFETY: as above; eight f32 are read from eight f32, aligned or not.
        unsafe { _mm256_loadu_ps(x.as_ptr()) }
    }

    #[inline(always)]
    fn load_words(self, x: &[u32; LANES]) -> __m256i {
        // SAFETY: as above; eight words are read from eight words, aligned or not.
        unsafe { _mm256_loadu_si256(x.as_ptr().cast()) }
    }

    #[inline(always)]
    fn store(self, x: __m256) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        // SAFETY: as above; eight f32 are written to eight f32, aligned or not.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), x) };
        out
    }

    #[inline(always)]
    fn count_from(self, first: u32) -> __m256i {
        // SAFETY: as above.
        unsafe { _mm256_add_epi32(_mm256_set1_epi32(first as i32), words(&IOTA)) }
    }

    #[inline(always)]
    fn convert_u8(self, x: u64) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(x as i64))) }
    }

    #[inline(always)]
    fn load_twice(self, x: &[f32; 4]) -> __m256 {
        // SAFETY: as above; four f32 are read from four f32, aligned or not.
        unsafe {
            let x = _mm_loadu_ps(x.as_ptr());
            _mm256_set_m128(x, x)
        }
    }

    #[inline(always)]
    fn convert_u16_twice(self, x: u64) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(_mm_set1_epi64x(x as i64))) }
    }

    #[inline(always)]
    fn powers_of_two_twice(self, x: u32) -> __m256 {
        // SAFETY: as above.
        unsafe {
            let exponent = _mm256_cvtepi8_epi32(_mm_set1_epi32(x as i32));
            let biased = _mm256_add_epi32(exponent, _mm256_set1_epi32(127));
            _mm256_castsi256_ps(_mm256_slli_epi32::<23>(biased))
        }
    }

    #[inline(always)]
    fn spread<const LANE: i32>(self, x: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe {
            match LANE {
                0 => _mm256_permute_ps::<0b00_00_00_00>(x),
                1 => _mm256_permute_ps::<0b01_01_01_01>(x),
                2 => _mm256_permute_ps::<0b10_10_10_10>(x),
                _ => _mm256_permute_ps::<0b11_11_11_11>(x),
            }
        }
    }

    #[inline(always)]
    fn abs(self, a: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
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
        // SAFETY: as above.
        unsafe { _mm256_permutevar8x32_ps(a, words(lanes)) }
    }

    #[inline(always)]
    fn select(self, mask: &Words, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_blendv_ps(b, a, _mm256_castsi256_ps(words(mask))) }
    }

    #[inline(always)]
    fn splat64(self, x: f64) -> __m256d {
        // SAFETY: as above.
        unsafe { _mm256_set1_pd(x) }
    }

    #[inline(always)]
    fn widen(self, x: &[f32; 4]) -> __m256d {
        // SAFETY: as above; four f32 are read from four f32, aligned or not.
        unsafe { _mm256_cvtps_pd(_mm_loadu_ps(x.as_ptr())) }
    }

    #[inline(always)]
    fn store64(self, x: __m256d) -> [f64; 4] {
        let mut out = [0.0; 4];
        // SAFETY: as above; four f64 are written to four f64, aligned or not.
        unsafe { _mm256_storeu_pd(out.as_mut_ptr(), x) };
        out
    }

    #[inline(always)]
    fn sub64(self, a: __m256d, b: __m256d) -> __m256d {
        // SAFETY: as above.
        unsafe { _mm256_sub_pd(a, b) }
    }

    #[inline(always)]
    fn mul64(self, a: __m256d, b: __m256d) -> __m256d {
        // SAFETY: as above.
        unsafe { _mm256_mul_pd(a, b) }
    }

    #[inline(always)]
    fn rotate64<const BY: usize>(self, a: __m256d) -> __m256d {
        // SAFETY: as above.
        unsafe {
            match BY {
                1 => _mm256_permute4x64_pd::<0b11_00_10_01>(a),
                _ => _mm256_permute4x64_pd::<0b11_01_00_10>(a),
            }
        }
    }

    #[inline(always)]
    fn store_sorted(
        self,
        boxes: Slabs<__m256>,
        count: usize,
        links: __m256i,
        (keys_out, links_out): (&mut [u32; LANES], &mut [u32; LANES]),
    ) -> usize {
        // SAFETY: as above; eight words each are written to eight words, aligned or not.
        unsafe {
            let met = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LE_OQ>(boxes.tnear, boxes.tfar));
            let met = _mm256_and_si256(met, words(&FIRST[count % FIRST.len()]));
            // Floats that are not negative are ordered like integers; -1 comes after all of them.
            let distance = _mm256_castps_si256(_mm256_max_ps(boxes.tnear, _mm256_setzero_ps()));
            let lane_bits = _mm256_set1_epi32(KEY_LANE as i32);
            let keys = _mm256_or_si256(_mm256_andnot_si256(lane_bits, distance), words(&IOTA));
            let keys = sort_falling(_mm256_blendv_epi8(_mm256_set1_epi32(-1), keys, met));
            // The lane is in the lowest bits of a key, which are all that a permutation looks at.
            let links = _mm256_permutevar8x32_epi32(links, keys);
            _mm256_storeu_si256(keys_out.as_mut_ptr().cast(), keys);
            _mm256_storeu_si256(links_out.as_mut_ptr().cast(), links);
            _mm256_movemask_ps(_mm256_castsi256_ps(met)).count_ones() as usize
        }
    }

    #[inline(always)]
    fn decode(self, vertices: &[u8], code: &VertexCode, refs: &[u8; LANES]) -> [__m256; 3] {
        assert!(vertices.len() >= VERTEX_REACH, "a checked page holds these bytes");
        let [x_bits, y_bits, _] = code.bits.map(i32::from);
        let stride = usize::from(code.stride % 16);
        // SAFETY: as above. A vertex begins at most 255 * 12 bytes after the first, as the stride of a checked page is
        // at most 12 (at most 15 here: 255 * 15 + 8 would go beyond what was asserted, so it is cut to 12).
        unsafe {
            let stride = stride.min(12);
            let low = load_words(vertices.as_ptr(), stride, refs);
            let y_shift = _mm_cvtsi32_si128(x_bits);
            let (high, z_shift) = if stride <= 8 {
                (low, x_bits + y_bits)
            } else {
                // z ends with the last bit of the last eight bytes, or some bits before.
                let skipped = stride - 8;
                (
                    load_words(vertices.as_ptr().add(skipped), stride, refs),
                    x_bits + y_bits - 8 * skipped as i32,
                )
            };
            let z_shift = _mm_cvtsi32_si128(z_shift);
            let codes = Codes::of(code);
            [
                codes.value::<0>(low, code.anchor[0]),
                codes.value::<1>(shift_right(low, y_shift), code.anchor[1]),
                codes.value::<2>(shift_right(high, z_shift), code.anchor[2]),
            ]
        }
    }

    #[inline(always)]
    fn decode_strand(self, cluster: &ClusterView, strand: StrandView) -> ([__m256; 3], __m256) {
        // SAFETY: as above.
        unsafe { strands::points(cluster, strand) }
    }

    #[inline(always)]
    fn prefetch_vertices(self, vertices: &[u8], code: &VertexCode, refs: &[u8; LANES]) {
        let stride = usize::from(code.stride);
        for &r in refs {
            let at = vertices.as_ptr().wrapping_add(usize::from(r) * stride);
            // SAFETY: as above; a prefetch reads nothing that the program sees, from any address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(at.cast()) }
        }
    }

    #[inline(always)]
    fn prefetch<T>(self, x: &T) {
        // SAFETY: as above; a prefetch reads nothing that the program sees.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(x).cast()) }
    }
}

/// The eight bytes at `refs[i] * stride`, divided so that the low words of both halves, taken by pairs in turn, are in
/// order.
///
/// # Safety
/// The processor has AVX2, and all these bytes are there.
#[inline(always)]
unsafe fn load_words(base: *const u8, stride: usize, refs: &[u8; LANES]) -> [__m256i; 2] {
    macro_rules! pair {
        ($a:literal, $b:literal) => {{
            let a = base.add(usize::from(refs[$a]) * stride).cast::<f64>();
            let b = base.add(usize::from(refs[$b]) * stride).cast::<f64>();
            _mm_castpd_si128(_mm_loadh_pd(_mm_load_sd(a), b))
        }};
    }
    // SAFETY: the caller promises the bytes and AVX2; unaligned loads.
    unsafe { [_mm256_set_m128i(pair!(4, 5), pair!(0, 1)), _mm256_set_m128i(pair!(6, 7), pair!(2, 3))] }
}

/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn shift_right(words: [__m256i; 2], count: __m128i) -> [__m256i; 2] {
    // SAFETY: the caller promises AVX2.
    unsafe { [_mm256_srl_epi64(words[0], count), _mm256_srl_epi64(words[1], count)] }
}

/// How coordinates x, y, z are stored: in lanes 0 to 2, and again in 4 to 6.
struct Codes {
    mask: __m256i,
    scale: __m256,
    is_float: __m256,
}

impl Codes {
    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    unsafe fn of(code: &VertexCode) -> Codes {
        let [x, y, z] = code.bits;
        let bits = i32::from_le_bytes([x, y, z, 0]);
        let [x, y, z] = code.exponent.map(|e| e as u8);
        let exponent = i32::from_le_bytes([x, y, z, 0]);
        // SAFETY: the caller promises AVX2.
        unsafe {
            let bits = _mm256_cvtepu8_epi32(_mm_set1_epi32(bits));
            let exponent = _mm256_cvtepi8_epi32(_mm_set1_epi32(exponent));
            let unused = _mm256_sub_epi32(_mm256_set1_epi32(32), bits);
            let biased = _mm256_add_epi32(exponent, _mm256_set1_epi32(127));
            let float = _mm256_set1_epi32(i32::from(VertexCode::FLOAT_EXPONENT));
            Codes {
                mask: _mm256_srlv_epi32(_mm256_set1_epi32(-1), unused),
                scale: _mm256_castsi256_ps(_mm256_slli_epi32::<23>(biased)),
                is_float: _mm256_castsi256_ps(_mm256_cmpeq_epi32(exponent, float)),
            }
        }
    }

    /// Coordinates of axis `AXIS`, which begin the words.
    ///
    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    unsafe fn value<const AXIS: i32>(&self, words: [__m256i; 2], anchor: i32) -> __m256 {
        // SAFETY: the caller promises AVX2.
        unsafe {
            let (first, second) = (_mm256_castsi256_ps(words[0]), _mm256_castsi256_ps(words[1]));
            let in_order = _mm256_castps_si256(_mm256_shuffle_ps::<0b10_00_10_00>(first, second));
            let mask = _mm256_castps_si256(Avx2(()).spread::<AXIS>(_mm256_castsi256_ps(self.mask)));
            let q = _mm256_and_si256(in_order, mask);
            let units = _mm256_cvtepi32_ps(_mm256_add_epi32(q, _mm256_set1_epi32(anchor)));
            let fixed = _mm256_mul_ps(units, Avx2(()).spread::<AXIS>(self.scale));
            let is_float = Avx2(()).spread::<AXIS>(self.is_float);
            _mm256_blendv_ps(fixed, _mm256_castsi256_ps(q), is_float)
        }
    }
}

/// Sorts eight i32 by a bitonic network, the greatest first.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn sort_falling(x: __m256i) -> __m256i {
    // SAFETY: the caller promises AVX2.
    unsafe {
        // Compares each lane with its partner; the lanes in LESS keep the lesser one.
        macro_rules! layer {
            ($x:expr, $partner:expr, $less:literal) => {{
                let (x, partner) = ($x, $partner);
                _mm256_blend_epi32::<$less>(_mm256_max_epi32(x, partner), _mm256_min_epi32(x, partner))
            }};
        }
        let x = layer!(x, _mm256_shuffle_epi32::<0b10_11_00_01>(x), 0b1010_1010);
        let x = layer!(x, _mm256_shuffle_epi32::<0b00_01_10_11>(x), 0b1100_1100);
        let x = layer!(x, _mm256_shuffle_epi32::<0b10_11_00_01>(x), 0b1010_1010);
        let x = layer!(x, _mm256_permutevar8x32_epi32(x, words(&REVERSED)), 0b1111_0000);
        let x = layer!(x, _mm256_shuffle_epi32::<0b01_00_11_10>(x), 0b1100_1100);
        layer!(x, _mm256_shuffle_epi32::<0b10_11_00_01>(x), 0b1010_1010)
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
