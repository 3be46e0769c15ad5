//! Colors of vertices: which properties hold them, and what their numbers mean.

use super::header::{Element, Kind, Scalar};
use glam::Vec3;
use raystrips_geom::Attributes;
use raystrips_geom::texture::light_of_srgb;

/// As different programs name red, green and blue.
const NAMES: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];

/// The properties of `element` that hold colors, and their types.
pub(super) fn colors(element: &Element) -> Option<[(usize, Scalar); 3]> {
    NAMES.iter().find_map(|names| {
        let mut colors = [(0, Scalar::U8); 3];
        for (color, name) in colors.iter_mut().zip(names) {
            let property = element.find(&[name])?;
            let Kind::Scalar(scalar) = element.properties[property].kind else { return None };
            *color = (property, scalar);
        }
        Some(colors)
    })
}

/// The attributes of a vertex with these numbers, of such types.
pub(super) fn attributes(numbers: [f64; 3], scalars: [Scalar; 3]) -> Attributes {
    let light = |i: usize| light_of_srgb(share(numbers[i], scalars[i])) as f32;
    Attributes { color: Vec3::new(light(0), light(1), light(2)).extend(1.0), ..Attributes::default() }
}

/// What a number is of as much as there can be. Integers of 32 bits are bytes that were made longer.
fn share(number: f64, scalar: Scalar) -> f64 {
    match scalar {
        Scalar::F32 | Scalar::F64 => number,
        Scalar::I8 => number.rem_euclid(256.0) / 255.0,
        Scalar::U8 | Scalar::I32 | Scalar::U32 => number / 255.0,
        Scalar::I16 => number / 32767.0,
        Scalar::U16 => number / 65535.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_of_every_type() {
        let whites = [
            (1.0, Scalar::F32),
            (1.0, Scalar::F64),
            (255.0, Scalar::U8),
            (-1.0, Scalar::I8),
            (32767.0, Scalar::I16),
            (65535.0, Scalar::U16),
            (255.0, Scalar::I32),
            (255.0, Scalar::U32),
        ];
        for (number, scalar) in whites {
            let color = attributes([number, 0.0, number], [scalar; 3]).color;
            assert!((color.truncate() - Vec3::new(1.0, 0.0, 1.0)).abs().max_element() < 1e-6, "{number}");
        }
    }
}
