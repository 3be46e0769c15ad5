//! What vertices have besides their positions: normals, texture coordinates, colors, tangents.
//!
//! Stored as one record a vertex, of the streams that there are: 4 bytes of normal, 8 of each texture coordinate, 8 of color,
//! 4 of tangent.

use glam::{Vec2, Vec3, Vec4};

/// Which attributes there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Streams(u8);

impl Streams {
    /// None.
    pub const NONE: Streams = Streams(0);
    /// Normals: two 16-bit coordinates on an octahedron.
    pub const NORMALS: Streams = Streams(1);
    /// Texture coordinates 0: two `f32`.
    pub const TEX_COORDS_0: Streams = Streams(2);
    /// Texture coordinates 1: two `f32`.
    pub const TEX_COORDS_1: Streams = Streams(4);
    /// Colors: red, green, blue, opacity of 16 bits each.
    pub const COLORS: Streams = Streams(8);
    /// Tangents: two 16-bit coordinates on an octahedron.
    pub const TANGENTS: Streams = Streams(16);
    /// All of them.
    pub const ALL: Streams = Streams(31);

    /// Those with these bits; `None` if one of them means nothing.
    pub fn from_bits(bits: u8) -> Option<Streams> {
        (bits & !Streams::ALL.0 == 0).then_some(Streams(bits))
    }

    /// The bits that stand for them.
    pub fn bits(self) -> u8 {
        self.0
    }

    /// These and those.
    #[must_use]
    pub fn union(self, other: Streams) -> Streams {
        Streams(self.0 | other.0)
    }

    /// Those that are in both.
    #[must_use]
    pub fn intersection(self, other: Streams) -> Streams {
        Streams(self.0 & other.0)
    }

    /// True if all of `other` are there.
    pub fn has(self, other: Streams) -> bool {
        self.0 & other.0 == other.0
    }

    /// True if there are none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Bytes of a record.
    pub fn record_bytes(self) -> usize {
        let streams = [
            (Streams::NORMALS, 4),
            (Streams::TEX_COORDS_0, 8),
            (Streams::TEX_COORDS_1, 8),
            (Streams::COLORS, 8),
            (Streams::TANGENTS, 4),
        ];
        streams.iter().map(|&(stream, bytes)| if self.has(stream) { bytes } else { 0 }).sum()
    }
}

/// The attributes of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attributes {
    /// Unit vector; zero where it is not known.
    pub normal: Vec3,
    /// Two sets of texture coordinates.
    pub tex_coords: [Vec2; 2],
    /// Color, linear, and opacity: each 0 to 1.
    pub color: Vec4,
    /// Unit vector along which the normal texture goes to its right; zero where it is not known.
    pub tangent: Vec3,
}

impl Default for Attributes {
    fn default() -> Attributes {
        Attributes { normal: Vec3::ZERO, tex_coords: [Vec2::ZERO; 2], color: Vec4::ONE, tangent: Vec3::ZERO }
    }
}

