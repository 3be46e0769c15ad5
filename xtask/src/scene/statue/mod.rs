//! A statue with detail at every scale: the stand-in for scans of sculptures.
//!
//! A solid is made into a small mesh, which is refined like any other: see [`refine`](super::refine).

mod cloth;
mod figure;
mod head;
mod polygonize;
mod pose;
mod solid;

use super::assembly::Part;
use super::refine::{BaseMesh, Placement};
use super::relief::Relief;
use anyhow::{Result, bail};
use figure::{BOUNDS, Figure};
use polygonize::polygonize;
use pose::Pose;

/// Name of the file and of the material.
pub const MATERIAL: &str = "statue";
/// Fewer triangles are no statue.
const MIN_TRIANGLES: u64 = 5000;
/// Triangles of the small mesh: a share of all, but not more than shapes need and memory should hold.
const BASE_SHARE: f64 = 0.3;
const MAX_BASE: f64 = 240_000.0;
/// Triangles of a grid with cells of one meter.
const TRIANGLES_PER_AREA: f64 = 12.0;
/// Length and height of the longest waves of the surface, in meters of a statue of life size.
const WAVES: [f64; 2] = [0.09, 0.0016];

/// The small mesh of a statue of life size, its plinth standing on height 0, from which `triangles` are to be made.
pub fn base(seed: u64, triangles: u64, scale: f64) -> Result<BaseMesh> {
    let wanted = (triangles as f64 * BASE_SHARE).min(MAX_BASE);
    let mesh = polygonize(&Figure::new(Pose::new(seed)), BOUNDS, (TRIANGLES_PER_AREA / wanted).sqrt())?;
    let low = mesh.bounds()[0].y;
    let positions = mesh.positions.iter().map(|&p| (p - glam::DVec3::Y * low) * scale);
    Ok(BaseMesh::new(positions.collect(), mesh.triangles))
}

/// The surface of a statue so many times life size.
pub fn relief(seed: u64, scale: f64) -> Relief {
    Relief::chiseled(seed, WAVES[0] * scale, WAVES[1] * scale)
}

/// The parts of the scene: one.
pub fn parts(triangles: u64, seed: u64) -> Result<Vec<Part>> {
    if triangles < MIN_TRIANGLES {
        bail!("a statue has at least {MIN_TRIANGLES} triangles; ask for more");
    }
    Ok(vec![Part {
        material: 0,
        base: base(seed, triangles, 1.0)?,
        roundness: 0.75,
        relief: relief(seed, 1.0),
        coarseness: 1.0,
        placements: vec![Placement::IDENTITY],
    }])
}

/// The scene file beside the statue.
pub const SCENE: &str = r#"# A statue. Written by cargo xtask scene.

camera = { position = [1.5, 1.9, 4.1], target = [0.0, 1.13, 0.0], vertical_fov_degrees = 32 }
sky = { zenith = [0.3, 0.38, 0.55], horizon = [0.42, 0.42, 0.44], ground = [0.16, 0.14, 0.12] }
light = [
    { type = "directional", direction = [-1.0, -0.85, -0.55], intensity = [2.9, 2.6, 2.2] },
]
material = [
    { name = "statue", base_color = [0.78, 0.74, 0.67], roughness = 0.7 },
]
model = [
    { file = "statue.ply", material = "statue" },
]
"#;
