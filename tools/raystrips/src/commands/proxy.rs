//! `raystrips proxy`.

use super::print_json;
use crate::args::{MethodName, ProxyArgs};
use crate::files::{check_output, write_through};
use crate::progress::ConvertProgress;
use crate::units::grouped;
use crate::{interrupt, process};
use anyhow::{Context, Result, bail};
use raystrips_convert::{Proxy, ProxyParams, ProxySize, SimplifyMethod, proxy};
use raystrips_extmem::peak_process_memory;
use raystrips_meshio::{ExportFormat, ExportMesh, export};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Points on each surface at which distances are measured.
const MEASURED_POINTS: usize = 1_000_000;

/// Simplifies models or a scene to a mesh of fewer triangles.
pub fn run(args: &ProxyArgs) -> Result<()> {
    let inputs: Vec<&Path> = args.inputs.iter().map(PathBuf::as_path).collect();
    check_output(&args.output, &inputs)?;
    let Some(format) = ExportFormat::of(&args.output) else {
        bail!(
            "{}: is of no format that can be written; name it .ply, .obj, .glb or .hair",
            args.output.display()
        );
    };
    interrupt::watch()?;
    let begin = Instant::now();
    let params = ProxyParams {
        size: args.triangles.map_or(ProxySize::Ratio(args.ratio), ProxySize::Triangles),
        method: match args.method {
            MethodName::Auto => SimplifyMethod::Auto,
            MethodName::Quadric => SimplifyMethod::Quadric,
            MethodName::Stochastic => SimplifyMethod::Stochastic,
        },
        convert: args.source.params(),
        measured_points: if args.measure { MEASURED_POINTS } else { 0 },
    };
    let progress = ConvertProgress::new(args.source.memory.is_some());
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(args.threads).build().context("cannot start threads")?;
    let result = pool.install(|| proxy(&args.inputs, &args.output, &params, &progress));
    progress.finish();
    let made = result?;
    check_kinds(args, format, &made)?;
    made.warnings.iter().for_each(|warning| eprintln!("raystrips: warning: {warning}"));
    let mesh = ExportMesh {
        positions: &made.positions,
        triangles: &made.triangles,
        geometries: &made.geometries,
        strands: &made.strands,
        offset: made.offset,
        scene: &made.scene,
    };
    write_through(&args.output, |out| export(&mesh, format, out))?;
    report(args, &made, begin.elapsed().as_secs_f64())
}

/// Refuses formats that cannot hold what there is.
fn check_kinds(args: &ProxyArgs, format: ExportFormat, made: &Proxy) -> Result<()> {
    let output = args.output.display();
    if !made.strands.is_empty() && !format.has_strands() {
        bail!("{output}: cannot hold strands; name it .obj, or .hair where there are only strands");
    }
    if !made.triangles.is_empty() && !format.has_triangles() {
        bail!("{output}: cannot hold triangles; name it .obj, .ply or .glb");
    }
    Ok(())
}

fn report(args: &ProxyArgs, made: &Proxy, seconds: f64) -> Result<()> {
    let percent = |distance: f64| 100.0 * distance / made.diagonal;
    let segments: usize = made.strands.iter().map(|(_, points)| points.len() - 1).sum();
    if args.json {
        let distances = made.distances.map(|d| {
            json!({"mean": d.mean, "rms": d.rms, "max": d.max,
                "percent": {"mean": percent(d.mean), "rms": percent(d.rms), "max": percent(d.max)}})
        });
        return print_json(&json!({
            "triangles": made.triangles.len(),
            "vertices": made.positions.len(),
            "strands": made.strands.len(),
            "segments": segments,
            "input": {
                "triangles": made.input_triangles,
                "segments": made.input_segments,
                "pieces": made.pieces,
            },
            "distance": distances.unwrap_or(Value::Null),
            "seconds": {"total": seconds, "cpu": process::cpu_time().as_secs_f64()},
            "peak_rss_bytes": peak_process_memory(),
        }));
    }
    let distances = made.distances.map_or(String::new(), |d| {
        let [mean, rms, max] = [d.mean, d.rms, d.max].map(percent);
        format!("; distance mean {mean:.4} %, rms {rms:.4} %, max {max:.3} % of the diagonal")
    });
    writeln!(
        std::io::stdout(),
        "{}: {} of {} triangles, {} of {} segments of strands{distances}; {seconds:.1} s",
        args.output.display(),
        grouped(made.triangles.len() as u64),
        grouped(made.input_triangles),
        grouped(segments as u64),
        grouped(made.input_segments),
    )?;
    Ok(())
}
