//! A large isosurface, as simulations make them: the stand-in for scans and simulation data of any size.

mod field;

use super::march::{Cells, march};
use super::sink::{Counter, MeshSink};
use anyhow::{Result, bail};
pub use field::Noisy;

/// Periods of the gyroid along the cube.
const PERIODS: f64 = 6.0;
/// Triangles of a grid of n cells a side with [`PERIODS`], divided by n²; a first guess.
const TRIANGLES_PER_AREA: f64 = 70.0;
/// Finer grids are not counted: their number of triangles follows from coarser ones.
const COUNTED_CELLS: usize = 192;
/// Coarsest grid.
const MIN_CELLS: usize = 24;
/// Fewer triangles are no surface on the coarsest grid.
const MIN_TRIANGLES: u64 = 5000;
/// Share of the triangles that the count may be off.
const TOLERANCE: f64 = 0.004;
/// Tries to meet it.
const MAX_TRIES: usize = 32;

/// What decides a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isosurface {
    cells: usize,
    periods: f64,
    seed: u64,
}

impl Isosurface {
    /// The surface of about `triangles` triangles: the grid is chosen first, then the number of periods, which unlike
    /// the number of cells can be changed by any little.
    pub fn with_triangles(triangles: u64, seed: u64) -> Result<Isosurface> {
        if triangles < MIN_TRIANGLES {
            bail!("an isosurface has at least {MIN_TRIANGLES} triangles; ask for more");
        }
        let wanted = triangles as f64;
        let cells = (wanted / TRIANGLES_PER_AREA).sqrt().round() as usize;
        let mut surface = Isosurface { cells: cells.max(MIN_CELLS), periods: PERIODS, seed };
        surface.periods =
            surface.periods.min(wanted / (TRIANGLES_PER_AREA / PERIODS) / (surface.cells as f64).powi(2));
        let mut best = (f64::INFINITY, surface);
        for step in 0..MAX_TRIES {
            let ratio = wanted / surface.estimated_triangles()?;
            let error = (ratio - 1.0).abs();
            if error < best.0 {
                best = (error, surface);
            }
            if error < TOLERANCE {
                break;
            }
            // Noise changes with the periods too; small surfaces are met by smaller steps.
            surface.periods *= if step < MAX_TRIES / 4 { ratio } else { ratio.sqrt() };
        }
        Ok(best.1)
    }

    /// Triangles as counted on this grid, or as a grid without end would have them less what a coarse grid loses.
    fn estimated_triangles(&self) -> Result<f64> {
        if self.cells <= COUNTED_CELLS {
            return self.counted_triangles(self.cells);
        }
        // Triangles are area / cell², less an error that goes with cell².
        let [coarse, fine] = [COUNTED_CELLS / 2, COUNTED_CELLS];
        let density = |cells: usize| Ok(self.counted_triangles(cells)? / square(cells as f64)) as Result<f64>;
        let [coarse, fine] = [density(coarse)?, density(fine)?];
        let slope = (coarse - fine) / 3.0;
        let finer = square(COUNTED_CELLS as f64 / self.cells as f64);
        Ok((fine - slope * (1.0 - finer)) * square(self.cells as f64))
    }

    fn counted_triangles(&self, cells: usize) -> Result<f64> {
        let mut counter = Counter::default();
        Isosurface { cells, ..*self }.generate(&mut counter)?;
        Ok(counter.triangles as f64)
    }

    /// Puts the surface into `sink`.
    pub fn generate(&self, sink: &mut impl MeshSink) -> Result<()> {
        let cells = Cells { counts: [self.cells; 3], size: 1.0 / self.cells as f64 };
        march(&mut Noisy::new(self.cells, self.periods, self.seed), cells, sink)
    }
}

/// Not `powi`, whose last bit may differ between machines.
fn square(x: f64) -> f64 {
    x * x
}

/// The scene file beside the surface.
pub const SCENE: &str = r#"# An isosurface. Written by cargo xtask scene.

camera = { position = [2.25, 1.6, 2.6], target = [0.5, 0.44, 0.5], vertical_fov_degrees = 31 }
sky = { zenith = [0.35, 0.5, 0.9], horizon = [0.85, 0.85, 0.85], ground = [0.25, 0.22, 0.2] }
light = [
    { type = "directional", direction = [-0.45, -1.0, -0.65], intensity = [2.3, 2.05, 1.7] },
]
material = [
    { name = "surface", base_color = [0.72, 0.58, 0.42], roughness = 0.6 },
]
model = [
    { file = "isosurface.ply", material = "surface" },
]
"#;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_met() {
        for wanted in [5000, 10_000, 70_000, 1_000_000, 3_400_000] {
            let surface = Isosurface::with_triangles(wanted, 5).unwrap();
            let count = surface.counted_triangles(surface.cells).unwrap();
            let error = count / wanted as f64 - 1.0;
            assert!(error.abs() < 0.02, "{wanted}: {count}, {surface:?}");
        }
        assert!(Isosurface::with_triangles(1, 5).is_err());
    }
}
