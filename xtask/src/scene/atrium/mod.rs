//! A hall with arcades of two storeys, fluted columns, vaulted aisles and statues: the stand-in for the Sponza scene
//! of Moon et al. 2010 (104M triangles), in which every surface is finely tessellated. Like that scene it has eight
//! area lights; more light comes in where the roof is open.

mod arcade;
mod column;
mod materials;
mod patches;
mod plan;
mod shell;

use super::assembly::Part;
use super::refine::Placement;
use super::relief::Relief;
use super::statue;
use anyhow::{Result, bail};
use arcade::bay;
use glam::DVec3;
use materials::{
    BEAM, COLUMN, LAMP, LIMESTONE, MATERIALS, Material, PEDESTAL, STATUE, TILES_DARK, TILES_LIGHT, VAULTS,
    WALL,
};
use patches::{Detail, Patches};
use plan::{ARCADE, BAY, BAYS, HALF_LENGTH, STOREYS, THICKNESS, VAULT};
use std::f64::consts::PI;
use std::fmt::Write;

/// Fewer triangles are less than the small meshes have.
const MIN_TRIANGLES: u64 = 25_000;
/// Area of all surfaces in square meters, twice for each triangle being half a square.
const TWICE_AREA: f64 = 8000.0;
/// Edges of the small meshes, in edges of what is made of them, and the shortest of them.
const BASE_EDGE: f64 = 1.7;
const MIN_BASE_EDGE: f64 = 0.025;
/// Columns are so much finer than walls, for their flutes.
const COLUMN_EDGE: f64 = 0.5;
/// Statues are so much finer than walls, and their small meshes are made for that share of the triangles.
const STATUE_EDGE: f64 = 0.35;
const STATUE_SHARE: f64 = 0.06;
const MIN_STATUE: u64 = 2000;
/// Statues in the nave stand before every second column, so far from the middle.
const NAVE_STATUES: f64 = 2.65;
/// Height of their pedestals, and of that in the apse.
const PEDESTALS: [f64; 2] = [1.0, 1.3];
/// Their sizes in those of life.
const STATUE_SCALES: [f64; 2] = [1.15, 1.75];
/// Bays whose aisles have a lamp.
const LAMP_BAYS: [usize; 4] = [0, 2, 4, 6];

/// Names of the files, in the order of the numbers of materials.
pub fn file_names() -> [&'static str; MATERIALS.len()] {
    MATERIALS.map(|material| material.name)
}

/// All parts of the hall for about so many triangles.
pub fn parts(triangles: u64, seed: u64) -> Result<Vec<Part>> {
    if triangles < MIN_TRIANGLES {
        bail!("an atrium has at least {MIN_TRIANGLES} triangles; ask for more");
    }
    let edge = (TWICE_AREA / triangles as f64).sqrt();
    let builder = Builder { detail: Detail { edge: (edge * BASE_EDGE).max(MIN_BASE_EDGE) }, seed };
    let mut parts = builder.shell();
    STOREYS.iter().for_each(|&storey| parts.extend(builder.storey(storey)));
    parts.extend(builder.balustrade());
    parts.extend(builder.statues(triangles)?);
    parts.push(lamps());
    Ok(parts)
}

struct Builder {
    detail: Detail,
    seed: u64,
}

impl Builder {
    fn part(&self, material: usize, patches: &Patches, placements: Vec<Placement>) -> Part {
        let relief = materials::relief(material, self.seed);
        Part { material, base: patches.mesh(), roundness: 0.0, relief, coarseness: 1.0, placements }
    }

    /// Floor, walls, apse, roofs and beams.
    fn shell(&self) -> Vec<Part> {
        let detail = self.detail;
        let once = || vec![Placement::IDENTITY];
        let mut frame = Patches::default();
        shell::apse_arch().molding(detail, -1.0, 0.4, &mut frame);
        vec![
            self.part(TILES_LIGHT, &shell::tiles(detail, 0), once()),
            self.part(TILES_DARK, &shell::tiles(detail, 1), once()),
            self.part(WALL, &shell::side_wall(detail), sides()),
            self.part(WALL, &shell::front_wall(detail), once()),
            self.part(WALL, &shell::end_wall(detail), once()),
            self.part(LIMESTONE, &frame, once()),
            self.part(VAULTS, &shell::apse(detail), once()),
            self.part(VAULTS, &shell::gallery(detail), sides()),
            self.part(VAULTS, &shell::roof(detail), sides()),
            self.part(BEAM, &shell::beams(detail), once()),
        ]
    }

