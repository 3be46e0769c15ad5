//! Simplification to 2 %: triangles left, distances both ways, hit points, time and memory, beside other programs.
//!
//! Every contestant is a process that reads a file and writes one.

mod hits;
pub mod kernels;
pub mod mesh_file;

use crate::compare::programs;
use crate::flags::Flags;
use anyhow::{Context, Result};
use hits::ExactHits;
use mesh_file::Mesh;
use raystrips_geom::Aabb;
use raystrips_simplify::{Distances, measure};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// How it is called.
pub const USAGE: &str = "cargo xtask table proxy [--ratio 0.02] [--python PYTHON] [--only-ours] MODEL...";

/// Part of the triangles to keep, if no other is asked for.
const KEPT: f64 = 0.02;
/// Points on each surface whose distance is measured.
const POINTS: usize = 1_000_000;
/// What others are measured by.
const REFERENCE: &str = "meshopt";

/// A program that simplifies.
#[derive(Clone, Copy, Debug)]
enum Contestant {
    /// `raystrips proxy`, piece by piece.
    Raystrips,
    /// A kernel of `cargo xtask simplify`.
    Kernel(&'static str),
    /// The Python package.
    FastSimplification,
}

/// In the order of rows, with what they are called there.
const CONTESTANTS: [(Contestant, &str); 6] = [
    (Contestant::Raystrips, "raystrips proxy"),
    (Contestant::Kernel("ours"), "its kernel, in one piece"),
    (Contestant::Kernel(REFERENCE), "meshoptimizer, simplify"),
    (Contestant::Kernel("meshopt-update"), "meshoptimizer, simplify with update"),
    (Contestant::Kernel("meshopt-sloppy"), "meshoptimizer, sloppy"),
    (Contestant::FastSimplification, "fast-simplification"),
];

/// What was asked for.
struct Setting {
    ratio: f64,
    python: String,
    only_ours: bool,
    folder: tempfile::TempDir,
}

/// What a contestant did.
struct Outcome {
    name: &'static str,
    is_reference: bool,
    left: usize,
    distances: Distances,
    open_edges: usize,
    hits: hits::Approximation,
    seconds: f64,
    peak_bytes: f64,
    /// Pieces that it worked on, if not one.
    pieces: Option<u64>,
}

/// Prints a row for each model and contestant.
pub fn print(arguments: &[String]) -> Result<()> {
    let flags = Flags::parse(arguments, &["--ratio", "--python"], &["--only-ours"])?;
    let setting = Setting {
        ratio: flags.value("--ratio").map_or(Ok(KEPT), str::parse).context("--ratio: not a number")?,
        python: flags.value("--python").unwrap_or("python3").to_owned(),
        only_ours: flags.has("--only-ours"),
        folder: tempfile::tempdir()?,
    };
    println!(
        "| model | triangles | by | pieces | left / asked | mean % | RMS % | max % | mean / meshopt | max / meshopt | \
         open edges | hit point % | missed % | s | Mtri/s | peak MiB |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    for path in &flags.rest {
        setting.rows(Path::new(path))?;
    }
    println!(
        "\nDistances both ways in percent of the diagonal, {POINTS} points on each surface. Hit point: median distance \
         between the hits of camera rays and rays of the second bounce on model and simplified mesh. Processor time; \
         that of raystrips proxy is of all threads, with reading and writing."
    );
    Ok(())
}

impl Setting {
    fn rows(&self, path: &Path) -> Result<()> {
        // Welded and of one geometry: the same for all.
        let mesh = Mesh::read(path)?;
        let model = self.folder.path().join("model.ply");
        mesh.write(&model)?;
        let asked = (mesh.triangles.len() as f64 * self.ratio).round() as usize;
        let exact = ExactHits::of(&model, self.folder.path())?;
        let mut outcomes = Vec::new();
        for (contestant, name) in CONTESTANTS {
            let is_ours = matches!(contestant, Contestant::Raystrips | Contestant::Kernel("ours"));
            if is_ours || !self.only_ours {
                match self.outcome(contestant, name, &model, &mesh, asked, &exact) {
                    Ok(outcome) => outcomes.push(outcome),
                    Err(error) => eprintln!("{name}: {error:#}"),
                }
            }
        }
        let reference = outcomes.iter().find(|outcome| outcome.is_reference).map(|outcome| outcome.distances);
        let name = path.file_stem().unwrap_or_default().display().to_string();
        let diagonal = f64::from(Aabb::of_points(mesh.positions.iter().copied()).diagonal());
        println!("| {name} | {} | | | | | | | | | {} | | | | | |", mesh.triangles.len(), mesh.open_edges());
        for outcome in outcomes {
            outcome.print(mesh.triangles.len(), asked, diagonal, reference);
        }
        Ok(())
    }

