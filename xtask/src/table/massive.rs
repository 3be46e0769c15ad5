//! Conversion of generated scenes of any size: time, memory and scratch files, by budget.

use super::scratch_watch::ScratchWatch;
use crate::compare::programs;
use crate::flags::Flags;
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The scene that is converted with several budgets.
const MAIN: &str = "statue";
/// Its small size at any scale: times of less are those of starting a process.
const SMALL: f64 = 1e6;
/// Its large size at scale 1.
const LARGE: f64 = 1e8;
/// Budgets for the large one.
const BUDGETS: [&str; 4] = ["512M", "1G", "4G", "16G"];
/// Budget for the small one, and the one that speeds are compared at.
const USUAL: &str = "4G";
/// The others, with their sizes at scale 1: those of the papers' scenes that they stand for.
const OTHERS: [(&str, f64); 4] =
    [("atrium", 104e6), ("cornell", 128e6), ("isosurface", 10e6), ("pipes", 12.7e6)];
/// Budget for the others.
const LITTLE: &str = "1G";

pub const USAGE: &str = "cargo xtask table massive -o DIR [--scale 0.05] [--repeat 3] [--threads 2] [--scenes all|statue] \
                         [--under COMMAND]";

/// How conversions are run.
struct Setting {
    raystrips: PathBuf,
    folder: PathBuf,
    threads: u64,
    repeat: u64,
    /// A program with arguments that runs ours in a limited environment, if any.
    under: Vec<String>,
}

/// One conversion.
struct Run {
    triangles: f64,
    seconds: f64,
    peak_bytes: f64,
    scratch_bytes: f64,
    input_bytes: f64,
}

