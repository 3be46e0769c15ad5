//! An industrial plant, as CAD programs export them: the stand-in for the Power Plant of the Ray-Strips paper. Many
//! small parts, long thin triangles, a few large ones, dozens of materials, and strips that end early.

mod bay;
mod equipment;
mod fittings;
mod materials;
mod pipe;
mod shapes;
mod structure;

use anyhow::{Result, bail};
use bay::{Bay, PITCH, Part};
use glam::DVec3;
use materials::MATERIALS;
use shapes::block;
use std::fmt::Write;

/// Bays that are counted to tell how many are needed.
const SAMPLE: u64 = 40;
/// Parts are not divided, so that less would not come near to the count.
const MIN_TRIANGLES: u64 = 50_000;
/// The file of all parts where materials do not matter.
pub const SINGLE_FILE: &str = "pipes.ply";

/// What decides a plant.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    triangles: u64,
    seed: u64,
    /// Bays side by side.
    columns: u64,
    /// Rows of them, the last one being shorter.
    rows: u64,
}

impl Plant {
    /// A plant that is as deep as it is wide.
    pub fn with_triangles(triangles: u64, seed: u64) -> Result<Plant> {
        if triangles < MIN_TRIANGLES {
            bail!("a plant has at least {MIN_TRIANGLES} triangles; ask for more");
        }
        let sampled: u64 = (0..SAMPLE).map(|i| Bay::new(seed, i % 8, i / 8).triangles()).sum();
        let bays = (triangles as f64 * SAMPLE as f64 / sampled as f64).ceil();
        let columns = bays.sqrt().ceil();
        Ok(Plant { triangles, seed, columns: columns as u64, rows: (bays / columns).ceil() as u64 })
    }

    /// Gives parts and their materials to `take` until there are enough triangles.
    pub fn generate(&self, mut take: impl FnMut(&Part) -> Result<()>) -> Result<u64> {
        let ground = self.ground();
        let mut made = ground.shape.triangles.len() as u64;
        take(&ground)?;
        for number in 0.. {
            for part in &Bay::new(self.seed, number % self.columns, number / self.columns).parts {
                if made >= self.triangles {
                    return Ok(made);
                }
                take(part)?;
                made += part.shape.triangles.len() as u64;
            }
        }
        Ok(made)
    }

    fn size(&self) -> DVec3 {
        DVec3::new(self.columns as f64, 0.0, self.rows as f64) * PITCH
    }

    fn ground(&self) -> Part {
        let border = DVec3::new(PITCH, 0.0, PITCH);
        let size = self.size() + border * 2.0 + DVec3::Y;
        Part { material: 0, shape: block(-border - DVec3::Y, size) }
    }

    /// The scene file beside a model for each material of which there are parts.
    pub fn scene(&self, used: &[bool]) -> String {
        let used = || MATERIALS.iter().zip(used).filter(|(_, used)| **used).map(|(material, _)| material);
        let mut text = self.view();
        text.push_str("material = [\n");
        for material in used() {
            let _ =
                writeln!(text, "    {{ name = {:?}, base_color = {:?} }},", material.name, material.color);
        }
        text.push_str("]\nmodel = [\n");
        for material in used() {
            let _ = writeln!(text, "    {{ file = \"{0}.ply\", material = \"{0}\" }},", material.name);
        }
        text.push_str("]\n");
        text
    }

    /// The scene file beside a single model.
    pub fn scene_of_one_file(&self) -> String {
        format!("{}model = [{{ file = \"{SINGLE_FILE}\" }}]\n", self.view())
    }

    /// Camera and light.
    fn view(&self) -> String {
        let middle = self.size() * 0.5 + DVec3::Y * 4.0;
        let position = middle + DVec3::new(0.64, 0.33, 0.68) * (self.size().length() + 8.0);
        format!(
            "# A plant. Written by cargo xtask scene.\n\n\
             camera = {{ position = [{:.2}, {:.2}, {:.2}], target = [{:.2}, {:.2}, {:.2}], vertical_fov_degrees = 36 }}\n\
             sky = {{ zenith = [0.25, 0.42, 0.85], horizon = [0.8, 0.82, 0.85], ground = [0.2, 0.19, 0.17] }}\n\
             light = [\n    \
                 {{ type = \"directional\", direction = [-0.6, -1.0, -0.5], intensity = [2.8, 2.55, 2.1] }},\n]\n",
            position.x, position.y, position.z, middle.x, middle.y, middle.z,
        )
    }
}

/// Names of the files, in the order of the numbers of materials.
pub fn file_names() -> impl Iterator<Item = String> {
    MATERIALS.iter().map(|material| format!("{}.ply", material.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_met() {
        for wanted in [50_000, 300_000] {
            let mut counted = 0;
            let mut materials = std::collections::BTreeSet::new();
            let made = Plant::with_triangles(wanted, 3).unwrap().generate(|part| {
                counted += part.shape.triangles.len() as u64;
                materials.insert(part.material);
                Ok(())
            });
            assert_eq!(made.unwrap(), counted);
            assert!((counted as f64 / wanted as f64 - 1.0).abs() < 0.02, "{counted} of {wanted}");
            assert!(materials.len() >= 30, "{} materials", materials.len());
        }
    }

    #[test]
    fn parts_are_sound() {
        for part in &Bay::new(1, 2, 3).parts {
            let shape = &part.shape;
            assert!(shape.positions.iter().flatten().all(|x| x.is_finite()));
            assert!(shape.triangles.iter().flatten().all(|&v| (v as usize) < shape.positions.len()));
        }
    }
}
