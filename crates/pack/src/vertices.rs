//! Lossless fixed-point vertices.
//!
//! Within a cluster each coordinate is `float(anchor + q) * 2^exponent`, exactly the `f32` that was given, with `q`
//! of as many bits as the cluster needs on that axis. Every cluster decodes a shared vertex to the same bits, so the
//! mesh stays watertight. An axis on which that would take 32 bits or more (values beside zero have fine units)
//! keeps its `f32`. The coordinates of a vertex follow each other bit by bit, x lowest; a vertex fills whole
//! bytes.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use raystrips_geom::grid::power_of_two;

/// Bits of a coordinate that is stored as `f32`.
const FLOAT_BITS: u8 = 32;
/// Least and greatest exponent of a unit: that itself and 2^31 units are normal numbers.
const EXPONENTS: std::ops::RangeInclusive<i32> = -126..=96;
/// Bytes from the first vertex of a cluster on that are always in its page: whatever a byte says, it names a vertex
/// that can be read, with the bytes after it that a kernel loads along.
pub const VERTEX_REACH: usize = 255 * 12 + 16;

/// How the vertices of a cluster are stored.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct VertexCode {
    /// What is added to each coordinate, in its unit; 0 where it is stored as `f32`.
    pub anchor: [i32; 3],
    /// Bits of each coordinate.
    pub bits: [u8; 3],
    /// Bytes of a vertex.
    pub stride: u8,
    /// log2 of the unit of each coordinate; -128 where it is stored as `f32`.
    pub exponent: [i8; 3],
    /// Number of vertices less one.
    pub last: u8,
}

impl VertexCode {
    /// Exponent of an axis that is stored as `f32`.
    pub const FLOAT_EXPONENT: i8 = i8::MIN;

    /// The shortest code of `vertices`, which are finite, at least one and at most 256.
    pub fn of(vertices: &[Vec3]) -> VertexCode {
        let axes = [0, 1, 2].map(|axis| axis_code(vertices.iter().map(move |v| v[axis])));
        let bits = axes.map(|a| a.0);
        VertexCode {
            anchor: axes.map(|a| a.2),
            bits,
            stride: stride(bits),
            exponent: axes.map(|a| a.1),
            last: (vertices.len() - 1) as u8,
        }
    }

    /// The same code for some of the vertices alone: others are modulo 2^32 what [`VertexCode::numbers`] says.
    pub(crate) fn narrowed(self, vertices: impl Iterator<Item = Vec3> + Clone) -> VertexCode {
        let mut code = self;
        for axis in (0..3).filter(|&axis| !self.is_float(axis)) {
            let numbers = vertices.clone().map(|vertex| i64::from(self.numbers(vertex)[axis]));
            let (least, greatest) = numbers.fold((i64::MAX, 0), |(a, b), q| (a.min(q), b.max(q)));
            let anchor = i64::from(self.anchor[axis]);
            if let Some((bits, anchor)) = bits_from_anchor(anchor + least, anchor + greatest) {
                (code.bits[axis], code.anchor[axis]) = (bits, anchor);
            }
        }
        code
    }

