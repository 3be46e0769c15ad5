//! What caches of all sizes miss of a pack while a picture is path traced.

use crate::cache::Shape;
use crate::simulation::{Caches, SimulatedWorld, Simulation};
use anyhow::{Context, Result};
use raystrips_render::{RenderParams, TracedWorld, render};
use raystrips_tracer::Scene;
use std::path::Path;

/// Sizes of blocks, and parts of the pack that caches hold.
pub const BLOCKS: [(u64, &str); 4] =
    [(64, "64 B"), (4 << 10, "4 KiB"), (64 << 10, "64 KiB"), (4 << 20, "4 MiB")];
pub const SHARES: [f64; 3] = [0.01, 0.06, 0.25];
/// The share of which sizes between those of [`BLOCKS`] are simulated too.
const USUAL: usize = 1;
/// log2 of those sizes: each is four times the one before.
const LOG_SIZES: std::ops::RangeInclusive<u32> = 3..=11;

/// Misses of a pack.
pub struct Misses(Simulation);

impl Misses {
    /// Renders a square picture of the pack with simulated caches.
    pub fn of(path: &Path, side: u32, spp: u32) -> Result<Misses> {
        let pack_bytes = std::fs::metadata(path).with_context(|| path.display().to_string())?.len();
        let shape = |block: u64, share: f64| {
            let blocks = ((pack_bytes as f64 * share) as u64 / block).max(1);
            Shape { block, blocks, ways: None }
        };
        let named = BLOCKS.iter().flat_map(|&(block, _)| SHARES.map(|share| shape(block, share)));
        let others = LOG_SIZES.map(|log| shape(1 << (2 * log), SHARES[USUAL]));
        let shapes: Vec<Shape> = named.chain(others).collect();
        let world = TracedWorld::new(Scene::open(path)?);
        let world = SimulatedWorld::new(world, &Caches { blocks: &shapes, page_shares: &SHARES });
        let params = RenderParams { width: side, height: side, spp, threads: 1, ..RenderParams::default() };
        render(&world, &params, &|_| ())?;
        Ok(Misses(world.into_simulation()))
    }

    /// For each size of blocks the misses of all caches, as text.
    pub fn cells(&self) -> Vec<String> {
        let cell = |block: usize| {
            let misses = |share: usize| format!("{:.3}", self.all(block * SHARES.len() + share));
            (0..SHARES.len()).map(misses).collect::<Vec<String>>().join(", ")
        };
        (0..BLOCKS.len()).map(cell).collect()
    }

    /// Misses of the usual cache by size of blocks.
    pub fn by_block(&self) -> Vec<(f64, f64)> {
        let first = BLOCKS.len() * SHARES.len();
        LOG_SIZES.enumerate().map(|(i, log)| ((1u64 << (2 * log)) as f64, self.all(first + i))).collect()
    }

    /// Prints misses by the part of the pack.
    pub fn print_parts(&self) {
        for (block, (_, name)) in BLOCKS.iter().enumerate() {
            for (share, part) in SHARES.iter().enumerate() {
                let misses = self.0.misses_a_ray(block * SHARES.len() + share);
                let cells = misses.map(|misses| format!("{misses:.4}")).join(" | ");
                println!("| {name} | {:.0} % | {cells} |", 100.0 * part);
            }
        }
    }

    /// As of [`Simulation`].
    pub fn mean_log_distance(&self) -> f64 {
        self.0.mean_log_distance()
    }

    /// Pages that a ray brings into a pool that holds the last of [`SHARES`] of them.
    pub fn pages_a_ray(&self) -> f64 {
        self.0.pages_a_ray(SHARES.len() - 1).0
    }

    /// As of [`Simulation`].
    pub fn page_switches_a_ray(&self) -> f64 {
        self.0.page_switches_a_ray()
    }

    fn all(&self, cache: usize) -> f64 {
        self.0.misses_a_ray(cache).iter().sum()
    }
}
