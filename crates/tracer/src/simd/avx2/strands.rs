//! Windows of strands to vectors: what [`StrandCode::decode`] does, x, y, z and radius of a point at once.

use super::words;
use crate::simd::{LANES, Words};
use raystrips_geom::grid::power_of_two;
use raystrips_pack::strand_code::{FIELDS, PAIR_SLACK};
use raystrips_pack::{ClusterView, StrandCode, StrandView, VertexCode};
use std::arch::x86_64::*;

/// Most bits of fields of which eight bytes hold two wherever they begin. Floats have more.
const NARROW: u32 = 28;

/// Lanes in the order of the strand, for windows that begin at the middle of their pair and for those that end there, by
/// segments; the last one stands for those that are lacking.
static ORDER: [[Words; LANES + 1]; 2] = {
    let mut table = [[Words([0; LANES]); LANES + 1]; 2];
    let mut i = 0;
    while i < 2 * (LANES + 1) * LANES {
        let (backward, segments, lane) = (i / LANES % 2, i / LANES / 2, i % LANES);
        let place = if lane < segments { lane } else { segments };
        table[backward][segments].0[lane] = if backward == 1 { segments - place } else { place } as i32;
        i += 1;
    }
    table
};

/// Coordinates and radii of the points of a window.
///
/// # Panics
/// If the page was not checked, it may.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
pub(super) unsafe fn points(cluster: &ClusterView, strand: StrandView) -> ([__m256; 3], __m256) {
    // SAFETY: the caller promises AVX2.
    unsafe {
        match is_wide(cluster.vertex_code(), cluster.strand_code()) {
            true => wide_points(cluster, strand),
            false => points_of::<false>(cluster, strand),
        }
    }
}

/// Whether a coordinate is stored as a float, or eight bytes may not hold two fields.
#[inline(always)]
fn is_wide(code: &VertexCode, strand_code: &StrandCode) -> bool {
    let [x, y, z] = code.bits;
    let middle = [x, y, z, strand_code.radius_bits];
    let wide = [middle, strand_code.step, strand_code.bend, strand_code.rest].map(|widths| {
        // Of a byte that is greater the highest bit gets set: none is of more than 32 bits.
        u32::from_le_bytes(widths).wrapping_add(0x0101_0101 * (0x7F - NARROW)) & 0x8080_8080
    });
    wide[0] | wide[1] | wide[2] | wide[3] != 0
}

/// The same as [`points`] for wide fields and coordinates that are floats.
///
/// # Safety
/// The processor has AVX2.
#[cold]
#[target_feature(enable = "avx2")]
unsafe fn wide_points(cluster: &ClusterView, strand: StrandView) -> ([__m256; 3], __m256) {
    // SAFETY: the caller promises AVX2.
    unsafe { points_of::<true>(cluster, strand) }
}

