//! `cargo xtask table hair SCENE...`: bytes of a segment of hair, how fast strands are converted, and how fast rays are.

use crate::compare::programs;
use anyhow::Result;
use std::path::Path;
use std::process::Command;

/// How positions are kept.
const POSITIONS: [&str; 4] = ["exact", "grid:22", "grid:20", "grid:16"];
/// The paper's bytes of a segment, cylinders and hierarchy together (Moon et al. 2010, section 7).
const PAPER_BYTES: f64 = 32.0;
const MEMORY: &str = "1G";

/// Prints a table for each scene or model of hair.
pub fn print(inputs: &[String]) -> Result<()> {
    let raystrips = programs::raystrips()?;
    println!(
        "| scene | positions | segments | bytes/segment | paper | vertices | records | nodes | position error | \
         strands of 8 segments a second | peak MiB | rays/s |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    for input in inputs {
        for positions in POSITIONS {
            row(&raystrips, Path::new(input), positions)?;
        }
    }
    Ok(())
}

fn row(raystrips: &Path, input: &Path, positions: &str) -> Result<()> {
    let folder = tempfile::tempdir_in(input.parent().unwrap_or(Path::new(".")))?;
    let (pack, stats) = (folder.path().join("hair.rsp"), folder.path().join("stats.json"));
    let mut convert = Command::new(raystrips);
    convert.arg("convert").arg(input).arg("-o").arg(&pack);
    convert.args(["--positions", positions, "--no-proxy", "--memory", MEMORY, "--threads", "2", "--json"]);
    let made = programs::json(&mut convert)?;
    let number = programs::number;
    let segments = number(&made, "segments")?;
    let each = |name: &str| Ok::<f64, anyhow::Error>(number(&made["strand_bytes"], name)? / segments);
    let mut render = Command::new(raystrips);
    render.arg("render").arg(&pack).arg("-o").arg(folder.path().join("picture.png"));
    render.args(["--size", "480x420", "--spp", "4", "--threads", "2", "--stats"]).arg(&stats);
    programs::output(&mut render)?;
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(&stats)?)?;
    let rays = ["primary", "shadow", "secondary"].map(|kind| number(&stats["rays"], kind));
    let rays = rays.into_iter().sum::<Result<f64>>()?;
    println!(
        "| {} | {positions} | {segments} | {:.2} | {PAPER_BYTES} | {:.2} | {:.2} | {:.2} | {:.1e} | {:.0} | {:.0} | {:.2}M |",
        input.display(),
        number(&made, "bytes_per_segment")?,
        each("vertices")?,
        each("indices")?,
        each("nodes")?,
        number(&made, "position_error")?,
        segments / 8.0 / number(&made["seconds"], "total")?,
        number(&made, "peak_rss_bytes")? / 1048576.0,
        rays / number(&stats["seconds"], "total")? / 1e6,
    );
    Ok(())
}
