//! A Cornell box with three statues: the stand-in for the box with three St. Matthews of Moon et al. 2010 (128M
//! triangles). Nearly all triangles are those of the statues, of which one is of glass.

use super::assembly::Part;
use super::refine::{BaseMesh, Placement};
use super::relief::Relief;
use super::statue;
use anyhow::{Result, bail};
use glam::DVec3;

/// Fewer triangles are no statues.
const MIN_TRIANGLES: u64 = 20_000;
/// Width, height and depth of the room, in meters.
const ROOM: DVec3 = DVec3::new(7.0, 5.2, 5.5);
/// Edges of the walls, in edges of the statues.
const WALL_COARSENESS: f64 = 16.0;
/// Height and length of waves of the walls.
const PLASTER: [f64; 2] = [0.4, 0.0025];
/// Where the lamps are, and half of the side of one.
const LAMPS: [[f64; 2]; 4] = [[-1.7, -0.8], [1.7, -0.8], [-1.7, 1.6], [1.7, 1.6]];
const LAMP_HALF: f64 = 0.5;
/// Material, place, angle and size of each statue.
const STATUES: [(usize, [f64; 2], f64, f64); 3] =
    [(4, [-1.75, -0.8], 0.45, 1.95), (5, [0.1, 0.6], -0.1, 1.7), (6, [1.85, -0.6], -0.5, 1.95)];

/// Names of the files, in the order of the numbers of materials.
pub const MATERIALS: [&str; 7] = ["white", "red", "green", "lamp", "marble", "glass", "sandstone"];

/// All parts for about so many triangles.
pub fn parts(triangles: u64, seed: u64) -> Result<Vec<Part>> {
    if triangles < MIN_TRIANGLES {
        bail!("a Cornell box with statues has at least {MIN_TRIANGLES} triangles; ask for more");
    }
    let mut parts = walls(seed);
    for (number, (material, [x, z], angle, scale)) in (0..).zip(STATUES) {
        let seed = seed + number;
        parts.push(Part {
            material,
            base: statue::base(seed, triangles / STATUES.len() as u64, scale)?,
            roundness: statue::ROUNDNESS,
            relief: statue::relief(seed, scale),
            coarseness: scale,
            placements: vec![Placement::new(angle, DVec3::new(x, 0.0, z))],
        });
    }
    Ok(parts)
}

/// The walls, open to the camera, and the lamps below the ceiling.
fn walls(seed: u64) -> Vec<Part> {
    let low = ROOM * DVec3::new(-0.5, 0.0, -0.5);
    let [x, y, z] = DVec3::AXES.map(|axis| axis * ROOM);
    let room = [(low, [z, x]), (low + y, [x, z]), (low, [x, y])];
    let corner = |[x, z]: [f64; 2]| DVec3::new(x - LAMP_HALF, ROOM.y - 0.02, z - LAMP_HALF);
    let sides = [DVec3::X, DVec3::Z].map(|axis| axis * (2.0 * LAMP_HALF));
    let part = |material, base| Part {
        material,
        base,
        roundness: 0.0,
        relief: Relief::stone(seed, PLASTER[0], PLASTER[1]),
        coarseness: WALL_COARSENESS,
        placements: vec![Placement::IDENTITY],
    };
    let lamps = part(3, BaseMesh::parallelograms(&LAMPS.map(|place| (corner(place), sides))));
    vec![
        part(0, BaseMesh::parallelograms(&room)),
        part(1, BaseMesh::parallelograms(&[(low, [y, z])])),
        part(2, BaseMesh::parallelograms(&[(low + x, [z, y])])),
        Part { coarseness: f64::INFINITY, relief: Relief::NONE, ..lamps },
    ]
}

/// The scene file beside the models.
pub const SCENE: &str = r#"# A Cornell box with statues. Written by cargo xtask scene.

camera = { position = [0.0, 2.6, 8.9], target = [0.0, 2.57, 0.0], vertical_fov_degrees = 44.5 }
sky = { color = [0.0, 0.0, 0.0] }
material = [
    { name = "white", base_color = [0.72, 0.71, 0.68] },
    { name = "red", base_color = [0.6, 0.06, 0.05] },
    { name = "green", base_color = [0.12, 0.42, 0.1] },
    { name = "lamp", base_color = [0.0, 0.0, 0.0], emission = [15.0, 13.0, 10.0] },
    { name = "marble", base_color = [0.76, 0.74, 0.7], roughness = 0.5 },
    { name = "glass", base_color = [0.9, 0.95, 0.95], roughness = 0.0, transmission = 1.0, ior = 1.5 },
    { name = "sandstone", base_color = [0.66, 0.47, 0.27] },
]
model = [
    { file = "white.ply", material = "white" },
    { file = "red.ply", material = "red" },
    { file = "green.ply", material = "green" },
    { file = "lamp.ply", material = "lamp" },
    { file = "marble.ply", material = "marble" },
    { file = "glass.ply", material = "glass" },
    { file = "sandstone.ply", material = "sandstone" },
]
"#;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::assembly::{edge_for, triangles};

    #[test]
    fn counts_are_met() {
        for wanted in [20_000, 50_000, 1_000_000] {
            let parts = parts(wanted, 2).unwrap();
            let edge = edge_for(&parts, wanted);
            let made = triangles(&parts, edge) as f64;
            assert!((made / wanted as f64 - 1.0).abs() < 0.02, "{made} of {wanted}");
            assert!(triangles(&parts[..4], edge) as f64 <= made * 0.1);
        }
    }

    #[test]
    fn walls_look_into_the_room() {
        let middle = DVec3::Y * (ROOM.y / 2.0);
        for part in walls(1) {
            for triangle in &part.base.triangles {
                let [a, b, c] = triangle.map(|v| part.base.positions[v as usize]);
                assert!((b - a).cross(c - a).dot(middle - a) > 0.0);
            }
        }
    }
}