/// Prints a row for each scene and budget, then what was asked for beside what came of it.
pub fn print(arguments: &[String]) -> Result<()> {
    let options = ["-o", "--scale", "--repeat", "--threads", "--scenes", "--under"];
    let flags = Flags::parse(arguments, &options, &[])?;
    let (Some(folder), []) = (flags.value("-o"), flags.rest.as_slice()) else { bail!("usage: {USAGE}") };
    let scale: f64 = flags.value("--scale").unwrap_or("0.05").parse().context("--scale")?;
    let setting = Setting {
        raystrips: programs::raystrips()?,
        folder: std::path::absolute(folder)?,
        threads: flags.count("--threads")?.unwrap_or(2),
        repeat: flags.count("--repeat")?.unwrap_or(3).max(1),
        under: flags.value("--under").unwrap_or("").split_whitespace().map(str::to_owned).collect(),
    };
    let all_scenes = match flags.value("--scenes") {
        None | Some("all") => true,
        Some(name) if name == MAIN => false,
        Some(name) => bail!("--scenes {name}: neither all nor {MAIN}"),
    };
    println!(
        "| scene | triangles | --memory | seconds | Mtri/s | peak MiB | scratch MB | scratch/input | bytes/triangle |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    let small = setting.scene(MAIN, SMALL)?;
    let small = setting.rows(&small, USUAL)?;
    let large = setting.scene(MAIN, LARGE * scale)?;
    let runs = BUDGETS.map(|budget| setting.rows(&large, budget).map(|run| (budget, run)));
    let runs: Vec<(&str, Run)> = runs.into_iter().collect::<Result<_>>()?;
    if all_scenes {
        for (scene, triangles) in OTHERS {
            let scene = setting.scene(scene, triangles * scale)?;
            setting.rows(&scene, LITTLE)?;
        }
    }
    print_goals(&small, &runs);
    println!(
        "\n{} threads; medians of {} runs. Scratch files apart from the pack.",
        setting.threads, setting.repeat
    );
    Ok(())
}

impl Setting {
    /// The folder of a scene, made if it is not there.
    fn scene(&self, name: &str, triangles: f64) -> Result<PathBuf> {
        let folder = self.folder.join(format!("{name}-{}", triangles as u64));
        if !folder.join("scene.toml").exists() {
            let mut command = Command::new(std::env::current_exe()?);
            command.args(["scene", name, "--triangles", &(triangles as u64).to_string(), "-o"]).arg(&folder);
            programs::output(&mut command)?;
        }
        Ok(folder)
    }

    /// Converts a scene as often as asked for, prints a row and gives the run of median time.
    fn rows(&self, scene: &Path, memory: &str) -> Result<Run> {
        let runs: Result<Vec<(Run, Value)>> = (0..self.repeat).map(|_| self.convert(scene, memory)).collect();
        let mut runs = runs?;
        runs.sort_by(|a, b| a.0.seconds.total_cmp(&b.0.seconds));
        let (run, report) = runs.swap_remove(runs.len() / 2);
        println!(
            "| {} | {} | {memory} | {:.1} | {:.2} | {:.0} | {:.0} | {:.2} | {:.2} |",
            scene.file_name().unwrap_or_default().display(),
            run.triangles,
            run.seconds,
            run.triangles / run.seconds / 1e6,
            run.peak_bytes / 1048576.0,
            run.scratch_bytes / 1e6,
            run.scratch_bytes / run.input_bytes,
            programs::number(&report, "bytes_per_triangle")?,
        );
        Ok(run)
    }

    fn convert(&self, scene: &Path, memory: &str) -> Result<(Run, Value)> {
        let pack = self.folder.join("massive.rsp");
        let threads = self.threads.to_string();
        let mut line = self.under.clone();
        line.push(self.raystrips.display().to_string());
        let mut command = Command::new(&line[0]);
        command.args(&line[1..]).arg("convert").arg(scene.join("scene.toml")).arg("-o").arg(&pack);
        command.args(["--memory", memory, "--threads", &threads, "--restart", "--no-proxy", "--json"]);
        let watch = ScratchWatch::start(&pack);
        let report = programs::json(&mut command)?;
        let scratch_bytes = watch.most_bytes() as f64;
        std::fs::remove_file(&pack)?;
        let run = Run {
            triangles: programs::number(&report, "triangles")?,
            seconds: programs::number(&report["seconds"], "total")?,
            peak_bytes: programs::number(&report, "peak_rss_bytes")?,
            scratch_bytes,
            input_bytes: model_bytes(scene)? as f64,
        };
        Ok((run, report))
    }
}

/// Bytes of the models of a scene.
fn model_bytes(scene: &Path) -> Result<u64> {
    let mut bytes = 0;
    for file in std::fs::read_dir(scene)? {
        let file = file?;
        if file.path().extension().is_some_and(|ending| ending == "ply") {
            bytes += file.metadata()?.len();
        }
    }
    Ok(bytes)
}

fn print_goals(small: &Run, large: &[(&str, Run)]) {
    let at = |memory: &str| large.iter().find(|(m, _)| *m == memory).map(|(_, run)| run);
    let (Some(least), Some(little), Some(usual), Some(most)) = (at("512M"), at("1G"), at(USUAL), at("16G"))
    else {
        return;
    };
    let over = large.iter().filter(|(memory, run)| run.peak_bytes > budget_bytes(memory)).count();
    let per_triangle = |run: &Run| run.seconds / run.triangles;
    println!("\n| | at least | aim | here |\n|---|---:|---:|---:|");
    println!(
        "| peak memory with 1G and 512M, MiB | 1024 | 512 | {:.0}, {:.0} |",
        little.peak_bytes / 1048576.0,
        least.peak_bytes / 1048576.0
    );
    println!(
        "| million triangles a second with {USUAL} | 1 | 3 | {:.2} |",
        usual.triangles / usual.seconds / 1e6
    );
    println!(
        "| time a triangle, {} against {} triangles | 1.3 | 1.1 | {:.2} |",
        usual.triangles,
        small.triangles,
        per_triangle(usual) / per_triangle(small)
    );
    println!("| time with 1G against 16G | 1.5 | 1.2 | {:.2} |", little.seconds / most.seconds);
    println!(
        "| scratch files against the models | 3 | 1.5 | {:.2} |",
        little.scratch_bytes / little.input_bytes
    );
    println!("| conversions above their budget | 0 | 0 | {over} |");
}

fn budget_bytes(text: &str) -> f64 {
    let (number, unit) = text.split_at(text.len() - 1);
    number.parse::<f64>().unwrap_or(0.0) * if unit == "G" { 1073741824.0 } else { 1048576.0 }
}
