//! Layouts of packs beside each other: what caches of all sizes miss while a picture is path traced, and what comes of it.

mod misses;

use super::limited::{DISKS, Disk, Limited, Measured};
use super::plot;
use crate::compare::programs;
use crate::flags::Flags;
use anyhow::{Context, Result, bail};
use misses::Misses;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// How it is called.
pub const USAGE: &str = "cargo xtask table layout -o DIR [--limits with_limits.sh] [--disk hdd|slow|ssd|as-is] [--repeat 3] \
     [--side 192] [--spp 4] [--plot OUT.svg] MODEL...";

/// Names of layouts. All are compared with the first.
const LAYOUTS: [&str; 7] =
    ["depth-first", "breadth-first", "van-emde-boas", "cache-oblivious", "morton", "hilbert", "random"];

/// The part of the pack that may be in memory where it is rendered out of core, in percent.
const COLD_PERCENT: u64 = 25;
/// Size of that picture, of one sample, and of the one in core.
const COLD_SIZE: (u64, u64) = (80, 60);
const IN_CORE_SIZE: (u64, u64) = (512, 384);
const THREADS: u64 = 2;

/// What was asked for.
struct Setting {
    raystrips: PathBuf,
    limits: PathBuf,
    disk: &'static Disk,
    folder: PathBuf,
    repeat: u64,
    /// Of the picture for which caches are simulated.
    side: u32,
    spp: u32,
}

/// One layout of a model.
struct Row {
    layout: &'static str,
    pack: PathBuf,
    /// Of conversions and of rendering in core: medians.
    convert_seconds: f64,
    rate: f64,
    misses: Misses,
    cold: Option<Measured>,
}

/// Prints for each model a row for each layout.
pub fn print(arguments: &[String]) -> Result<()> {
    let options = ["-o", "--limits", "--disk", "--repeat", "--side", "--spp", "--plot"];
    let flags = Flags::parse(arguments, &options, &[])?;
    let Some(folder) = flags.value("-o").filter(|_| !flags.rest.is_empty()) else { bail!("usage: {USAGE}") };
    let disk = flags.value("--disk").unwrap_or("ssd");
    let setting = Setting {
        raystrips: programs::raystrips()?,
        limits: std::path::absolute(flags.value("--limits").unwrap_or("../shared/tools/with_limits.sh"))?,
        disk: DISKS.iter().find(|d| d.name == disk).context("--disk: none of hdd, slow, ssd, as-is")?,
        folder: std::path::absolute(folder)?,
        repeat: flags.count("--repeat")?.unwrap_or(3).max(1),
        side: flags.count("--side")?.unwrap_or(192) as u32,
        spp: flags.count("--spp")?.unwrap_or(4) as u32,
    };
    println!(
        "Misses a ray of caches that hold {} of the pack, {}x{}, {} samples, tiles as they come. *Pages*: brought into a pool that holds 25 %. *Distance*: the mean of log2 of \
         the bytes between reads that follow each other. *Out of core*: {COLD_PERCENT} % of the pack for all that the process \
         holds, rays as they come, {}x{}, disk {}. {THREADS} threads, medians of {}.",
        misses::SHARES.map(|share| format!("{:.0} %", 100.0 * share)).join(", "),
        setting.side,
        setting.side,
        setting.spp,
        COLD_SIZE.0,
        COLD_SIZE.1,
        setting.disk.name,
        setting.repeat
    );
    let mut lines = Vec::new();
    for model in &flags.rest {
        let rows = setting.rows(Path::new(model))?;
        print_rows(model, &rows);
        lines.extend(rows.iter().map(|row| (row.layout.to_owned(), row.misses.by_block())));
    }
    if let Some(path) = flags.value("--plot") {
        let lines = &lines[..LAYOUTS.len()];
        let svg = plot::lines("bytes of a block", "misses a ray, cache of 6 % of the pack", lines);
        crate::output::write_whole(Path::new(path), svg.as_bytes())?;
    }
    Ok(())
}

