//! What the hall is made of.

use crate::scene::relief::{Joints, Relief};

/// A color (linear RGB) and perhaps light.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    pub name: &'static str,
    pub color: [f32; 3],
    pub emission: Option<[f32; 3]>,
}

const fn matte(name: &'static str, color: [f32; 3]) -> Material {
    Material { name, color, emission: None }
}

/// All of them.
pub const MATERIALS: [Material; 10] = [
    matte("wall", [0.62, 0.47, 0.31]),
    matte("limestone", [0.66, 0.59, 0.47]),
    matte("column", [0.68, 0.63, 0.55]),
    matte("vault", [0.68, 0.64, 0.58]),
    matte("tile_light", [0.62, 0.57, 0.5]),
    matte("tile_dark", [0.21, 0.095, 0.065]),
    matte("beam", [0.22, 0.12, 0.06]),
    matte("pedestal", [0.2, 0.23, 0.2]),
    matte("statue", [0.76, 0.73, 0.68]),
    Material { name: "lamp", color: [0.0; 3], emission: Some([14.0, 9.0, 4.6]) },
];

pub const WALL: usize = 0;
pub const LIMESTONE: usize = 1;
pub const COLUMN: usize = 2;
pub const VAULTS: usize = 3;
pub const TILES_LIGHT: usize = 4;
pub const TILES_DARK: usize = 5;
pub const BEAM: usize = 6;
pub const PEDESTAL: usize = 7;
pub const STATUE: usize = 8;
pub const LAMP: usize = 9;

/// The surface of all but statues, which have their own.
pub fn relief(material: usize, seed: u64) -> Relief {
    let seed = seed ^ (material as u64) << 32;
    match material {
        WALL => Relief::stone(seed, 0.45, 0.008).with_joints(Joints { block: [1.2, 0.55], width: 0.016 }),
        LIMESTONE => Relief::stone(seed, 0.35, 0.006),
        COLUMN => Relief::stone(seed, 0.2, 0.003),
        VAULTS => Relief::stone(seed, 0.6, 0.012),
        BEAM => Relief::chiseled(seed, 0.4, 0.012),
        LAMP => Relief::NONE,
        _ => Relief::stone(seed, 0.25, 0.0015),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_names() {
        let named = [
            (WALL, "wall"),
            (VAULTS, "vault"),
            (TILES_DARK, "tile_dark"),
            (STATUE, "statue"),
            (LAMP, "lamp"),
        ];
        assert!(named.iter().all(|&(number, name)| MATERIALS[number].name == name));
    }
}