    /// Columns and what they carry.
    fn storey(&self, storey: plan::Storey) -> Vec<Part> {
        let detail = self.detail;
        let mut wall = Patches::default();
        bay(storey).build(detail, &mut wall);
        let column = column::column(Detail { edge: detail.edge * COLUMN_EDGE }, storey);
        let mut molding = Patches::default();
        bay(storey).molding(detail, -1.0, 0.28, &mut molding);
        let columns =
            columns().map(|z| [-ARCADE, ARCADE].map(|x| Placement::new(0.0, DVec3::new(x, 0.0, z))));
        vec![
            Part { coarseness: COLUMN_EDGE, ..self.part(COLUMN, &column, columns.flatten().collect()) },
            self.part(WALL, &wall, both_sides(bays())),
            self.part(LIMESTONE, &molding, both_sides(bays())),
            self.part(LIMESTONE, &arcade::cornice(detail, storey), sides()),
            self.part(LIMESTONE, &arcade::dentils(detail, storey), both_sides(bays())),
            self.part(VAULTS, &arcade::vault(detail, storey), sides()),
            self.part(LIMESTONE, &arcade::rib(detail, storey), both_sides(columns_within())),
        ]
    }

    fn balustrade(&self) -> Vec<Part> {
        let y = STOREYS[1].floor + 0.08;
        let baluster = column::baluster(self.detail, arcade::BALUSTRADE - 0.18);
        let places = arcade::baluster_places(self.detail);
        let places = places.flat_map(|z| [-ARCADE, ARCADE].map(|x| Placement::new(0.0, DVec3::new(x, y, z))));
        vec![
            self.part(LIMESTONE, &arcade::rails(self.detail), sides()),
            self.part(COLUMN, &baluster, places.collect()),
        ]
    }

    /// Those before the columns in turn, and a larger one in the apse, all on pedestals.
    fn statues(&self, triangles: u64) -> Result<Vec<Part>> {
        let share = ((triangles as f64 * STATUE_SHARE) as u64).max(MIN_STATUE);
        let places: Vec<[f64; 3]> = [2.0, 4.0, 6.0]
            .iter()
            .flat_map(|i| [-1.0, 1.0].map(|side| [side * NAVE_STATUES, i * BAY - HALF_LENGTH, -0.9 * side]))
            .collect();
        let mut parts = Vec::new();
        let [nave, apse] = STATUE_SCALES;
        for kind in 0..4 {
            let seed = self.seed + kind;
            let [scale, height] = if kind == 3 { [apse, PEDESTALS[1]] } else { [nave, PEDESTALS[0]] };
            let of_kind = if kind == 3 {
                vec![Placement::new(0.0, DVec3::new(0.0, height, -HALF_LENGTH - 0.9))]
            } else {
                // Statues across from each other differ.
                let chosen = places.iter().enumerate().filter(|(i, _)| (i / 2 + 2 * i) as u64 % 3 == kind);
                chosen.map(|(_, [x, z, turn])| Placement::new(*turn, DVec3::new(*x, height, *z))).collect()
            };
            parts.push(Part {
                material: STATUE,
                base: statue::base(seed, share, scale)?,
                roundness: statue::ROUNDNESS,
                relief: statue::relief(seed, scale),
                coarseness: STATUE_EDGE,
                placements: of_kind,
            });
        }
        let small = column::pedestal(self.detail, 0.48, PEDESTALS[0]);
        let placements =
            places.iter().map(|[x, z, turn]| Placement::new(*turn, DVec3::new(*x, 0.0, *z))).collect();
        parts.push(self.part(PEDESTAL, &small, placements));
        let large = column::pedestal(self.detail, 0.72, PEDESTALS[1]);
        let place = Placement::new(0.0, DVec3::new(0.0, 0.0, -HALF_LENGTH - 0.9));
        parts.push(self.part(PEDESTAL, &large, vec![place]));
        Ok(parts)
    }
}

