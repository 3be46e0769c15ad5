//! `cargo xtask compare embree MODEL.ply...`: ours beside Embree, in one run, on the same rays; and
//! `cargo xtask compare mitsuba`: our pictures beside those of Mitsuba.

mod contestant;
mod hits;
mod mitsuba;
pub mod programs;
mod progress;
mod report;
mod rounds;

use crate::flags::Flags;
use crate::rays::in_blocks;
use anyhow::{Context, Result, bail};
use contestant::{ALL, BLOCK, BLOCKS_FILE, Contestant, Files};
use programs::Programs;
use raystrips_convert::{ConvertParams, Unobserved, convert};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

const USAGE: &str = "usage: cargo run --release -p xtask -- compare embree [--peers DIR] [--threads 1,2] \
                     [--repeat ROUNDS] MODEL.ply...";
/// Rounds, if not told otherwise.
const ROUNDS: u64 = 5;

/// Prints a table for each model and number of threads.
pub fn task(root: &Path, arguments: &[String]) -> Result<ExitCode> {
    if let Some(arguments) = arguments.strip_prefix(&["mitsuba".to_owned()]) {
        return mitsuba::task(root, arguments);
    }
    let flags = Flags::parse(arguments, &["--peers", "--threads", "--repeat"], &[])?;
    let models = match flags.rest.split_first() {
        Some((name, models)) if name == "embree" && !models.is_empty() => models,
        _ => bail!(USAGE),
    };
    if let Some(other) = models.iter().find(|model| !model.ends_with(".ply")) {
        bail!("{other}: Embree's program reads binary .ply alone; unpack or convert it to that");
    }
    let threads = thread_counts(flags.value("--threads").unwrap_or("1"))?;
    let rounds = flags.count("--repeat")?.unwrap_or(ROUNDS).max(1) as usize;
    let programs = Programs::find(flags.value("--peers"))?;
    models.iter().try_for_each(|model| compare(&programs, Path::new(model), &threads, rounds))?;
    println!(
        "Million rays a second, of the mean processor time of a thread: medians of {rounds} round(s). Ratios: medians \
         of those within a round, then their geometric mean over the kinds of rays."
    );
    Ok(ExitCode::SUCCESS)
}

fn thread_counts(text: &str) -> Result<Vec<u32>> {
    let count = |text: &str| text.parse().ok().filter(|&count| count > 0);
    let counts: Option<Vec<u32>> = text.split(',').map(count).collect();
    counts.with_context(|| format!("--threads {text}: not numbers of threads like 1,2"))
}

fn compare(programs: &Programs, model: &Path, threads: &[u32], rounds: usize) -> Result<()> {
    let scratch = tempfile::tempdir()?;
    let (files, triangles, bytes_per_triangle) = prepare(programs, model, scratch.path())?;
    let name = model.file_stem().unwrap_or_default().display();
    for &threads in threads {
        let mut speeds = rounds::measure(programs, &files, threads, rounds)?;
        for (row, _) in ALL.iter().enumerate().filter(|(_, c)| !matches!(c, Contestant::Embree(_))) {
            speeds.bytes_per_triangle[row] = Some(bytes_per_triangle);
        }
        let plural = if threads == 1 { "" } else { "s" };
        println!("### {name}: {triangles} triangles, {threads} thread{plural}\n\n{}", report::table(&speeds));
    }
    println!("{}\n", report::sentence(&hits::compare(programs, &files, scratch.path())?));
    Ok(())
}

/// Makes the pack and the ray files of a model; tells its triangles and our bytes a triangle.
fn prepare(programs: &Programs, model: &Path, scratch: &Path) -> Result<(Files, u64, f64)> {
    let files = Files { model: model.to_owned(), pack: scratch.join("model.rsp"), rays: scratch.to_owned() };
    let inputs = [PathBuf::from(model)];
    let report = convert(
        &inputs,
        &files.pack,
        &ConvertParams { proxies: None, ..ConvertParams::default() },
        &Unobserved,
    )?;
    programs::output(Command::new(&programs.make_rays).arg(model).arg(scratch))?;
    write_blocks(scratch)?;
    Ok((files, report.manifest.triangles(), report.manifest.bytes_per_triangle()))
}

/// Writes the camera rays, those of a square picture, once more in the order of blocks.
fn write_blocks(scratch: &Path) -> Result<()> {
    let bytes = std::fs::read(scratch.join("primary.rays"))?;
    let rays: Vec<[u8; 32]> = bytes.as_chunks().0.to_vec();
    let blocks = in_blocks(&rays, rays.len().isqrt(), BLOCK);
    Ok(std::fs::write(scratch.join(BLOCKS_FILE), blocks.as_flattened())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_arguments_are_told() {
        let run = |line: &str| {
            let arguments: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
            task(Path::new(""), &arguments).unwrap_err().to_string()
        };
        assert!(run("embree").starts_with("usage"));
        assert!(run("embree a.ply.gz").contains("unpack"));
        assert!(run("embree --threads 1,x a.ply").contains("1,x"));
        assert_eq!(thread_counts("1,2").unwrap(), [1, 2]);
    }
}
