//! A statue with detail at every scale: the stand-in for scans of sculptures.
//!
//! A solid is made into a small mesh, which is refined like any other: see [`refine`](super::refine).

mod cloth;
mod figure;
mod head;
mod mesh_file;
mod pose;

use super::assembly::Part;
use super::polygonize::polygonize;
use super::refine::{BaseMesh, Placement};
use super::relief::Relief;
use anyhow::{Result, bail};
use figure::{BOUNDS, Figure};
use pose::Pose;
use std::path::Path;

/// Name of the file and of the material.
pub const MATERIAL: &str = "statue";
/// Fewer triangles are no statue.
const MIN_TRIANGLES: u64 = 5000;
/// Triangles of the small mesh: a share of all, but not more than shapes need and memory should hold.
const BASE_SHARE: f64 = 0.3;
const MAX_BASE: f64 = 240_000.0;
/// Triangles of a grid with cells of one meter.
const TRIANGLES_PER_AREA: f64 = 12.0;
/// Height of a figure, in meters.
const HEIGHT: f64 = 1.8;
/// As round as the small mesh is meant to be.
pub const ROUNDNESS: f64 = 0.75;
/// Length and height of the longest waves of the surface, in meters of a statue of life size.
const WAVES: [f64; 2] = [0.08, 0.0026];

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
    Ok(vec![part(base(seed, triangles, 1.0)?, seed, 1.0)])
}

/// The mesh of a file instead, with the surface of a statue of its size.
pub fn parts_of_mesh(path: &Path, triangles: u64, seed: u64) -> Result<Vec<Part>> {
    let base = mesh_file::read(path)?;
    let count = base.triangles.len();
    if triangles < count as u64 {
        bail!("{}: has {count} triangles already; ask for more", path.display());
    }
    let [low, high] = base.bounds();
    let scale = (high - low).max_element() / HEIGHT;
    Ok(vec![part(base, seed, scale)])
}

fn part(base: BaseMesh, seed: u64, scale: f64) -> Part {
    Part {
        material: 0,
        base,
        roundness: ROUNDNESS,
        relief: relief(seed, scale),
        coarseness: 1.0,
        placements: vec![Placement::IDENTITY],
    }
}

/// The scene file beside the statue.
pub fn scene() -> String {
    format!("{HEADER}{CAMERA}{LIGHT}")
}

/// The scene file beside the mesh of a file, for which the renderer chooses the camera.
pub fn scene_of_mesh() -> String {
    format!("{HEADER}{LIGHT}")
}

const HEADER: &str = "# A statue. Written by cargo xtask scene.\n\n";

const CAMERA: &str =
    "camera = { position = [1.5, 1.9, 4.3], target = [0.0, 1.55, 0.0], vertical_fov_degrees = 21 }\n";

const LIGHT: &str = r#"sky = { zenith = [0.12, 0.19, 0.36], horizon = [0.24, 0.3, 0.42], ground = [0.1, 0.08, 0.06] }
light = [
    { type = "directional", direction = [0.85, -0.75, -0.8], intensity = [3.5, 3.0, 2.4] },
]
material = [
    { name = "statue", base_color = [0.66, 0.61, 0.53], roughness = 0.7 },
]
model = [
    { file = "statue.ply", material = "statue" },
]
"#;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::assembly::{edge_for, triangles};
    use crate::scene::refine::{Refinement, refine};
    use crate::scene::sink::Kept;
    use crate::scene::testing::open_edges;

    #[test]
    fn statues_are_closed() {
        for seed in 0..3 {
            let part = &parts(30_000, seed).unwrap()[0];
            let refinement = Refinement { edge: 0.02, roundness: ROUNDNESS, relief: &part.relief };
            let mut mesh = Kept::default();
            refine(&part.base, &Placement::IDENTITY, &refinement, &mut mesh).unwrap();
            assert_eq!(open_edges(&mesh), 0, "{seed}");
        }
    }

    #[test]
    fn counts_are_met() {
        for wanted in [5000, 50_000, 500_000] {
            let parts = parts(wanted, 1).unwrap();
            let made = triangles(&parts, edge_for(&parts, wanted)) as f64;
            assert!((made / wanted as f64 - 1.0).abs() < 0.02, "{made} of {wanted}");
        }
        assert!(parts(10, 1).is_err());
    }
}