impl Attributes {
    /// Appends the record with these streams.
    pub fn encode(&self, streams: Streams, out: &mut Vec<u8>) {
        let put = |direction, out: &mut Vec<u8>| {
            octahedral(direction).iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
        };
        if streams.has(Streams::NORMALS) {
            put(self.normal, out);
        }
        for (stream, uv) in [Streams::TEX_COORDS_0, Streams::TEX_COORDS_1].into_iter().zip(self.tex_coords) {
            if streams.has(stream) {
                uv.to_array().iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
            }
        }
        if streams.has(Streams::COLORS) {
            // NaN becomes 0.
            let code = |x: f32| (x.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
            self.color.to_array().iter().for_each(|&x| out.extend_from_slice(&code(x).to_le_bytes()));
        }
        if streams.has(Streams::TANGENTS) {
            put(self.tangent, out);
        }
    }

    /// The attributes of a record, with what it lacks as by default.
    ///
    /// # Panics
    /// If the record is too short.
    pub fn decode(mut record: &[u8], streams: Streams) -> Attributes {
        let mut attributes = Attributes::default();
        let direction = |record: &mut _| from_octahedral([0, 1].map(|_| i16::from_le_bytes(take(record))));
        if streams.has(Streams::NORMALS) {
            attributes.normal = direction(&mut record);
        }
        for (stream, uv) in
            [Streams::TEX_COORDS_0, Streams::TEX_COORDS_1].into_iter().zip(&mut attributes.tex_coords)
        {
            if streams.has(stream) {
                *uv = Vec2::from_array([0, 1].map(|_| f32::from_le_bytes(take(&mut record))));
            }
        }
        if streams.has(Streams::COLORS) {
            let color = [0; 4].map(|_: i32| f32::from(u16::from_le_bytes(take(&mut record))) / 65535.0);
            attributes.color = Vec4::from_array(color);
        }
        if streams.has(Streams::TANGENTS) {
            attributes.tangent = direction(&mut record);
        }
        attributes
    }
}

fn take<const N: usize>(record: &mut &[u8]) -> [u8; N] {
    let (bytes, rest) = record.split_first_chunk::<N>().expect("records are as long as their streams say");
    *record = rest;
    *bytes
}

/// Where a coordinate would have no sign: no direction.
const NO_DIRECTION: i16 = i16::MIN;

/// A direction as a point of the octahedron |x| + |y| + |z| = 1, unfolded to a square (Cigolle, Donow, Evangelakos, Mara,
/// McGuire, Meyer 2014, "A Survey of Efficient Representations for Independent Unit Vectors").
fn octahedral(direction: Vec3) -> [i16; 2] {
    let sum = direction.abs().element_sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return [NO_DIRECTION; 2];
    }
    let Vec3 { x, y, z } = direction / sum;
    let sign = |x: f32| if x < 0.0 { -1.0 } else { 1.0 };
    let folded = if z < 0.0 { [(1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)] } else { [x, y] };
    folded.map(|x| (x * 32767.0).round() as i16)
}

fn from_octahedral(code: [i16; 2]) -> Vec3 {
    if code.contains(&NO_DIRECTION) {
        return Vec3::ZERO;
    }
    let [x, y] = code.map(|x| f32::from(x) / 32767.0);
    let z = 1.0 - x.abs() - y.abs();
    let below = (-z).max(0.0);
    let toward_zero = |x: f32| if x < 0.0 { x + below } else { x - below };
    Vec3::new(toward_zero(x), toward_zero(y), z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn records_come_back(
            normal in prop::array::uniform3(-1f32..1.0),
            uv in prop::array::uniform4(-1e3f32..1e3),
            color in prop::array::uniform4(0f32..=1.0),
            tangent in prop::array::uniform3(-1f32..1.0),
            bits in 0u8..32,
        ) {
            let unit = |v| Vec3::from_array(v).try_normalize();
            let (Some(normal), Some(tangent)) = (unit(normal), unit(tangent)) else { return Ok(()) };
            let [a, b, c, d] = uv;
            let attributes = Attributes {
                normal,
                tex_coords: [Vec2::new(a, b), Vec2::new(c, d)],
                color: Vec4::from_array(color),
                tangent,
            };
            let streams = Streams::from_bits(bits).unwrap();
            let mut record = Vec::new();
            attributes.encode(streams, &mut record);
            prop_assert_eq!(record.len(), streams.record_bytes());
            let back = Attributes::decode(&record, streams);
            let plain = Attributes::default();
            let expected = |stream, own, plain| if streams.has(stream) { own } else { plain };
            prop_assert!((back.normal - expected(Streams::NORMALS, normal, plain.normal)).length() < 1e-4);
            prop_assert!((back.tangent - expected(Streams::TANGENTS, tangent, plain.tangent)).length() < 1e-4);
            prop_assert_eq!(back.tex_coords[0], expected(Streams::TEX_COORDS_0, attributes.tex_coords[0].extend(0.0), Vec3::ZERO).truncate());
            prop_assert_eq!(back.tex_coords[1], expected(Streams::TEX_COORDS_1, attributes.tex_coords[1].extend(0.0), Vec3::ZERO).truncate());
            let color = if streams.has(Streams::COLORS) { attributes.color } else { plain.color };
            prop_assert!((back.color - color).abs().max_element() < 1e-5);
        }
    }

    #[test]
    fn what_is_no_direction_has_no_normal() {
        for normal in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            let mut record = Vec::new();
            Attributes { normal, ..Attributes::default() }.encode(Streams::NORMALS, &mut record);
            assert_eq!(Attributes::decode(&record, Streams::NORMALS).normal, Vec3::ZERO);
        }
        for axis in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            assert_eq!(from_octahedral(octahedral(axis)), axis);
        }
        assert_eq!(Streams::from_bits(32), None);
    }
}