/// [`points`], of `WIDE` fields or not.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn points_of<const WIDE: bool>(cluster: &ClusterView, strand: StrandView) -> ([__m256; 3], __m256) {
    let (code, strand_code, radii) = (cluster.vertex_code(), cluster.strand_code(), cluster.radius_code());
    let stride = usize::from(code.stride);
    let pair = &cluster.pair_bytes()[stride * usize::from(strand.pair)..][..stride + PAIR_SLACK];
    let [x, y, z] = code.bits;
    // SAFETY: the caller promises AVX2. Records are loaded where `Records::load` has asserted that they are.
    unsafe {
        let middles = Records::of([x, y, z, strand_code.radius_bits]);
        let steps = Records::of(strand_code.step);
        let bends = Records::of(strand_code.bend);
        let rests = Records::of(strand_code.rest);
        let step_at = middles.bits;
        let bend_at = step_at + steps.bits;
        let mut rest_at = bend_at + bends.bits;
        let mut point = middles.unsigned(middles.load::<WIDE>(pair, 0));
        let mut step = steps.signed(steps.load::<WIDE>(pair, step_at));
        let mut bend = bends.signed(bends.load::<WIDE>(pair, bend_at));
        if strand.is_backward {
            step = _mm256_sub_epi64(bend, step);
            rest_at += (usize::from(strand_code.reach[0]) - 1) * rests.bits;
        }
        let keep_step = _mm256_set1_epi64x(-i64::from(strand_code.order >= 2));
        let keep_bend = _mm256_set1_epi64x(-i64::from(strand_code.order >= 3));
        let mut points = [point; LANES];
        point = _mm256_add_epi64(point, step);
        points[1] = point;
        macro_rules! next {
            ($k:literal) => {
                let rest = rests.signed(rests.load::<WIDE>(pair, rest_at + ($k - 2) * rests.bits));
                bend = _mm256_add_epi64(_mm256_and_si256(bend, keep_bend), rest);
                step = _mm256_add_epi64(_mm256_and_si256(step, keep_step), bend);
                point = _mm256_add_epi64(point, step);
                points[$k] = point;
            };
        }
        // Most windows have four segments; what is computed beyond the last one is not looked at.
        next!(2);
        next!(3);
        next!(4);
        if strand.segments > 4 {
            next!(5);
            next!(6);
        }
        let order = words(&ORDER[usize::from(strand.is_backward)][strand.segments.min(LANES)]);
        let fields = transposed(&points);
        macro_rules! coordinate {
            ($axis:literal) => {{
                let q = _mm256_permutevar8x32_epi32(fields[$axis], order);
                let units = _mm256_cvtepi32_ps(_mm256_add_epi32(q, _mm256_set1_epi32(code.anchor[$axis])));
                let fixed = _mm256_mul_ps(units, _mm256_set1_ps(power_of_two(code.exponent[$axis])));
                if WIDE && code.is_float($axis) { _mm256_castsi256_ps(q) } else { fixed }
            }};
        }
        let radius = _mm256_permutevar8x32_epi32(fields[3], order);
        let radius = _mm256_add_epi32(radius, _mm256_set1_epi32(strand_code.radius_anchor.into()));
        let radius = _mm256_and_si256(radius, _mm256_set1_epi32(u8::MAX.into()));
        let above = _mm256_sll_epi32(radius, _mm_cvtsi32_si128((radii.shift & 31) as i32));
        let radius = _mm256_add_epi32(above, _mm256_set1_epi32(radii.base as i32));
        ([coordinate!(0), coordinate!(1), coordinate!(2)], _mm256_castsi256_ps(radius))
    }
}

/// How fields of one kind are stored: x, y, z, radius, one after the other.
struct Records {
    /// Where each field begins.
    places: __m256i,
    /// Where each one ends, a byte each.
    ends: [u8; FIELDS],
    /// Bits of all.
    bits: usize,
    /// 2 to the power of the bits of each.
    beyond: __m256i,
}

impl Records {
    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    unsafe fn of(widths: [u8; FIELDS]) -> Records {
        let widths = u32::from_le_bytes(widths);
        // Byte i: bits of fields 0 to i.
        let ends = widths.wrapping_mul(0x0101_0101);
        // SAFETY: the caller promises AVX2.
        unsafe {
            Records {
                places: _mm256_cvtepu8_epi64(_mm_cvtsi32_si128((ends << 8) as i32)),
                ends: ends.to_le_bytes(),
                bits: (ends >> 24) as usize,
                beyond: _mm256_sllv_epi64(
                    _mm256_set1_epi64x(1),
                    _mm256_cvtepu8_epi64(_mm_cvtsi32_si128(widths as i32)),
                ),
            }
        }
    }