/// Both sides of the hall.
fn sides() -> Vec<Placement> {
    both_sides([0.0])
}

/// Places along z, on both sides.
fn both_sides(places: impl IntoIterator<Item = f64>) -> Vec<Placement> {
    let both = |z| [0.0, PI].map(|angle| Placement::new(angle, DVec3::Z * z));
    places.into_iter().flat_map(both).collect()
}

fn bays() -> impl Iterator<Item = f64> {
    (0..BAYS).map(|i| (i as f64 + 0.5) * BAY - HALF_LENGTH)
}

fn columns() -> impl Iterator<Item = f64> {
    (0..=BAYS).map(|i| i as f64 * BAY - HALF_LENGTH)
}

fn columns_within() -> impl Iterator<Item = f64> {
    (1..BAYS).map(|i| i as f64 * BAY - HALF_LENGTH)
}

/// Eight area lights of two triangles each, under the vaults of the aisles.
fn lamps() -> Part {
    let mut lamps = Patches::default();
    let coarse = Detail { edge: f64::INFINITY };
    let aisle = ARCADE + THICKNESS / 2.0 + VAULT;
    for (bay, side) in LAMP_BAYS.into_iter().flat_map(|bay| [-1.0, 1.0].map(|side| (bay, side))) {
        let z = (bay as f64 + 0.5) * BAY - HALF_LENGTH;
        let corner = DVec3::new(side * aisle - 0.5, STOREYS[0].top - 0.45, z - 0.5);
        lamps.flat(coarse, corner, [DVec3::X, DVec3::Z]);
    }
    Part {
        material: LAMP,
        base: lamps.mesh(),
        roundness: 0.0,
        relief: Relief::NONE,
        coarseness: f64::INFINITY,
        placements: vec![Placement::IDENTITY],
    }
}

/// The scene file beside the models.
pub fn scene() -> String {
    let mut text = VIEW.to_owned();
    text.push_str("material = [\n");
    for material in &MATERIALS {
        let _ = write!(text, "    {{ name = {:?}, base_color = {:?}", material.name, material.color);
        if let Some(emission) = material.emission {
            let _ = write!(text, ", emission = {emission:?}");
        }
        text.push_str(" },\n");
    }
    text.push_str("]\nmodel = [\n");
    for Material { name, .. } in &MATERIALS {
        let _ = writeln!(text, "    {{ file = \"{name}.ply\", material = \"{name}\" }},");
    }
    text.push_str("]\n");
    text
}

const VIEW: &str = r#"# An atrium. Written by cargo xtask scene.

camera = { position = [1.3, 2.1, 12.6], target = [-0.4, 3.75, 0.0], vertical_fov_degrees = 57 }
sky = { zenith = [0.8, 1.1, 1.9], horizon = [1.4, 1.6, 1.8], ground = [0.3, 0.28, 0.25] }
light = [
    { type = "directional", direction = [-0.4, -1.0, -0.5], intensity = [4.6, 4.0, 3.1] },
]
"#;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::assembly::{edge_for, triangles};

    #[test]
    fn counts_are_met() {
        for wanted in [25_000, 50_000, 1_000_000, 200_000_000] {
            let parts = parts(wanted, 1).unwrap();
            let made = triangles(&parts, edge_for(&parts, wanted)) as f64;
            assert!((made / wanted as f64 - 1.0).abs() < 0.02, "{made} of {wanted}");
        }
        assert!(parts(10, 1).is_err());
    }

    #[test]
    fn there_are_eight_lamps() {
        assert_eq!(lamps().base.triangles.len(), 16);
        assert!(lamps().base.normals.iter().filter(|n| n.y == -1.0).count() == 32);
    }
}
