//! `raystrips render` in a control group: so much memory, page cache included, and a disk of so many bytes and reads a
//! second, with nothing of the pack in memory at the beginning.

use crate::compare::programs;
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What a disk is limited to.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    pub name: &'static str,
    options: &'static [&'static str],
}

/// The disks that tables can ask for.
pub const DISKS: [Disk; 4] = [
    // That of Moon et al. 2010, with the seeks of a disk of 7200 turns a minute.
    Disk { name: "hdd", options: &["--read-bps", "101M", "--read-iops", "120"] },
    Disk { name: "slow", options: &["--read-bps", "101M"] },
    Disk { name: "ssd", options: &["--read-bps", "500M", "--read-iops", "90000"] },
    Disk { name: "as-is", options: &[] },
];

/// How pictures are rendered.
pub struct Limited {
    pub raystrips: PathBuf,
    /// The script that sets limits.
    pub limits: PathBuf,
    pub size: (u64, u64),
    pub spp: u64,
    pub threads: u64,
    /// Of `raystrips render`, before those of a picture.
    pub options: Vec<String>,
    /// A picture that would take longer is made smaller. Infinite: the whole picture alone.
    pub most_seconds: f64,
}

/// One picture.
#[derive(Clone, Debug)]
pub struct Measured {
    pub rays: f64,
    pub seconds: f64,
    /// Of all threads, for finding hit points and for sorting.
    pub overhead_seconds: f64,
    pub wait_seconds: f64,
    pub pages_read: f64,
    /// What the disk gave, and in how many operations.
    pub disk_bytes: f64,
    pub disk_reads: f64,
    /// Most memory of the process, and of the group: with the page cache.
    pub peak_bytes: f64,
    pub group_peak_bytes: f64,
}

impl Measured {
    pub fn rate(&self) -> f64 {
        self.rays / self.seconds / 1e6
    }

    /// Some number for each million rays.
    pub fn per_million(&self, number: f64) -> f64 {
        number / self.rays * 1e6
    }
}

impl Limited {
    /// Renders `pack` with `options`, with `memory` bytes in all if that is limited, as large as the time allows.
    pub fn render(&self, pack: &Path, options: &[&str], limits: (Option<u64>, &Disk)) -> Result<Measured> {
        let mut pictures = self.pictures(pack, options, limits)?;
        pictures.pop().context("one picture is always rendered")
    }

    /// Begins with a small picture and makes it larger while that stays within the time; gives all of them.
    pub fn pictures(
        &self,
        pack: &Path,
        options: &[&str],
        (memory, disk): (Option<u64>, &Disk),
    ) -> Result<Vec<Measured>> {
        let steps = self.steps();
        let paths = |(divisor, spp): (u64, u64)| spp as f64 / (divisor * divisor) as f64;
        let mut measured = self.render_once(pack, options, (memory, disk), steps[0])?;
        let mut pictures = Vec::new();
        for step in steps.windows(2) {
            let seconds = measured.seconds * paths(step[1]) / paths(step[0]);
            pictures.push(measured);
            // What is in memory at the beginning weighs less in a larger picture.
            if seconds > self.most_seconds {
                return Ok(pictures);
            }
            measured = self.render_once(pack, options, (memory, disk), step[1])?;
        }
        pictures.push(measured);
        Ok(pictures)
    }

    /// What the size is divided by and the samples of each picture: each has some four times as many paths as the one
    /// before.
    fn steps(&self) -> Vec<(u64, u64)> {
        if self.most_seconds.is_infinite() {
            return vec![(1, self.spp)];
        }
        let whole = std::iter::successors(Some(4), |spp| Some(spp * 4)).take_while(|&spp| spp < self.spp);
        let smaller = [(16, 1), (8, 1), (4, 1), (2, 1), (1, 1)].into_iter();
        let mut steps: Vec<(u64, u64)> = smaller.chain(whole.map(|spp| (1, spp))).collect();
        if self.spp > 1 {
            steps.push((1, self.spp));
        }
        steps
    }

    /// Renders the whole picture, however long that takes.
    pub fn whole(&self, pack: &Path, options: &[&str], limits: (Option<u64>, &Disk)) -> Result<Measured> {
        self.render_once(pack, options, limits, (1, self.spp))
    }

    fn render_once(
        &self,
        pack: &Path,
        options: &[&str],
        (memory, disk): (Option<u64>, &Disk),
        (divisor, spp): (u64, u64),
    ) -> Result<Measured> {
        let folder = tempfile::tempdir()?;
        let (stats, report) = (folder.path().join("stats.json"), folder.path().join("report.json"));
        let mut command = Command::new(&self.limits);
        if let Some(memory) = memory {
            command.args(["--memory", &memory.to_string()]);
        }
        command.args(disk.options).arg("--drop").arg(pack).arg("--quiet").arg("--json").arg(&report);
        command.arg("--").arg(&self.raystrips).arg("render").arg(pack);
        command.arg("-o").arg(folder.path().join("picture.png")).arg("--stats").arg(&stats);
        let (width, height) = ((self.size.0 / divisor).max(1), (self.size.1 / divisor).max(1));
        command.args(["--size", &format!("{width}x{height}"), "--spp", &spp.to_string()]);
        command.args(["--threads", &self.threads.to_string()]).args(&self.options).args(options);
        if let Some(memory) = memory {
            command.args(["--memory", &memory.to_string()]);
        }
        let outcome = command.stdout(Stdio::null()).stderr(Stdio::piped()).output();
        let outcome = outcome.with_context(|| self.limits.display().to_string())?;
        if !outcome.status.success() {
            bail!("{command:?}: {}: {}", outcome.status, String::from_utf8_lossy(&outcome.stderr).trim());
        }
        let read = |path: &Path| -> Result<Value> { Ok(serde_json::from_slice(&std::fs::read(path)?)?) };
        measured(&read(&stats)?, &read(&report)?)
    }
}

fn measured(stats: &Value, report: &Value) -> Result<Measured> {
    let number = programs::number;
    let seconds = |name: &str| number(&stats["seconds"], name);
    let rays = |name: &str| number(&stats["rays"], name);
    Ok(Measured {
        rays: rays("primary")? + rays("shadow")? + rays("secondary")?,
        seconds: seconds("total")?,
        overhead_seconds: seconds("approximate")? + seconds("sort")?,
        wait_seconds: seconds("io_wait")?,
        pages_read: number(&stats["pages"], "read")?,
        disk_bytes: number(report, "read_bytes")?,
        disk_reads: number(report, "read_ops")?,
        peak_bytes: number(stats, "peak_rss_bytes")?,
        group_peak_bytes: number(report, "mem_peak")?,
    })
}
