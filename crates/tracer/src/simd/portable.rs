//! Eight f32 as an array: for every processor, and what the other implementations are compared with.

use super::{KEY_LANE, LANES, Simd, Words};
use crate::boxes::Slabs;
use raystrips_geom::grid::power_of_two;
use raystrips_pack::{ClusterView, StrandView, VertexCode};
use std::array::from_fn;

/// Instructions that every processor has.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

impl Simd for Portable {
    type F = [f32; LANES];
    type I = [u32; LANES];
    type D = [f64; 4];

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [x; LANES]
    }

    #[inline(always)]
    fn load(self, x: &[f32; LANES]) -> Self::F {
        *x
    }

    #[inline(always)]
    fn load_words(self, x: &[u32; LANES]) -> Self::I {
        *x
    }

    #[inline(always)]
    fn store(self, x: Self::F) -> [f32; LANES] {
        x
    }

    #[inline(always)]
    fn count_from(self, first: u32) -> Self::I {
        from_fn(|i| first + i as u32)
    }

    #[inline(always)]
    fn convert_u8(self, x: u64) -> Self::F {
        x.to_le_bytes().map(f32::from)
    }

    #[inline(always)]
    fn load_twice(self, x: &[f32; 4]) -> Self::F {
        from_fn(|i| x[i % 4])
    }

    #[inline(always)]
    fn convert_u16_twice(self, x: u64) -> Self::F {
        from_fn(|i| f32::from((x >> (16 * (i % 4))) as u16))
    }

    #[inline(always)]
    fn powers_of_two_twice(self, x: u32) -> Self::F {
        let exponents = x.to_le_bytes().map(|e| e as i8);
        // The fourth byte means something else.
        from_fn(|i| if i % 4 < 3 { power_of_two(exponents[i % 4]) } else { 0.0 })
    }

    #[inline(always)]
    fn spread<const LANE: i32>(self, x: Self::F) -> Self::F {
        from_fn(|i| x[i / 4 * 4 + LANE as usize])
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
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        from_fn(|i| a[i] * b[i] + c[i])
    }

    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        a.map(f32::abs)
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
    fn splat64(self, x: f64) -> Self::D {
        [x; 4]
    }

    #[inline(always)]
    fn widen(self, x: &[f32; 4]) -> Self::D {
        x.map(f64::from)
    }

    #[inline(always)]
    fn store64(self, x: Self::D) -> [f64; 4] {
        x
    }

    #[inline(always)]
    fn sub64(self, a: Self::D, b: Self::D) -> Self::D {
        from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul64(self, a: Self::D, b: Self::D) -> Self::D {
        from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn rotate64<const BY: usize>(self, a: Self::D) -> Self::D {
        from_fn(|i| a[(i + BY) % 3])
    }

    #[inline(always)]
    fn store_sorted(
        self,
        boxes: Slabs<Self::F>,
        count: usize,
        links: Self::I,
        (keys_out, links_out): (&mut [u32; LANES], &mut [u32; LANES]),
    ) -> usize {
        let mut len = 0;
        for (lane, &link) in links.iter().enumerate().take(count) {
            if boxes.tnear[lane] <= boxes.tfar[lane] {
                let key = max(boxes.tnear[lane], 0.0).to_bits() & !KEY_LANE | lane as u32;
                let mut place = len;
                while place > 0 && keys_out[place - 1] < key {
                    keys_out[place] = keys_out[place - 1];
                    links_out[place] = links_out[place - 1];
                    place -= 1;
                }
                (keys_out[place], links_out[place]) = (key, link);
                len += 1;
            }
        }
        len
    }

    #[inline(always)]
    fn decode(self, vertices: &[u8], code: &VertexCode, refs: &[u8; LANES]) -> [Self::F; 3] {
        let corners = refs.map(|r| code.decode(vertices, usize::from(r)));
        [corners.map(|p| p.x), corners.map(|p| p.y), corners.map(|p| p.z)]
    }

    #[inline(always)]
    fn decode_strand(self, cluster: &ClusterView, strand: StrandView) -> ([Self::F; 3], Self::F) {
        let (points, radii) = (cluster.strand_points(strand), cluster.radius_code());
        (points.axes, points.radii.map(|code| radii.decode(code)))
    }

    #[inline(always)]
    fn prefetch_vertices(self, _: &[u8], _: &VertexCode, _: &[u8; LANES]) {}

    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
}

/// a if a > b, else b: one instruction, unlike [`f32::max`].
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// a if a < b, else b.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
