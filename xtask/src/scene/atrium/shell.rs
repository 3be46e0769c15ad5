//! What encloses the hall: floor, walls, the apse at its end, and the beams over the nave.

use super::arcade::ArchedWall;
use super::patches::{Detail, Patches};
use super::plan::{APSE, APSE_SPRINGING, ARCADE, BAY, BAYS, HALF_LENGTH, STOREYS, THICKNESS, TOP, WALL};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Tiles of the floor along a bay.
const TILES: f64 = 3.0;
/// How far the dome over the apse goes up, to the share of a right angle.
const DOME: f64 = 0.75;

/// The tiles of one of two colors, each a little lower at its borders.
pub fn tiles(detail: Detail, color: usize) -> Patches {
    let mut tiles = Patches::default();
    let size = BAY / TILES;
    let counts = [2.0 * WALL / size, 2.0 * HALF_LENGTH / size + 2.0].map(|n| n.ceil() as usize);
    for (i, j) in (0..counts[0]).flat_map(|i| (0..counts[1]).map(move |j| (i, j))) {
        if (i + j) % 2 == color {
            let corner = DVec3::new(i as f64 * size - WALL, 0.0, j as f64 * size - HALF_LENGTH - 2.0 * size);
            if detail.edge < size / 2.0 {
                tile(&mut tiles, corner, size);
            } else {
                tiles.grid([1; 2], |z, x| corner + DVec3::new(x, 0.0, z) * size);
            }
        }
    }
    tiles
}

fn tile(tiles: &mut Patches, corner: DVec3, size: f64) {
    let border = 0.008 / size;
    let place = |t: f64| [0.0, border, 0.5, 1.0 - border, 1.0][(t * 4.0).round() as usize];
    tiles.grid([4, 4], |z, x| {
        let at_border = [x, z].iter().any(|t| *t == 0.0 || *t == 1.0);
        corner + DVec3::new(place(x) * size, if at_border { -0.006 } else { 0.0 }, place(z) * size)
    });
}

/// The outer wall at positive x, and the floor of the gallery before it.
pub fn side_wall(detail: Detail) -> Patches {
    let mut wall = Patches::default();
    let along = DVec3::Z * (2.0 * HALF_LENGTH);
    wall.flat(detail, DVec3::new(WALL, 0.0, -HALF_LENGTH), [along, DVec3::Y * TOP]);
    wall
}

/// The floor of the gallery at positive x.
pub fn gallery(detail: Detail) -> Patches {
    let mut gallery = Patches::default();
    let inner = ARCADE - THICKNESS / 2.0;
    let corner = DVec3::new(inner, STOREYS[1].floor - 0.005, -HALF_LENGTH);
    gallery.flat(detail, corner, [DVec3::Z * (2.0 * HALF_LENGTH), DVec3::X * (WALL - inner)]);
    gallery
}

/// The wall behind the camera.
pub fn front_wall(detail: Detail) -> Patches {
    let mut wall = Patches::default();
    wall.flat(detail, DVec3::new(WALL, 0.0, HALF_LENGTH), [DVec3::NEG_X * (2.0 * WALL), DVec3::Y * TOP]);
    wall
}

/// The arch before the apse.
pub fn apse_arch() -> ArchedWall {
    ArchedWall {
        center: DVec3::new(0.0, APSE_SPRINGING, -HALF_LENGTH - 0.3),
        through: DVec3::NEG_Z,
        radius: APSE,
        half_width: ARCADE,
        height: TOP - APSE_SPRINGING,
        thickness: 0.6,
    }
}

/// The wall at the end, with the opening of the apse.
pub fn end_wall(detail: Detail) -> Patches {
    let mut wall = Patches::default();
    apse_arch().build(detail, &mut wall);
    let z = -HALF_LENGTH;
    for [from, to, high] in [
        [-WALL, -ARCADE, TOP],
        [ARCADE, WALL, TOP],
        [-ARCADE, -APSE, APSE_SPRINGING],
        [APSE, ARCADE, APSE_SPRINGING],
    ] {
        wall.flat(detail, DVec3::new(from, 0.0, z), [DVec3::X * (to - from), DVec3::Y * high]);
    }
    for side in [-1.0, 1.0] {
        let [from, to] = if side < 0.0 { [z, z - 0.6] } else { [z - 0.6, z] };
        wall.flat(
            detail,
            DVec3::new(side * APSE, 0.0, from),
            [DVec3::Z * (to - from), DVec3::Y * APSE_SPRINGING],
        );
    }
    wall
}

/// The apse: half a cylinder and a quarter of a sphere, open at the top.
pub fn apse(detail: Detail) -> Patches {
    let mut apse = Patches::default();
    let center = DVec3::new(0.0, 0.0, -HALF_LENGTH - 0.6);
    let around = detail.steps(PI * APSE, [8, 96]);
    let wall = |angle: f64| {
        let (sin, cos) = libm::sincos(PI * angle);
        DVec3::new(-APSE * cos, 0.0, -APSE * sin)
    };
    let up = detail.steps(APSE_SPRINGING, [1, 48]);
    apse.grid([around, up], |a, y| center + wall(a) + DVec3::Y * (APSE_SPRINGING * y));
    let rings = detail.steps(FRAC_PI_2 * APSE, [4, 48]);
    apse.grid([around, rings], |a, y| {
        let (sin, cos) = libm::sincos(FRAC_PI_2 * DOME * y);
        center + wall(a) * cos + DVec3::Y * (APSE_SPRINGING + APSE * sin)
    });
    apse
}

/// Beams across the nave and along it, with the sky between them.
pub fn beams(detail: Detail) -> Patches {
    let mut beams = Patches::default();
    for i in 0..=BAYS {
        let z = i as f64 * BAY - HALF_LENGTH;
        let low = DVec3::new(-ARCADE - 0.3, TOP - 0.1, z - 0.15);
        beams.block(detail, low, DVec3::new(2.0 * ARCADE + 0.6, 0.42, 0.3));
    }
    for x in [-1.4, 1.4] {
        let low = DVec3::new(x - 0.1, TOP, -HALF_LENGTH);
        beams.block(detail, low, DVec3::new(0.2, 0.26, 2.0 * HALF_LENGTH));
    }
    beams
}

/// A roof over the aisle at positive x.
pub fn roof(detail: Detail) -> Patches {
    let mut roof = Patches::default();
    let corner = DVec3::new(ARCADE - THICKNESS / 2.0, TOP, -HALF_LENGTH);
    roof.flat(detail, corner, [DVec3::X * (WALL - corner.x), DVec3::Z * (2.0 * HALF_LENGTH)]);
    roof
}