    fn outcome(
        &self,
        contestant: Contestant,
        name: &'static str,
        model: &Path,
        mesh: &Mesh,
        asked: usize,
        exact: &ExactHits,
    ) -> Result<Outcome> {
        let output = self.folder.path().join("simplified.ply");
        let report = self.run(contestant, model, &output, asked)?;
        let simplified = Mesh::read(&output)?;
        let seconds = match contestant {
            Contestant::Raystrips => programs::number(&report["seconds"], "cpu")?,
            _ => programs::number(&report, "seconds_cpu")?,
        };
        Ok(Outcome {
            name,
            is_reference: matches!(contestant, Contestant::Kernel(REFERENCE)),
            left: simplified.triangles.len(),
            distances: measure(mesh.surface(), simplified.surface(), POINTS),
            open_edges: simplified.open_edges(),
            hits: exact.compare(&output, self.folder.path())?,
            seconds,
            peak_bytes: programs::number(&report, "peak_rss_bytes")?,
            pieces: report["input"]["pieces"].as_u64(),
        })
    }

    /// Runs a contestant; gives the JSON object that it prints.
    fn run(&self, contestant: Contestant, model: &Path, output: &Path, asked: usize) -> Result<Value> {
        let asked = asked.to_string();
        let mut command = match contestant {
            Contestant::Raystrips => {
                let mut command = Command::new(programs::raystrips()?);
                command.arg("proxy").arg(model).arg("-o").arg(output).args(["--triangles", &asked, "--json"]);
                command
            }
            Contestant::Kernel(name) => {
                let mut command = Command::new(std::env::current_exe()?);
                command.args(["simplify", name]).arg(model).arg(output).arg(&asked);
                command
            }
            Contestant::FastSimplification => {
                let mut command = Command::new(&self.python);
                command.arg(self.script()?).arg(model).arg(output).arg(&asked);
                command
            }
        };
        programs::json(&mut command)
    }

    fn script(&self) -> Result<PathBuf> {
        let path = self.folder.path().join("simplify.py");
        std::fs::write(&path, include_str!("fast_simplification.py"))?;
        Ok(path)
    }
}

impl Outcome {
    fn print(&self, triangles: usize, asked: usize, diagonal: f64, reference: Option<Distances>) {
        let percent = |distance: f64| distance / diagonal * 100.0;
        let ratio = |of: fn(&Distances) -> f64| {
            reference.map_or("-".into(), |reference| format!("{:.2}", of(&self.distances) / of(&reference)))
        };
        println!(
            "| | | {} | {} | {:.3} | {:.4} | {:.4} | {:.3} | {} | {} | {} | {:.3} | {:.2} | {:.2} | {:.2} | {:.0} |",
            self.name,
            self.pieces.unwrap_or(1),
            self.left as f64 / asked as f64,
            percent(self.distances.mean),
            percent(self.distances.rms),
            percent(self.distances.max),
            ratio(|d| d.mean),
            ratio(|d| d.max),
            self.open_edges,
            self.hits.median_percent,
            self.hits.missed * 100.0,
            self.seconds,
            triangles as f64 / self.seconds / 1e6,
            self.peak_bytes / 1048576.0,
        );
    }
}
