//! Points and radii of strands without loss, as differences along the strand.
//!
//! Where points of a strand follow each other evenly, as those of a curve do that was cut into segments, the next one is
//! foretold by a polynomial through those before it, and what is left takes few bits: the fixed predictors of Shorten
//! (Robinson 1994), over the whole numbers that [`VertexCode`] stands for. Each cluster takes the order that makes it
//! shortest.
//!
//! Two windows of a strand that follow each other make a *pair*, which is stored from its middle to both ends: whichever
//! of the two a ray needs, it needs no point of the other one.

use crate::strand_record::StrandView;
use crate::vertices::VertexCode;
use bytemuck::{Pod, Zeroable};
use raystrips_geom::strand::WINDOW_SEGMENTS;

/// x, y, z and the code of the radius.
pub const FIELDS: usize = 4;
/// Points that are decoded at once.
pub const STRAND_LANES: usize = 8;
/// Bytes behind those of a pair that are always in the page: a kernel loads them along. A node is as long.
pub const PAIR_SLACK: usize = 64;
/// Most bits of a field.
const MAX_BITS: u8 = 32;

/// A point as it is stored: whole numbers modulo 2^32.
pub(crate) type Point = [u32; FIELDS];
/// Bits of each field.
pub(crate) type Widths = [u8; FIELDS];

/// How the pairs of a cluster are stored, beyond its [`VertexCode`]: that is of their middles, its stride is the bytes of
/// a pair, and its number of vertices is that of pairs.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct StrandCode {
    /// Bits of the step from the middle of a pair to the next point.
    pub step: [u8; FIELDS],
    /// Bits of how much more that is than the step to the middle.
    pub bend: [u8; FIELDS],
    /// Bits of what a prediction leaves, of each point further from the middle.
    pub rest: [u8; FIELDS],
    /// What is added to the code of the radius.
    pub radius_anchor: u8,
    /// Bits of the code of the radius in the middle.
    pub radius_bits: u8,
    /// Which differences what is left is of: 1 steps, 2 those of steps, 3 those of these.
    pub order: u8,
    /// Most segments of a window after a middle, and before it.
    pub reach: [u8; 2],
}

/// The points of a window in their order; the last one stands for those that it lacks.
pub struct StrandPoints {
    /// Coordinates by axis.
    pub axes: [[f32; STRAND_LANES]; 3],
    /// Codes of the radii.
    pub radii: [u8; STRAND_LANES],
}

impl StrandCode {
    /// What is wrong with the numbers of a file, of which `code` is a part.
    pub(crate) fn check(&self, code: &VertexCode) -> Result<(), &'static str> {
        let widths = self.step.iter().chain(&self.bend).chain(&self.rest);
        let sound = widths.copied().all(|bits| bits <= MAX_BITS)
            && self.radius_bits <= 8
            && (1..=3).contains(&self.order)
            && (1..=WINDOW_SEGMENTS as u8).contains(&self.reach[0])
            && usize::from(self.reach[1]) <= WINDOW_SEGMENTS
            && usize::from(code.stride) == self.pair_bytes(code);
        if sound { Ok(()) } else { Err("bad code of strands") }
    }

    /// What is wrong with a window.
    pub(crate) fn check_window(&self, code: &VertexCode, strand: StrandView) -> Result<(), &'static str> {
        if strand.segments > usize::from(self.reach[usize::from(strand.is_backward)]) {
            return Err("too many segments");
        }
        if strand.pair > code.last {
            return Err("refers to a pair that does not exist");
        }
        Ok(())
    }

    /// Bits of the middle of a pair.
    #[inline(always)]
    pub(crate) fn middle(&self, code: &VertexCode) -> Widths {
        let [x, y, z] = code.bits;
        [x, y, z, self.radius_bits]
    }

    /// Where the steps, bends and rests of a pair begin, in bits.
    #[inline(always)]
    fn places(&self, code: &VertexCode) -> [u32; 3] {
        let step = bits_of(&self.middle(code));
        let bend = step + bits_of(&self.step);
        [step, bend, bend + bits_of(&self.bend)]
    }

    /// Bytes of a pair.
    pub(crate) fn pair_bytes(&self, code: &VertexCode) -> usize {
        let rests = self.reach.iter().map(|&reach| u32::from(reach).saturating_sub(1)).sum::<u32>();
        let bits = self.places(code)[2] + rests * bits_of(&self.rest);
        bits.div_ceil(8) as usize
    }

    /// The points of a window. `pairs` are the bytes of pairs, and [`PAIR_SLACK`] bytes more.
    #[inline(always)]
    pub fn decode(&self, code: &VertexCode, pairs: &[u8], strand: StrandView) -> StrandPoints {
        let stride = usize::from(code.stride);
        let pair = &pairs[stride * usize::from(strand.pair)..][..stride + PAIR_SLACK];
        let [step, bend, rest] = self.places(code);
        let mut point = read(pair, 0, &self.middle(code));
        let mut step = read_signed(pair, step, &self.step);
        let mut bend = read_signed(pair, bend, &self.bend);
        let mut at = rest;
        if strand.is_backward {
            step = each(|i| bend[i].wrapping_sub(step[i]));
            at += (u32::from(self.reach[0]) - 1) * bits_of(&self.rest);
        }
        let mut points = [point; STRAND_LANES];
        let keeps = |order: u8| if self.order >= order { u32::MAX } else { 0 };
        let (keep_step, keep_bend) = (keeps(2), keeps(3));
        for (k, place) in points.iter_mut().enumerate().skip(1) {
            if k > strand.segments {
                break;
            }
            if k > 1 {
                let rest = read_signed(pair, at, &self.rest);
                at += bits_of(&self.rest);
                bend = each(|i| (bend[i] & keep_bend).wrapping_add(rest[i]));
                step = each(|i| (step[i] & keep_step).wrapping_add(bend[i]));
            }
            point = each(|i| point[i].wrapping_add(step[i]));
            *place = point;
        }
        let in_order = |k: usize| {
            let k = k.min(strand.segments);
            points[if strand.is_backward { strand.segments - k } else { k } % STRAND_LANES]
        };
        let points: [Point; STRAND_LANES] = std::array::from_fn(in_order);
        StrandPoints {
            axes: [0, 1, 2].map(|axis| points.map(|point| code.value(axis, point[axis]))),
            radii: points.map(|point| self.radius_anchor.wrapping_add(point[3] as u8)),
        }
    }
}

#[inline(always)]
fn each(f: impl FnMut(usize) -> u32) -> Point {
    std::array::from_fn(f)
}

#[inline(always)]
fn bits_of(widths: &Widths) -> u32 {
    widths.iter().map(|&bits| u32::from(bits)).sum()
}

/// The fields that begin at bit `at`.
#[inline(always)]
fn read(bytes: &[u8], mut at: u32, widths: &Widths) -> Point {
    let mut fields = [0; FIELDS];
    for (field, &bits) in fields.iter_mut().zip(widths) {
        let word = bytes[(at / 8) as usize..].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        *field = ((word >> (at % 8)) & ((1 << (bits & 63)) - 1)) as u32;
        at += u32::from(bits);
    }
    fields
}

/// The same with fields in two's complement.
#[inline(always)]
fn read_signed(bytes: &[u8], at: u32, widths: &Widths) -> Point {
    let fields = read(bytes, at, widths);
    each(|i| {
        let sign = (1u64 << (widths[i] & 63) >> 1) as u32;
        (fields[i] ^ sign).wrapping_sub(sign)
    })
}