impl Setting {
    /// Makes all packs of a model and measures them by turns.
    fn rows(&self, model: &Path) -> Result<Vec<Row>> {
        let name = match model.file_name().is_some_and(|name| name == "scene.toml") {
            true => model.parent().and_then(Path::file_name),
            false => model.file_stem(),
        };
        let name = name.unwrap_or_default().to_string_lossy();
        let packs = LAYOUTS.map(|layout| self.folder.join(format!("{name}-{layout}.rsp")));
        let by_turns = |measure: &dyn Fn(usize) -> Result<f64>| -> Result<Vec<f64>> {
            let mut figures = vec![Vec::new(); LAYOUTS.len()];
            for _ in 0..self.repeat {
                for (i, figures) in figures.iter_mut().enumerate() {
                    figures.push(measure(i)?);
                }
            }
            Ok(figures.into_iter().map(median).collect())
        };
        let seconds = by_turns(&|i| self.convert(model, LAYOUTS[i], &packs[i]))?;
        let rates = by_turns(&|i| {
            Ok(self
                .limited(IN_CORE_SIZE, 4)
                .whole(&packs[i], &["--reorder", "none"], (None, &DISKS[3]))?
                .rate())
        })?;
        let rows = LAYOUTS.iter().zip(packs).zip(seconds.into_iter().zip(rates));
        let row = |((&layout, pack), (convert_seconds, rate)): ((&&'static str, PathBuf), (f64, f64))| {
            let misses = Misses::of(&pack, self.side, self.spp)?;
            Ok(Row { layout, cold: self.cold(&pack)?, pack, convert_seconds, rate, misses })
        };
        rows.map(row).collect()
    }

    /// Converts a model and tells how long that took.
    fn convert(&self, model: &Path, layout: &str, pack: &Path) -> Result<f64> {
        let mut command = Command::new(&self.raystrips);
        command.arg("convert").arg(model).arg("-o").arg(pack).args([
            "--layout",
            layout,
            "--no-proxy",
            "--restart",
        ]);
        let begin = Instant::now();
        programs::output(command.args(["--threads", &THREADS.to_string()]))?;
        Ok(begin.elapsed().as_secs_f64())
    }

    fn limited(&self, size: (u64, u64), spp: u64) -> Limited {
        Limited {
            options: Vec::new(),
            raystrips: self.raystrips.clone(),
            limits: self.limits.clone(),
            size,
            spp,
            threads: THREADS,
            most_seconds: f64::INFINITY,
        }
    }

    /// Renders with a part of the pack in memory; nothing where that is too little for the program itself.
    fn cold(&self, pack: &Path) -> Result<Option<Measured>> {
        let memory = std::fs::metadata(pack)?.len() * COLD_PERCENT / 100;
        match self.limited(COLD_SIZE, 1).whole(pack, &["--reorder", "none"], (Some(memory), self.disk)) {
            Err(error) if error.to_string().contains("too little") => Ok(None),
            measured => measured.map(Some),
        }
    }
}

fn median(mut figures: Vec<f64>) -> f64 {
    figures.sort_by(f64::total_cmp);
    figures[figures.len() / 2]
}

fn print_rows(model: &str, rows: &[Row]) {
    let blocks = misses::BLOCKS.map(|(_, name)| name).join(" | ");
    println!("\n{model}\n");
    println!(
        "| layout | {blocks} | pages a ray | distance | page switches a ray | converted, s | in core, Mrays/s | out of core, s | pages read |"
    );
    println!("|---|{}", "---:|".repeat(misses::BLOCKS.len() + 7));
    for row in rows {
        let (seconds, pages) = match &row.cold {
            Some(cold) => (format!("{:.1}", cold.seconds), format!("{:.0}", cold.pages_read)),
            None => Default::default(),
        };
        println!(
            "| {} | {} | {:.3} | {:.2} | {:.2} | {:.1} | {:.3} | {seconds} | {pages} |",
            row.layout,
            row.misses.cells().join(" | "),
            row.misses.pages_a_ray(),
            row.misses.mean_log_distance(),
            row.misses.page_switches_a_ray(),
            row.convert_seconds,
            row.rate
        );
    }
    if let [first, ..] = rows {
        println!(
            "\n| {} | cache | upper | lower | strips | vertices |\n|---|---|---:|---:|---:|---:|",
            first.pack.display()
        );
        first.misses.print_parts();
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn models_are_needed() {
        assert!(super::print(&[]).unwrap_err().to_string().contains("MODEL..."));
    }
}
