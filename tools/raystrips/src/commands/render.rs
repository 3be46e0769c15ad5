//! `raystrips render`.

use crate::args::{IntegratorName, RenderArgs};
use crate::files::{check_output, write_whole};
use crate::progress::render_bar;
use crate::residency::{self, Residency};
use crate::units::grouped;
use crate::{cache, camera, interrupt, process};
use anyhow::{Result, bail};
use raystrips_pack::Manifest;
use raystrips_render::{
    ImageOptions, Integrator, PagedWorld, QueueParams, RenderOutput, RenderParams, RenderProgress,
    TracedWorld, render, render_queued, write_image,
};
use raystrips_tracer::{PagePool, PoolCounts, Scene};
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Renders a picture.
pub fn run(args: &RenderArgs) -> Result<()> {
    // Said before hours of work, not after.
    if !matches!(extension(&args.output).as_deref(), Some("exr" | "png")) {
        bail!("{}: a picture's name must end in .exr or .png", args.output.display());
    }
    for output in args.stats.iter().chain([&args.output]) {
        check_output(output, &[&args.input])?;
    }
    interrupt::watch()?;
    let pack = pack_of(args)?;
    let pixels = u64::from(args.size.0) * u64::from(args.size.1);
    let threads = if args.threads == 0 { std::thread::available_parallelism()?.get() } else { args.threads };
    let residency = residency::of(
        &pack,
        args.convert.source.memory,
        args.reorder,
        (pixels, has_aovs(args)),
        threads as u64,
    )?;
    let bar = render_bar(pixels * u64::from(args.spp));
    let progress = |progress: RenderProgress| {
        if interrupt::happened() {
            bar.finish_and_clear();
            interrupt::exit();
        }
        bar.set_position(progress.samples_done);
    };
    let (params, output, pages) = match residency {
        Residency::Whole => {
            let world = TracedWorld::new(Scene::open(&pack)?);
            let params = params(args, world.scene().manifest())?;
            let output = render(&world, &params, &progress)?;
            (params, output, Pages::of_scene(world.scene()))
        }
        Residency::Queues { page_bytes, ray_bytes } => {
            let world = PagedWorld::new(PagePool::open(&pack, page_bytes)?);
            let queues = QueueParams { ray_bytes, read_bytes: world.pool().probe()? };
            let params = params(args, &world.pool().pack().manifest)?;
            let output = render_queued(&world, &params, &queues, &progress)?;
            (params, output, Pages::of_pool(world.pool()))
        }
    };
    bar.finish_and_clear();
    let options = ImageOptions { exposure: args.exposure.exp2(), ..ImageOptions::for_render(&params) };
    write_image(&args.output, &output.film, &options)?;
    if let Some(path) = &args.stats {
        write_whole(path, format!("{}\n", stats(&output, &pages)).as_bytes())?;
    }
    summarize(args, &output)
}

fn extension(path: &Path) -> Option<String> {
    path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase)
}

fn pack_of(args: &RenderArgs) -> Result<PathBuf> {
    if extension(&args.input).as_deref() == Some("rsp") {
        return Ok(args.input.clone());
    }
    cache::pack_of(&args.input, args.cache.as_deref(), &args.convert, args.threads)
}

/// PNG has no room for albedo and normal.
fn has_aovs(args: &RenderArgs) -> bool {
    extension(&args.output).as_deref() == Some("exr")
}

fn params(args: &RenderArgs, manifest: &Manifest) -> Result<RenderParams> {
    Ok(RenderParams {
        integrator: match args.integrator {
            IntegratorName::Path => Integrator::Path,
            IntegratorName::Ao => Integrator::Ao,
            IntegratorName::Normal => Integrator::Normal,
        },
        width: args.size.0,
        height: args.size.1,
        spp: args.spp,
        seed: args.seed,
        threads: args.threads,
        camera: args.camera.as_deref().map(|text| camera::parse(text, manifest)).transpose()?,
        max_bounces: args.bounces,
        aovs: has_aovs(args),
        ..RenderParams::default()
    })
}

/// What was read of the pack.
struct Pages {
    counts: PoolCounts,
    triangles: u64,
    ordering: &'static str,
}

impl Pages {
    fn of_scene(scene: &Scene) -> Pages {
        let counts = PoolCounts {
            read: scene.manifest().pages,
            bytes_read: scene.page_bytes(),
            ..PoolCounts::default()
        };
        Pages { counts, triangles: scene.manifest().triangles, ordering: "none" }
    }

    fn of_pool(pool: &PagePool) -> Pages {
        Pages { counts: pool.counts(), triangles: pool.pack().manifest.triangles, ordering: "queues" }
    }
}

fn stats(output: &RenderOutput, pages: &Pages) -> serde_json::Value {
    let stats = &output.stats;
    json!({
        "rays": {"primary": stats.primary, "shadow": stats.shadow, "secondary": stats.secondary},
        "seconds": {
            "total": stats.seconds.total,
            "generate": stats.seconds.generate,
            "approximate": 0.0,
            "sort": 0.0,
            "trace": stats.seconds.trace,
            "shade": stats.seconds.shade,
            "io_wait": stats.seconds.wait,
        },
        "pages": {
            "read": pages.counts.read,
            "bytes_read": pages.counts.bytes_read,
            "hits": pages.counts.hits,
            "evicted": pages.counts.evicted,
        },
        "peak_rss_bytes": process::peak_rss_bytes(),
        "ordering": pages.ordering,
        "triangles": pages.triangles,
        "contributions": {"clamped": output.film.clamped(), "dropped": output.film.dropped()},
    })
}

fn summarize(args: &RenderArgs, output: &RenderOutput) -> Result<()> {
    let stats = &output.stats;
    let rays = stats.primary + stats.shadow + stats.secondary;
    writeln!(
        std::io::stdout(),
        "{}: {}x{}, {} samples a pixel; {} rays in {:.1} s, {:.2} million/s",
        args.output.display(),
        args.size.0,
        args.size.1,
        args.spp,
        grouped(rays),
        stats.seconds.total,
        rays as f64 / stats.seconds.total.max(1e-9) / 1e6,
    )?;
    if output.film.dropped() > 0 {
        eprintln!("raystrips: warning: {} samples were not numbers and left out", output.film.dropped());
    }
    Ok(())
}