    /// Words whose lowest bits are the fields of the record that begins at bit `at`; they are [`NARROW`], or `WIDE`.
    ///
    /// # Panics
    /// If the record ends too near to the end of `bytes`.
    ///
    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    unsafe fn load<const WIDE: bool>(&self, bytes: &[u8], at: usize) -> __m256i {
        let byte_after = |field: usize| (at + usize::from(self.ends[field])) / 8;
        if WIDE {
            let word = |byte: usize| {
                let word = bytes[byte..].first_chunk().expect("a checked page holds these bytes");
                i64::from_le_bytes(*word)
            };
            let [a, b, c, d] = [word(at / 8), word(byte_after(0)), word(byte_after(1)), word(byte_after(2))];
            // SAFETY: the caller promises AVX2.
            unsafe {
                let places = _mm256_add_epi64(_mm256_set1_epi64x(at as i64), self.places);
                let shifts = _mm256_and_si256(places, _mm256_set1_epi64x(7));
                return _mm256_srlv_epi64(_mm256_set_epi64x(d, c, b, a), shifts);
            }
        }
        let (first, second) = (at / 8, byte_after(1));
        assert!(second + 8 <= bytes.len(), "a checked page holds these bytes");
        // SAFETY: eight bytes each are loaded from where there are as many, `first` being no greater than `second`. The
        // caller promises AVX2.
        unsafe {
            let first = _mm_loaddup_pd(bytes.as_ptr().add(first).cast());
            let second = _mm_loaddup_pd(bytes.as_ptr().add(second).cast());
            let words = _mm256_castpd_si256(_mm256_set_m128d(second, first));
            let places = _mm256_add_epi64(_mm256_set1_epi64x(at as i64), self.places);
            // Fields 0 and 1 are in a word that begins where 0 does, or up to seven bits before; 2 and 3 likewise.
            let first_of_two = _mm256_shuffle_epi32::<0b01_00_01_00>(places);
            let begins = _mm256_and_si256(first_of_two, _mm256_set1_epi64x(!7));
            _mm256_srlv_epi64(words, _mm256_sub_epi64(places, begins))
        }
    }

    /// The fields in what was loaded.
    ///
    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    unsafe fn unsigned(&self, loaded: __m256i) -> __m256i {
        // SAFETY: the caller promises AVX2.
        unsafe { _mm256_and_si256(loaded, _mm256_sub_epi64(self.beyond, _mm256_set1_epi64x(1))) }
    }

    /// The fields in what was loaded, which are in two's complement.
    ///
    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    unsafe fn signed(&self, loaded: __m256i) -> __m256i {
        // SAFETY: the caller promises AVX2.
        unsafe {
            let sign = _mm256_srli_epi64::<1>(self.beyond);
            _mm256_sub_epi64(_mm256_xor_si256(self.unsigned(loaded), sign), sign)
        }
    }
}

/// The low words of eight points by field.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn transposed(points: &[__m256i; LANES]) -> [__m256i; FIELDS] {
    // SAFETY: the caller promises AVX2.
    unsafe {
        macro_rules! pick {
            ($which:literal, $a:expr, $b:expr) => {
                _mm256_castps_si256(_mm256_shuffle_ps::<$which>(
                    _mm256_castsi256_ps($a),
                    _mm256_castsi256_ps($b),
                ))
            };
        }
        // x and y of two points in the lower half, z and radius in the upper one.
        let a = pick!(0b10_00_10_00, points[0], points[1]);
        let b = pick!(0b10_00_10_00, points[2], points[3]);
        let c = pick!(0b10_00_10_00, points[4], points[5]);
        let d = pick!(0b10_00_10_00, points[6], points[7]);
        // x or y of four points in the lower half, z or radius in the upper one.
        let (xz, yr) = (pick!(0b10_00_10_00, a, b), pick!(0b11_01_11_01, a, b));
        let (xz_after, yr_after) = (pick!(0b10_00_10_00, c, d), pick!(0b11_01_11_01, c, d));
        [
            _mm256_permute2x128_si256::<0x20>(xz, xz_after),
            _mm256_permute2x128_si256::<0x20>(yr, yr_after),
            _mm256_permute2x128_si256::<0x31>(xz, xz_after),
            _mm256_permute2x128_si256::<0x31>(yr, yr_after),
        ]
    }
}
