//! `raystrips render`.

use crate::args::{IntegratorName, RenderArgs};
use crate::files::{check_output, write_whole};
use crate::progress::render_bar;
use crate::units::grouped;
use crate::{cache, camera, interrupt, process};
use anyhow::{Result, bail};
use raystrips_render::{
    ImageOptions, Integrator, RenderOutput, RenderParams, TracedWorld, render, write_image,
};
use raystrips_tracer::Scene;
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
    let world = TracedWorld::new(Scene::open(&pack_of(args)?)?);
    let params = params(args, &world)?;
    let samples = u64::from(params.width) * u64::from(params.height) * u64::from(params.spp);
    let bar = render_bar(samples);
    let output = render(&world, &params, &|progress| {
        if interrupt::happened() {
            bar.finish_and_clear();
            interrupt::exit();
        }
        bar.set_position(progress.samples_done);
    })?;
    bar.finish_and_clear();
    let options = ImageOptions { exposure: args.exposure.exp2(), ..ImageOptions::for_render(&params) };
    write_image(&args.output, &output.film, &options)?;
    if let Some(path) = &args.stats {
        write_whole(path, format!("{}\n", stats(&output, &world)).as_bytes())?;
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

fn params(args: &RenderArgs, world: &TracedWorld) -> Result<RenderParams> {
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
        camera: args
            .camera
            .as_deref()
            .map(|text| camera::parse(text, world.scene().manifest()))
            .transpose()?,
        max_bounces: args.bounces,
        ..RenderParams::default()
    })
}

fn stats(output: &RenderOutput, world: &TracedWorld) -> serde_json::Value {
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
            "io_wait": 0.0,
        },
        "pages": {"read": world.scene().manifest().pages, "bytes_read": world.scene().page_bytes(), "hits": 0, "evicted": 0},
        "peak_rss_bytes": process::peak_rss_bytes(),
        "ordering": "none",
        "triangles": world.scene().manifest().triangles,
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
