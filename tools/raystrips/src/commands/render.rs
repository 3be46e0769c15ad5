//! `raystrips render`.

use crate::args::{RenderArgs, ToneName};
use crate::files::{check_output, extension, write_whole};
use crate::progress::render_bar;
use crate::rendering::{self, Pages, Rendered};
use crate::unfinished::Keeping;
use crate::units::grouped;
use crate::{cache, interrupt};
use anyhow::{Result, bail};
use raystrips_extmem::peak_process_memory;
use raystrips_render::{EnvironmentFile, ImageOptions, RenderOutput, RenderProgress, write_image};
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Renders a picture.
pub fn run(args: &RenderArgs) -> Result<()> {
    // Said before hours of work, not after.
    if !matches!(extension(&args.output).as_deref(), Some("exr" | "png")) {
        bail!("{}: a picture's name must end in .exr or .png", args.output.display());
    }
    let inputs: Vec<&Path> = [&args.input].into_iter().chain(&args.env).map(PathBuf::as_path).collect();
    for output in args.stats.iter().chain([&args.output]) {
        check_output(output, &inputs)?;
    }
    let environment = args.env.as_deref().map(EnvironmentFile::open).transpose()?;
    interrupt::watch()?;
    let pack = pack_of(args)?;
    let bar = render_bar(u64::from(args.size.0) * u64::from(args.size.1) * u64::from(args.spp));
    let progress = |progress: RenderProgress| bar.set_position(progress.samples_done);
    let every = Duration::from_secs(args.keep_every);
    let keeping = Keeping::new(&args.output, every, args.convert.source.restart, &progress)?;
    let Rendered { params, output, pages } = rendering::run(&pack, args, environment.as_ref(), &keeping)?;
    bar.finish_and_clear();
    let usual = ImageOptions::for_render(&params);
    let tone_curve = args.tone.map_or(usual.tone_curve, ToneName::curve);
    let options = ImageOptions { exposure: args.exposure.exp2(), tone_curve, ..usual };
    write_image(&args.output, &output.film, &options)?;
    keeping.remove()?;
    if let Some(path) = &args.stats {
        write_whole(path, format!("{}\n", stats(&output, &pages)).as_bytes())?;
    }
    summarize(args, &output)
}

fn pack_of(args: &RenderArgs) -> Result<PathBuf> {
    if extension(&args.input).as_deref() == Some("rsp") {
        return Ok(args.input.clone());
    }
    cache::pack_of(&args.input, args.cache.as_deref(), &args.convert, args.threads)
}

fn stats(output: &RenderOutput, pages: &Pages) -> serde_json::Value {
    let stats = &output.stats;
    json!({
        "rays": {"primary": stats.primary, "shadow": stats.shadow, "secondary": stats.secondary},
        "seconds": {
            "total": stats.seconds.total,
            "generate": stats.seconds.generate,
            "approximate": stats.seconds.approximate,
            "sort": stats.seconds.sort,
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
        "peak_rss_bytes": peak_process_memory(),
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
