//! A furred animal: the stand-in for the squirrel of 32 million strands of Moon et al. 2010.

mod coat;
mod hair_file;
mod squirrel;

use super::assembly::Part;
use super::polygonize::polygonize;
use super::random::Random;
use super::refine::{BaseMesh, Placement};
use super::relief::Relief;
use super::solid::{Solid, ball};
use anyhow::{Result, bail};
use coat::{COLORS, Coat, Growth};
use glam::DVec3;
use hair_file::HairWriter;
use squirrel::{BOUNDS, EYE_RADIUS, EYES, NOSE, NOSE_RADIUS, NUT, NUT_RADIUS, Squirrel};
use std::path::Path;

/// Fewer strands are no coat.
const MIN_STRANDS: u64 = 1000;
/// Length of the cells from which the skin and the small solids are made, in meters.
const SKIN_CELL: f64 = 0.0012;
const SMALL_CELL: f64 = 0.0006;
/// Names of the files of triangles, in the order of the numbers of materials.
pub const MATERIALS: [&str; 5] = ["skin", "eyes", "nut", "ground", "lamp"];
/// Half of the side of the ground, in meters.
const GROUND: f64 = 1.5;
/// Middles of the lamps, and half of the side of one.
const LAMPS: [[f64; 3]; 4] = [[0.5, 0.75, 0.45], [-0.55, 0.65, 0.5], [-0.4, 0.8, -0.5], [0.45, 0.7, -0.55]];
const LAMP_HALF: f64 = 0.12;

/// The parts that are made of triangles.
pub fn parts() -> Result<Vec<Part>> {
    let solid = |material, base| Part {
        material,
        base,
        roundness: 0.0,
        relief: Relief::NONE,
        coarseness: f64::INFINITY,
        placements: vec![Placement::IDENTITY],
    };
    let mut parts = vec![solid(0, skin()?), solid(2, ball_mesh(NUT, NUT_RADIUS)?)];
    for (center, radius) in [(EYES[0], EYE_RADIUS), (EYES[1], EYE_RADIUS), (NOSE, NOSE_RADIUS)] {
        parts.push(solid(1, ball_mesh(center, radius)?));
    }
    let [x, z] = [DVec3::X, DVec3::Z].map(|axis| axis * GROUND);
    parts.push(solid(3, square(DVec3::ZERO, z, x)));
    for center in LAMPS.map(DVec3::from_array) {
        // They look to the middle of the animal.
        let to = (DVec3::Y * 0.12 - center).normalize();
        let u = to.any_orthonormal_vector();
        parts.push(solid(4, square(center, u * LAMP_HALF, to.cross(u) * LAMP_HALF)));
    }
    Ok(parts)
}

fn skin() -> Result<BaseMesh> {
    polygonize(&Squirrel, BOUNDS, SKIN_CELL)
}

struct Ball(DVec3, f64);

impl Solid for Ball {
    fn distance(&self, p: DVec3) -> f64 {
        ball(p, self.0, self.1)
    }
}

fn ball_mesh(center: DVec3, radius: f64) -> Result<BaseMesh> {
    let half = DVec3::splat(1.2 * radius);
    polygonize(&Ball(center, radius), [center - half, center + half], SMALL_CELL)
}

/// A square from half of its sides; its front looks along u x v.
fn square(center: DVec3, u: DVec3, v: DVec3) -> BaseMesh {
    BaseMesh::parallelograms(&[(center - u - v, [2.0 * u, 2.0 * v])])
}

/// Writes a file for each color of hair, `strands` in all.
pub fn write_coat(strands: u64, seed: u64, folder: &Path) -> Result<()> {
    if strands < MIN_STRANDS {
        bail!("a coat has at least {MIN_STRANDS} strands; ask for more");
    }
    let coat = Coat::new(seed);
    let skin = skin()?;
    let writers: Result<Vec<HairWriter>> =
        COLORS.iter().map(|color| HairWriter::create(&folder.join(format!("{color}.hair")))).collect();
    let mut writers = writers?;
    let patches: Vec<Patch> = skin.triangles.iter().map(|t| Patch::new(&skin, *t, &coat)).collect();
    let total: f64 = patches.iter().map(|patch| patch.weight).sum();
    let (mut before, mut next) = (0.0, 0);
    for patch in &patches {
        before += patch.weight;
        let end = (strands as f64 * (before / total)).round() as u64;
        for number in next..end {
            let (root, normal) = patch.root(number, seed);
            let points = coat.strand(number, root, normal, &patch.growth);
            writers[patch.growth.color].strand(number, &points)?;
        }
        next = end;
    }
    writers.into_iter().try_for_each(|writer| writer.finish(|strand, k| coat.width(strand, strands, k)))
}

/// A triangle of the skin.
struct Patch {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    growth: Growth,
    /// Its share of all strands.
    weight: f64,
}

impl Patch {
    fn new(skin: &BaseMesh, triangle: [u32; 3], coat: &Coat) -> Patch {
        let corners = triangle.map(|v| skin.positions[v as usize]);
        let normals = triangle.map(|v| skin.normals[v as usize]);
        let area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() / 2.0;
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let normal = (normals[0] + normals[1] + normals[2]).normalize_or(DVec3::Y);
        let growth = coat.growth(middle, normal);
        Patch { corners, normals, growth, weight: area * growth.density }
    }

    /// Where a strand grows, and the normal there.
    fn root(&self, number: u64, seed: u64) -> (DVec3, DVec3) {
        let mut random = Random::new(&[seed, number, 1]);
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let at = |of: &[DVec3; 3]| of[0] + (of[1] - of[0]) * u + (of[2] - of[0]) * v;
        (at(&self.corners), at(&self.normals).normalize_or(DVec3::Y))
    }
}

/// The scene file beside the models.
pub const SCENE: &str = r#"# A furred animal. Written by cargo xtask scene.

camera = { position = [0.42, 0.2, 0.42], target = [-0.005, 0.118, -0.025], vertical_fov_degrees = 27 }
sky = { zenith = [0.1, 0.13, 0.2], horizon = [0.16, 0.17, 0.18], ground = [0.05, 0.05, 0.05] }
material = [
    { name = "red", base_color = [0.46, 0.19, 0.07], alpha = 0.8 },
    { name = "white", base_color = [0.82, 0.76, 0.68], alpha = 0.8 },
    { name = "skin", base_color = [0.33, 0.2, 0.14] },
    { name = "eyes", base_color = [0.015, 0.012, 0.01], roughness = 0.1, specular = 1.0 },
    { name = "nut", base_color = [0.36, 0.2, 0.09], roughness = 0.5 },
    { name = "ground", base_color = [0.34, 0.4, 0.26] },
    { name = "lamp", base_color = [0.0, 0.0, 0.0], emission = [13.0, 12.0, 10.5] },
]
model = [
    { file = "red.hair", material = "red" },
    { file = "white.hair", material = "white" },
    { file = "skin.ply", material = "skin" },
    { file = "eyes.ply", material = "eyes" },
    { file = "nut.ply", material = "nut" },
    { file = "ground.ply", material = "ground" },
    { file = "lamp.ply", material = "lamp" },
]
"#;