    /// What is wrong with the numbers of a file.
    pub(crate) fn check(&self) -> Result<(), &'static str> {
        self.check_axes()?;
        if self.stride == stride(self.bits) { Ok(()) } else { Err("bad code of vertices") }
    }

    /// What is wrong with them, the bytes of a vertex aside.
    pub(crate) fn check_axes(&self) -> Result<(), &'static str> {
        for axis in 0..3 {
            let (bits, anchor) = (self.bits[axis], i64::from(self.anchor[axis]));
            let sound = if self.is_float(axis) {
                bits == FLOAT_BITS && anchor == 0
            } else {
                bits < FLOAT_BITS
                    && EXPONENTS.contains(&i32::from(self.exponent[axis]))
                    && anchor + ((1 << bits) - 1) <= i64::from(i32::MAX)
            };
            if !sound {
                return Err("bad code of vertices");
            }
        }
        Ok(())
    }

    /// Whether the axis is stored as `f32`.
    #[inline(always)]
    pub fn is_float(&self, axis: usize) -> bool {
        self.exponent[axis] == VertexCode::FLOAT_EXPONENT
    }

    /// The first bit of each coordinate in a vertex.
    #[inline(always)]
    pub fn shifts(&self) -> [u32; 3] {
        let [x, y, _] = self.bits.map(u32::from);
        [0, x, x + y]
    }

    /// The coordinate that `q` stands for.
    #[inline(always)]
    pub fn value(&self, axis: usize, q: u32) -> f32 {
        if self.is_float(axis) {
            f32::from_bits(q)
        } else {
            self.anchor[axis].wrapping_add(q as i32) as f32 * power_of_two(self.exponent[axis])
        }
    }

    /// The whole numbers, modulo 2^32, that stand for a vertex for which this code was made.
    pub(crate) fn numbers(&self, vertex: Vec3) -> [u32; 3] {
        let number = |axis: usize| match self.is_float(axis) {
            true => vertex[axis].to_bits(),
            false => (fixed(vertex[axis], self.exponent[axis]) - i64::from(self.anchor[axis])) as u32,
        };
        [number(0), number(1), number(2)]
    }

    /// Vertex `i` of those stored in `bytes`, which hold [`VERTEX_REACH`] bytes at least.
    #[inline]
    pub fn decode(&self, bytes: &[u8], i: usize) -> Vec3 {
        let first = i * usize::from(self.stride);
        let word = |bit: u32| {
            let at = first + bit as usize / 8;
            let bytes = bytes[at..at + 8].try_into().expect("eight of eight");
            u64::from_le_bytes(bytes) >> (bit % 8)
        };
        let shifts = self.shifts();
        let q = |axis: usize| (word(shifts[axis]) & ((1 << self.bits[axis]) - 1)) as u32;
        Vec3::new(self.value(0, q(0)), self.value(1, q(1)), self.value(2, q(2)))
    }

    /// Bytes of all vertices, padded to a multiple of 4.
    pub fn byte_count(&self) -> usize {
        ((usize::from(self.last) + 1) * usize::from(self.stride)).next_multiple_of(4)
    }

    /// Appends `vertices`, for which this code was made.
    pub fn encode(&self, vertices: &[Vec3], out: &mut Vec<u8>) {
        for vertex in vertices {
            let numbers = self.numbers(*vertex).into_iter().zip(self.shifts());
            let word = numbers.fold(0, |word, (q, shift)| word | u128::from(q) << shift);
            out.extend_from_slice(&word.to_le_bytes()[..usize::from(self.stride)]);
        }
    }
}

fn stride(bits: [u8; 3]) -> u8 {
    bits.iter().sum::<u8>().div_ceil(8)
}

/// Bits, exponent and anchor of the coordinates of one axis.
fn axis_code(values: impl Iterator<Item = f32> + Clone) -> (u8, i8, i32) {
    let float = (FLOAT_BITS, VertexCode::FLOAT_EXPONENT, 0);
    // A zero is a multiple of any unit.
    let unit =
        values.clone().filter(|&x| x != 0.0).map(unit_exponent).min().unwrap_or(0).min(*EXPONENTS.end());
    let is_minus_zero = |x: f32| x == 0.0 && x.is_sign_negative();
    if !EXPONENTS.contains(&unit) || values.clone().any(is_minus_zero) {
        return float;
    }
    let exponent = unit as i8;
    let (mut least, mut greatest) = (i64::MAX, i64::MIN);
    for x in values {
        if x.abs() > power_of_two(exponent) * i32::MAX as f32 {
            return float;
        }
        let q = fixed(x, exponent);
        (least, greatest) = (least.min(q), greatest.max(q));
    }
    bits_from_anchor(least, greatest).map_or(float, |(bits, anchor)| (bits, exponent, anchor))
}

