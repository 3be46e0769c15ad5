//! What caches of all sizes miss of packs while a picture is path traced.

use crate::cache::Shape;
use crate::flags::Flags;
use crate::simulation::{Caches, SimulatedWorld, Simulation};
use anyhow::{Context, Result, bail};
use raystrips_render::{RenderParams, TracedWorld, render};
use raystrips_tracer::{Part, Scene};
use std::path::Path;

/// How it is called.
pub const USAGE: &str = "cargo xtask table layout [--side 192] [--spp 4] PACK.rsp...";

/// Sizes of blocks, and parts of the pack that caches hold.
const BLOCKS: [(u64, &str); 4] = [(64, "64 B"), (4 << 10, "4 KiB"), (64 << 10, "64 KiB"), (4 << 20, "4 MiB")];
const SHARES: [f64; 3] = [0.01, 0.06, 0.25];

/// Prints for each pack the misses a ray of simulated caches. The packs may be of the same model, made in several ways.
pub fn print(arguments: &[String]) -> Result<()> {
    let flags = Flags::parse(arguments, &["--side", "--spp"], &[])?;
    if flags.rest.is_empty() {
        bail!("usage: {USAGE}");
    }
    let side = flags.count("--side")?.unwrap_or(192) as u32;
    let spp = flags.count("--spp")?.unwrap_or(4) as u32;
    let params = RenderParams { width: side, height: side, spp, threads: 1, ..RenderParams::default() };
    println!("{side}x{side}, {spp} samples, tiles as they come; LRU, each cache holds a part of the pack\n");
    println!("| pack | block | cache holds | misses a ray | upper | lower | strips | vertices | KB a ray |");
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    flags.rest.iter().try_for_each(|pack| print_pack(Path::new(pack), &params))
}

fn print_pack(path: &Path, params: &RenderParams) -> Result<()> {
    let pack_bytes = std::fs::metadata(path).with_context(|| path.display().to_string())?.len();
    let blocks = |block: u64| SHARES.map(|share| ((pack_bytes as f64 * share) as u64 / block).max(1));
    let shapes =
        BLOCKS.iter().flat_map(|&(block, _)| blocks(block).map(|blocks| Shape { block, blocks, ways: None }));
    let shapes: Vec<Shape> = shapes.collect();
    let world = TracedWorld::new(Scene::open(path)?);
    let world = SimulatedWorld::new(world, &Caches { blocks: &shapes, page_shares: &SHARES });
    render(&world, params, &|_| ())?;
    let simulation = world.into_simulation();
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let names = BLOCKS.iter().flat_map(|&(block, name)| SHARES.map(|share| (block, name, share)));
    for (i, (block, block_name, share)) in names.enumerate() {
        let misses = simulation.misses_a_ray(i);
        let all: f64 = misses.iter().sum();
        println!(
            "| {name} | {block_name} | {:.0} % | {all:.4} | {} | {:.3} |",
            100.0 * share,
            misses.map(|m| format!("{m:.4}")).join(" | "),
            all * block as f64 / 1e3
        );
    }
    for (i, share) in SHARES.into_iter().enumerate() {
        let (misses, bytes) = simulation.pages_a_ray(i);
        println!("| {name} | pages | {:.0} % | {misses:.4} | | | | | {:.3} |", 100.0 * share, bytes / 1e3);
    }
    print_reads(&name, &simulation);
    Ok(())
}

/// What rays read in all: what a cache that holds nothing would miss.
fn print_reads(name: &str, simulation: &Simulation) {
    let reads = simulation.reads.map(|reads| reads as f64 / simulation.rays as f64);
    let [upper, lower, strips, vertices] = Part::ALL.map(|part| format!("{:.2}", reads[part as usize]));
    let all: f64 = reads.iter().sum();
    println!("| {name} | reads | | {all:.2} | {upper} | {lower} | {strips} | {vertices} | |");
}

#[cfg(test)]
mod tests {
    #[test]
    fn packs_are_needed() {
        assert!(super::print(&[]).unwrap_err().to_string().contains("PACK.rsp"));
    }
}
