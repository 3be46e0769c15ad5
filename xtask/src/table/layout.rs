//! Layouts of packs by what caches of all sizes miss of them.

use crate::cache::Shape;
use crate::flags::Flags;
use crate::simulation::{SimulatedWorld, Simulation};
use anyhow::{Result, bail};
use raystrips_render::{RenderParams, TracedWorld, render};
use raystrips_tracer::{Part, Scene};
use std::path::Path;

/// How it is called.
pub const USAGE: &str = "cargo xtask table layout PACK.rsp... [--size 160x120] [--spp 4]";

/// Block sizes and how many blocks caches hold.
const BLOCKS: [(u64, &str, [u64; 3]); 4] = [
    (64, "64 B", [512, 16 << 10, 512 << 10]),
    (4 << 10, "4 KiB", [64, 1536, 16 << 10]),
    (64 << 10, "64 KiB", [16, 256, 2048]),
    (4 << 20, "4 MiB", [4, 16, 64]),
];

pub fn print(arguments: &[String]) -> Result<()> {
    let flags = Flags::parse(arguments, &["--side", "--spp"], &[])?;
    if flags.rest.is_empty() {
        bail!("usage: {USAGE}");
    }
    let side = flags.count("--side")?.unwrap_or(128) as u32;
    let spp = flags.count("--spp")?.unwrap_or(4) as u32;
    for pack in &flags.rest {
        let shapes: Vec<Shape> = BLOCKS
            .iter()
            .flat_map(|&(block, _, counts)| counts.map(|blocks| Shape { block, blocks, ways: None }))
            .collect();
        let s = simulate(Path::new(pack), &shapes, (side, spp))?;
        println!("{pack}: {} rays", s.rays);
        for (share, (n, b)) in &s.paged {
            println!(
                "PAGES share {share}: misses/ray {:.5} KB/ray {:.4}",
                *n as f64 / s.rays as f64,
                *b as f64 / s.rays as f64 / 1e3
            );
        }
        println!("reads a ray: {:?}", s.reads.map(|r| r as f64 / s.rays as f64));
        for (i, shape) in shapes.iter().enumerate() {
            let m = s.misses(i);
            println!(
                "{:>8} x {:>7}: {:9.4}  {:?}",
                shape.block,
                shape.blocks,
                s.misses_a_ray(i),
                Part::ALL.map(|p| format!("{p:?} {:.3}", m[p as usize] as f64 / s.rays as f64))
            );
        }
    }
    Ok(())
}

fn simulate(pack: &Path, shapes: &[Shape], (side, spp): (u32, u32)) -> Result<Simulation> {
    let world = SimulatedWorld::new(TracedWorld::new(Scene::open(pack)?), shapes);
    let params = RenderParams { width: side, height: side, spp, threads: 1, ..RenderParams::default() };
    render(&world, &params, &|_| ())?;
    Ok(world.into_simulation())
}
