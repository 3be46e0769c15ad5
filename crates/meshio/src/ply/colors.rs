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
    let light = |i: usize| light_of_srgb(numbers[i] / white(scalars[i])) as f32;
    Attributes { color: Vec3::new(light(0), light(1), light(2)).extend(1.0), ..Attributes::default() }
}

/// What stands for as much as there can be.
fn white(scalar: Scalar) -> f64 {
    match scalar {
        Scalar::F32 | Scalar::F64 => 1.0,
        Scalar::I8 | Scalar::U8 => 255.0,
        _ => 65535.0,
    }
}
