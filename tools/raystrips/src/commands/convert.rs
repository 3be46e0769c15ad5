//! `raystrips convert`.

use super::info::{describe, shown};
use super::print_json;
use crate::args::{ConvertArgs, ConvertOptions};
use crate::files::check_output;
use crate::interrupt;
use crate::progress::ConvertProgress;
use crate::units::{bytes, grouped};
use anyhow::{Context, Result};
use raystrips_convert::{ConvertParams, ConvertReport, ImportOptions, StripParams, convert};
use raystrips_extmem::peak_process_memory;
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Converts models or a scene to a pack.
pub fn run(args: &ConvertArgs) -> Result<()> {
    let inputs: Vec<&Path> = args.inputs.iter().map(PathBuf::as_path).collect();
    check_output(&args.output, &inputs)?;
    interrupt::watch()?;
    let report = convert_with(&args.inputs, &args.output, &args.options, args.threads)?;
    if args.json {
        let mut value = describe(&report.manifest, report.file_bytes, &report.proxies);
        value["seconds"] = seconds(&report);
        value["peak_rss_bytes"] = peak_process_memory().into();
        return print_json(&value);
    }
    let manifest = &report.manifest;
    let total: f64 = report.seconds.iter().map(|(_, s)| s).sum();
    let mut parts = Vec::new();
    if manifest.triangles() > 0 {
        let (count, each) = (grouped(manifest.triangles()), manifest.bytes_per_triangle());
        parts.push(format!("{count} triangles of {each:.2} bytes"));
    }
    if manifest.instances > 0 {
        parts.push(shown(manifest));
    }
    if manifest.segments > 0 {
        let (count, each) = (grouped(manifest.segments), manifest.bytes_per_segment());
        parts.push(format!("{count} segments of strands of {each:.2} bytes"));
    }
    writeln!(
        std::io::stdout(),
        "{}: {}; {}; {total:.1} s, {} a second",
        args.output.display(),
        parts.join(", "),
        bytes(report.file_bytes),
        grouped((manifest.primitives as f64 / total.max(1e-9)) as u64),
    )?;
    Ok(())
}

/// Converts with progress, and tells warnings and repairs on standard error.
pub fn convert_with(
    inputs: &[PathBuf],
    output: &Path,
    options: &ConvertOptions,
    threads: usize,
) -> Result<ConvertReport> {
    let source = options.source.params();
    let import = ImportOptions { instances: !options.no_instances, ..source.import.clone() };
    let params = ConvertParams {
        import,
        page_size: options.page_size,
        layout: options.layout.layout(),
        strips: StripParams { max_windows: usize::from(options.strip_windows) },
        positions: options.positions,
        keep_ids: options.keep_ids,
        proxies: options.proxies(),
        ..source
    };
    let progress = ConvertProgress::new(options.source.memory.is_some());
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().context("cannot start threads")?;
    let result = pool.install(|| convert(inputs, output, &params, &progress));
    progress.finish();
    let report = result?;
    tell(&notes(&report));
    Ok(report)
}

/// What to tell of warnings and repairs, a line for each.
pub fn notes(report: &ConvertReport) -> Vec<String> {
    let mut notes: Vec<String> =
        report.warnings.iter().map(|warning| format!("warning: {warning}")).collect();
    let dropped = &report.manifest.dropped;
    if *dropped != Default::default() {
        notes.push(format!(
            "left out triangles and segments: {} without area, {} not finite, {} out of range",
            grouped(dropped.degenerate),
            grouped(dropped.non_finite),
            grouped(dropped.out_of_range)
        ));
    }
    notes
}

/// Tells notes on standard error.
pub fn tell(notes: &[String]) {
    notes.iter().for_each(|note| eprintln!("raystrips: {note}"));
}

fn seconds(report: &ConvertReport) -> serde_json::Value {
    let mut value = json!({"total": report.seconds.iter().map(|(_, s)| s).sum::<f64>()});
    for (stage, seconds) in &report.seconds {
        value[stage.name()] = (*seconds).into();
    }
    value
}
