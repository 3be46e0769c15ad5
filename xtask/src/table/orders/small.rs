//! Orders where all is in memory: speed, and what caches of the processor miss (Moon et al. 2010, section 5.3).

use super::{DISKS, Measured, OTHER_ORDERS, PAPER_ORDERS, Rendered, Setting, overhead};
use crate::cache::Shape;
use crate::simulation::{Caches, SimulatedWorld, Simulation};
use anyhow::{Context, Result};
use raystrips_render::{
    Curve, HitPoints, OrderParams, Ordering, RenderParams, TracedWorld, Unfinished, Watch, World, render,
    render_ordered,
};
use raystrips_tracer::{ProxyKind, Scene};
use std::path::Path;

/// Runs of which the median is taken.
const REPEAT: usize = 3;
/// Side of the picture with which caches are simulated, and its samples.
const SIMULATED_SIDE: u32 = 192;
const SIMULATED_SPP: u32 = 4;
/// Memory for rays that are sorted there.
const BUFFER_BYTES: u64 = 88 << 20;
const LINE: u64 = 64;

/// The second cache of the paper's machine.
const PAPER_CACHE: (u64, u64) = (6 << 20, 24);

impl Setting {
    /// Prints the speed and the misses of all orders.
    pub(super) fn small(&self, pack: &Rendered) -> Result<()> {
        let own = [1, 2].map(own_cache);
        let shapes: Vec<Shape> = own.into_iter().chain([PAPER_CACHE]).map(shape).collect();
        let heads = shapes.iter().map(|s| {
            format!("misses a ray, {} KiB {}-way", (s.block * s.blocks) >> 10, s.ways.unwrap_or(s.blocks))
        });
        let heads: Vec<String> = heads.collect();
        println!("| order | rays | Mrays/s | over none | overhead | {} |", heads.join(" | "));
        println!("|---|---:|---:|---:|---:|---:|---:|---:|");
        let mut none = None;
        for order in ["none"].iter().chain(&PAPER_ORDERS).chain(&OTHER_ORDERS) {
            let measured = self.median(pack, order)?;
            let none = *none.get_or_insert(measured.rate());
            let misses = match simulated(&pack.path, order, &shapes)? {
                Some(simulation) => (0..shapes.len()).map(|i| misses(&simulation, i)).collect(),
                None => vec![String::new(); shapes.len()],
            };
            println!(
                "| {order} | {:.1}M | {:.3} | {:.2} | {:.1} % | {} |",
                measured.rays / 1e6,
                measured.rate(),
                measured.rate() / none,
                overhead(&measured, self.limited.threads),
                misses.join(" | ")
            );
        }
        Ok(())
    }

    fn median(&self, pack: &Rendered, order: &str) -> Result<Measured> {
        let render = |_| self.limited.render(&pack.path, &["--reorder", order], (None, &DISKS[3]));
        let mut runs: Vec<Measured> = (0..REPEAT).map(render).collect::<Result<_>>()?;
        runs.sort_by(|a, b| a.rate().total_cmp(&b.rate()));
        Ok(runs.swap_remove(REPEAT / 2))
    }
}

/// Bytes and ways of this machine's data cache of a level; those of a common one where the system does not tell.
fn own_cache(level: u32) -> (u64, u64) {
    // Number 1 is that of instructions.
    let index = if level == 1 { 0 } else { level };
    let read = |name: &str| {
        std::fs::read_to_string(format!("/sys/devices/system/cpu/cpu0/cache/index{index}/{name}")).ok()
    };
    let told = || {
        let kibibytes: u64 = read("size")?.trim().strip_suffix('K')?.parse().ok()?;
        Some((kibibytes << 10, read("ways_of_associativity")?.trim().parse().ok()?))
    };
    told().unwrap_or(if level == 1 { (32 << 10, 8) } else { (1 << 20, 8) })
}

fn shape((bytes, ways): (u64, u64)) -> Shape {
    Shape { block: LINE, blocks: bytes / LINE, ways: Some(ways) }
}

fn misses(simulation: &Simulation, i: usize) -> String {
    let [upper, lower, strips, vertices] = simulation.misses_a_ray(i);
    let all = upper + lower + strips + vertices;
    format!("{all:.3}; lower over upper hierarchy {:.0}", lower / upper)
}

/// Renders a small picture with one thread; `None` for orders of rays that wait for pages.
fn simulated(pack: &Path, order: &str, shapes: &[Shape]) -> Result<Option<Simulation>> {
    let ordering = match order {
        "none" => Ordering::None,
        "origin" => Ordering::Origin,
        "origin-dir" => Ordering::OriginDir,
        "hph" => Ordering::Hph,
        "hph-dir" => Ordering::HphDir,
        "hph-origin" => Ordering::HphOrigin,
        _ => return Ok(None),
    };
    let traced = TracedWorld::new(Scene::open(pack)?);
    let coarse = Scene::open_proxy(pack, ProxyKind::Coarse)?;
    let proxy = coarse.map_or_else(|| Scene::open_proxy(pack, ProxyKind::Fine), |coarse| Ok(Some(coarse)))?;
    let hit_points = HitPoints::new(proxy, traced.scene().geometry_bounds(), &traced.bounds());
    let world = SimulatedWorld::new(traced, &Caches { blocks: shapes, page_shares: &[] });
    let (width, spp) = (SIMULATED_SIDE, SIMULATED_SPP);
    let params = RenderParams { width, height: width, spp, threads: 1, ..RenderParams::default() };
    if ordering == Ordering::None {
        render(&world, &params, &|_| ())?;
        return Ok(Some(world.into_simulation()));
    }
    let order = OrderParams {
        ordering,
        curve: Curve::Z,
        buffer_bytes: BUFFER_BYTES,
        scratch: None,
        hit_points: Some(&hit_points),
    };
    let watch = Watch { is_due: &|| false, progress: &|_| () };
    let finished = render_ordered(&world, &params, &order, Unfinished::new(&params), &watch)?;
    finished.is_finished().then_some(()).context("nothing asked for a pause")?;
    Ok(Some(world.into_simulation()))
}