/// Bits and anchor of whole numbers from `least` to `greatest`, if these are fewer bits than a float has.
fn bits_from_anchor(least: i64, greatest: i64) -> Option<(u8, i32)> {
    let bits_from = |anchor: i64| (64 - (greatest - anchor).leading_zeros()) as u8;
    let bits = bits_from(least);
    // The anchor may be lowered so that all that these bits can say is in range.
    let anchor = least.min(i64::from(i32::MAX) - ((1 << bits) - 1));
    let anchor = i32::try_from(anchor).ok().filter(|&anchor| bits_from(anchor.into()) == bits)?;
    (bits < FLOAT_BITS).then_some((bits, anchor))
}

/// The greatest exponent for which the finite `x`, not zero, is a whole number of units 2^exponent.
fn unit_exponent(x: f32) -> i32 {
    let bits = x.to_bits();
    let (biased, fraction) = ((bits >> 23 & 0xFF) as i32, bits & 0x7F_FFFF);
    let (mantissa, exponent) =
        if biased == 0 { (fraction, -149) } else { (fraction | 0x80_0000, biased - 150) };
    exponent + mantissa.trailing_zeros() as i32
}

/// `x` in units, of which it is a whole number below 2^31; anything else gives some number.
fn fixed(x: f32, exponent: i8) -> i64 {
    let units = f64::from_bits((1023 - i64::from(exponent)) as u64 * (1 << 52));
    (f64::from(x) * units) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Encodes, decodes, and gives the bytes of a vertex.
    fn round_trip(vertices: &[Vec3]) -> usize {
        let code = VertexCode::of(vertices);
        code.check().expect("a code that was made is sound");
        let mut bytes = Vec::new();
        code.encode(vertices, &mut bytes);
        assert_eq!(bytes.len(), vertices.len() * usize::from(code.stride));
        bytes.extend([0xFF; VERTEX_REACH]);
        for (i, vertex) in vertices.iter().enumerate() {
            let bits = |v: Vec3| v.to_array().map(f32::to_bits);
            assert_eq!(bits(code.decode(&bytes, i)), bits(*vertex), "{code:?}");
        }
        usize::from(code.stride)
    }

    proptest! {
        #[test]
        fn any_bits_come_through(bits in prop::collection::vec(prop::array::uniform3(any::<u32>()), 1..20)) {
            let finite = |b: u32| Some(f32::from_bits(b)).filter(|x| x.is_finite()).unwrap_or(-0.0);
            let vertices: Vec<Vec3> = bits.iter().map(|b| Vec3::from_array(b.map(finite))).collect();
            round_trip(&vertices);
        }

        #[test]
        fn near_vertices_come_through(center in prop::array::uniform3(-1e3f32..1e3),
            offsets in prop::collection::vec(prop::array::uniform3(-1f32..1.0), 1..20), scale in -40..10i32) {
            let scale = (scale as f32).exp2();
            let at = |o: &[f32; 3]| Vec3::from_array(center) + Vec3::from_array(*o) * scale;
            let vertices: Vec<Vec3> = offsets.iter().map(at).collect();
            round_trip(&vertices);
        }
    }

    #[test]
    fn odd_values_come_through() {
        let least = f32::from_bits(1);
        for x in [0.0, -0.0, least, f32::MIN_POSITIVE, f32::MAX, 1e30, 2e9, -2147483648.0, 2147483520.0] {
            round_trip(&[Vec3::new(x, 1.0, -x)]);
            round_trip(&[Vec3::new(x, 1.0, -x), Vec3::new(0.0, 1.0, 3.0)]);
        }
    }

    #[test]
    fn what_is_near_is_short() {
        let row: Vec<Vec3> = (0..256).map(|i| Vec3::new(1000.0 + i as f32 * 0.25, 7.5, 0.0)).collect();
        assert_eq!(round_trip(&row), 1);
    }
}
