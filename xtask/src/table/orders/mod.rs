//! Orders of rays under limits of memory and disk, beside the paper's figures (Moon, Byun, Kim, Claudio, Kim, Ban, Nam,
//! Yoon 2010, section 7).

mod multi_bvh;
mod small;

use crate::compare::programs;
use crate::flags::Flags;
use crate::table::limited::{DISKS, Disk, Limited, Measured};
use crate::table::plot;
use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use std::process::Command;

/// How it is called.
pub const USAGE: &str = "cargo xtask table orderings|buffer|proxy-size|io|memory-share|threads|multi-bvh|small -o DIR [--limits with_limits.sh] \
     [--scale 1.0] [--disk hdd|slow|ssd|as-is] [--scene atrium|cornell|fur] [--integrator path|photon] [--size 640x480] [--spp 8] [--threads 2] \
     [--seconds 300|inf] [--orders hph,queues] [--plot OUT.svg] [--pack FILE.rsp]";

/// A scene of the paper, what stands for it here, and the share of it that was in memory there.
struct PaperScene {
    name: &'static str,
    /// Option of `xtask scene` that tells its size, and triangles or strands.
    size: (&'static str, f64),
    percent: u64,
    /// Speed-ups over no order in table III: hph, hph-dir, origin-dir, origin, chunks.
    speedups: [&'static str; 5],
    /// How it was rendered there.
    options: &'static str,
}

const SCENES: [PaperScene; 3] = [
    PaperScene {
        name: "atrium",
        size: ("--triangles", 104e6),
        percent: 24,
        speedups: ["16.65", "6.36", "5.19", "5.16", "13.69"],
        options: "",
    },
    PaperScene {
        name: "cornell",
        size: ("--triangles", 128e6),
        percent: 19,
        speedups: ["12.28", "5.36", "2.29", "1.7", "28.61"],
        options: "--integrator photon --photons-nearest 100 --photon-passes 1 --gather-rays 10",
    },
    PaperScene {
        name: "fur",
        size: ("--strands", 32e6),
        percent: 37,
        speedups: ["3.77", "5.91", "3.49", "0.89", "not given"],
        options: "--integrator photon --photons-nearest 300 --photon-passes 1 --gather-rays 10",
    },
];

/// Orders of table III, in the order of the paper's speed-ups, then ours.
const PAPER_ORDERS: [&str; 5] = ["hph", "hph-dir", "origin-dir", "origin", "chunks"];
const OTHER_ORDERS: [&str; 2] = ["hph-origin", "queues"];

/// The pack that is rendered.
struct Rendered {
    path: PathBuf,
    bytes: u64,
    pages: f64,
}

impl Rendered {
    /// So many percent of its bytes.
    fn share(&self, percent: u64) -> u64 {
        self.bytes * percent / 100
    }
}

/// What was asked for.
struct Setting {
    limited: Limited,
    folder: PathBuf,
    disk: &'static Disk,
    scene: &'static PaperScene,
    scale: f64,
    pack: Option<PathBuf>,
    /// Of table III; empty: all.
    orders: Vec<String>,
    plot: Option<PathBuf>,
}

/// Prints the table with this name.
pub fn print(name: &str, arguments: &[String]) -> Result<()> {
    let setting = Setting::parse(arguments)?;
    let pack = setting.rendered()?;
    println!(
        "{} ({:.0} MiB, {} pages), {}x{}, {} samples, {} threads, {}\n",
        pack.path.display(),
        pack.bytes as f64 / 1048576.0,
        pack.pages,
        setting.limited.size.0,
        setting.limited.size.1,
        setting.limited.spp,
        setting.limited.threads,
        match name {
            "small" | "multi-bvh" => "all in memory".to_owned(),
            _ => format!("disk {}", setting.disk.name),
        }
    );
    match name {
        "orderings" => setting.orderings(&pack),
        "buffer" => setting.buffer(&pack),
        "memory-share" => setting.memory(&pack),
        "threads" => setting.threads(&pack),
        "proxy-size" => setting.proxy_size(&pack),
        "io" => setting.io(&pack),
        "multi-bvh" => setting.multi_bvh(&pack),
        "small" => setting.small(&pack),
        _ => bail!("usage: {USAGE}"),
    }
}

impl Setting {
    fn parse(arguments: &[String]) -> Result<Setting> {
        let options = [
            "-o",
            "--limits",
            "--scale",
            "--disk",
            "--scene",
            "--size",
            "--spp",
            "--threads",
            "--seconds",
            "--orders",
            "--integrator",
            "--plot",
            "--pack",
        ];
        let flags = Flags::parse(arguments, &options, &[])?;
        let (Some(folder), []) = (flags.value("-o"), flags.rest.as_slice()) else { bail!("usage: {USAGE}") };
        let named = |name: &str, other: &str| flags.value(name).unwrap_or(other).to_owned();
        let disk = named("--disk", "ssd");
        let scene = named("--scene", "atrium");
        let size = named("--size", "640x480");
        let size = size.split_once('x').context("--size: not like 640x480")?;
        let scene =
            SCENES.iter().find(|s| s.name == scene).context("--scene: none of atrium, cornell, fur")?;
        let options = match flags.value("--integrator") {
            Some(integrator) => vec!["--integrator".to_owned(), integrator.to_owned()],
            None => scene.options.split_whitespace().map(str::to_owned).collect(),
        };
        Ok(Setting {
            limited: Limited {
                options,
                raystrips: programs::raystrips()?,
                limits: std::path::absolute(named("--limits", "../shared/tools/with_limits.sh"))?,
                size: (size.0.parse().context("--size")?, size.1.parse().context("--size")?),
                spp: flags.count("--spp")?.unwrap_or(8),
                threads: flags.count("--threads")?.unwrap_or(2),
                most_seconds: named("--seconds", "300").parse().context("--seconds")?,
            },
            folder: std::path::absolute(folder)?,
            disk: DISKS.iter().find(|d| d.name == disk).context("--disk: none of hdd, slow, ssd, as-is")?,
            scene,
            scale: named("--scale", "1").parse().context("--scale")?,
            pack: flags.value("--pack").map(std::path::absolute).transpose()?,
            orders: flags.value("--orders").iter().flat_map(|o| o.split(',')).map(str::to_owned).collect(),
            plot: flags.value("--plot").map(PathBuf::from),
        })
    }

    fn rendered(&self) -> Result<Rendered> {
        self.opened(self.pack()?)
    }

    fn opened(&self, path: PathBuf) -> Result<Rendered> {
        let info =
            programs::json(Command::new(&self.limited.raystrips).arg("info").arg("--json").arg(&path))?;
        let bytes = std::fs::metadata(&path)?.len();
        Ok(Rendered { path, bytes, pages: programs::number(&info, "pages")? })
    }

    /// The pack of the scene, made if it is not there.
    fn pack(&self) -> Result<PathBuf> {
        if let Some(pack) = &self.pack {
            return Ok(pack.clone());
        }
        let (option, size) = self.scene.size;
        let size = ((size * self.scale) as u64).to_string();
        let folder = self.folder.join(format!("{}-{size}", self.scene.name));
        let pack = folder.with_extension("rsp");
        if !pack.exists() {
            let mut command = Command::new(std::env::current_exe()?);
            command.args(["scene", self.scene.name, option, &size, "-o"]).arg(&folder);
            programs::output(&mut command)?;
            let mut command = Command::new(&self.limited.raystrips);
            programs::output(command.arg("convert").arg(folder.join("scene.toml")).arg("-o").arg(&pack))?;
        }
        Ok(pack)
    }

    /// All in memory, without an order.
    fn resident(&self, pack: &Rendered) -> Result<Measured> {
        self.limited.render(&pack.path, &["--reorder", "none"], (None, &DISKS[3]))
    }

    /// Table III.
    fn orderings(&self, pack: &Rendered) -> Result<()> {
        let memory = pack.share(self.scene.percent);
        let limits = (Some(memory), self.disk);
        println!(
            "{} % of the pack, {} MiB, for all that the process holds\n",
            self.scene.percent,
            memory >> 20
        );
        println!("*Over none*: of the largest picture that both had the time for.\n");
        println!("| order | rays | Mrays/s | over none | paper | share of resident | {COUNT_HEADS} |");
        println!("|---|---:|---:|---:|---:|---:|{COUNT_LINE}|");
        let resident = self.resident(pack)?;
        let none = self.limited.pictures(&pack.path, &["--reorder", "none"], limits)?;
        let row = |name: &str, paper: &str, over_none: f64, largest: &Measured| {
            println!(
                "| {name} | {:.2}M | {:.4} | {over_none:.2} | {paper} | {:.1} % | {} |",
                largest.rays / 1e6,
                largest.rate(),
                100.0 * largest.rate() / resident.rate(),
                counts(largest, pack, self.limited.threads),
            );
        };
        let order = |name: &str, paper: &str, options: &[&str]| -> Result<()> {
            let pictures = self.limited.pictures(&pack.path, options, limits)?;
            let [.., largest] = pictures.as_slice() else { return Ok(()) };
            let both = none.iter().zip(&pictures).next_back();
            row(name, paper, both.map_or(0.0, |(none, own)| own.rate() / none.rate()), largest);
            Ok(())
        };
        let [.., largest] = none.as_slice() else { return Ok(()) };
        row("none, all in memory", "", resident.rate() / largest.rate(), &resident);
        row("none", "1", 1.0, largest);
        let is_wanted =
            |name: &str| self.orders.is_empty() || self.orders.iter().any(|wanted| wanted == name);
        let papers = PAPER_ORDERS.iter().zip(self.scene.speedups.map(str::to_owned));
        let others = OTHER_ORDERS.iter().map(|name| (name, String::new()));
        for (name, paper) in papers.chain(others).filter(|(name, _)| is_wanted(name)) {
            order(name, &paper, &["--reorder", name])?;
        }
        if is_wanted("auto") { order("auto", "", &[]) } else { Ok(()) }
    }

    /// Table I: memory for rays, as parts of what the paper gives.
    fn buffer(&self, pack: &Rendered) -> Result<()> {
        let memory = pack.share(self.scene.percent);
        println!("| buffer | Mrays/s | paper, s | {COUNT_HEADS} |\n|---|---:|---:|{COUNT_LINE}|");
        for (mebibytes, paper) in [(22, 10_541), (44, 10_460), (88, 10_314), (176, 10_459)] {
            // The same part of the pack as there of its 12.8 GB.
            let bytes = (pack.bytes as f64 * f64::from(mebibytes) * 1048576.0 / 12.8e9) as u64;
            let options = ["--reorder", "hph", "--ray-buffer", &bytes.to_string()];
            let measured = self.limited.render(&pack.path, &options, (Some(memory), self.disk))?;
            println!(
                "| {mebibytes} MB there, {:.1} MiB here | {:.4} | {paper} | {} |",
                bytes as f64 / 1048576.0,
                measured.rate(),
                counts(&measured, pack, self.limited.threads)
            );
        }
        Ok(())
    }

    /// Table II: the size of the proxy that finds approximate hit points.
    fn proxy_size(&self, pack: &Rendered) -> Result<()> {
        let memory = pack.share(self.scene.percent);
        println!("| proxy | rays | Mrays/s | paper, s | {COUNT_HEADS} |\n|---|---:|---:|---:|{COUNT_LINE}|");
        let rows = [
            ("none", "boxes of geometries alone", ""),
            ("coarse", "20,000 triangles", "10,644 (0.0125 %), 10,342 (0.05 %)"),
            ("fine", "2 %", "10,314"),
        ];
        for (proxy, name, paper) in rows {
            let options = ["--reorder", "hph", "--hit-proxy", proxy];
            let measured = self.limited.render(&pack.path, &options, (Some(memory), self.disk))?;
            println!(
                "| {name} | {:.1}M | {:.4} | {paper} | {} |",
                measured.rays / 1e6,
                measured.rate(),
                counts(&measured, pack, self.limited.threads)
            );
        }
        Ok(())
    }

    /// Figure 6 and section 5.1: what is read, and how fast.
    fn io(&self, pack: &Rendered) -> Result<()> {
        let limits = (Some(pack.share(self.scene.percent)), self.disk);
        println!("| order | rays | reads/Mray | fewer | KB a read | MB/s | more | paper |");
        println!("|---|---:|---:|---:|---:|---:|---:|---|");
        let speed = |m: &Measured| m.disk_bytes / m.seconds / 1e6;
        let reads = |m: &Measured| m.per_million(m.disk_reads);
        let none = self.limited.render(&pack.path, &["--reorder", "none"], limits)?;
        let row = |order: &str, m: &Measured, paper: &str| {
            println!(
                "| {order} | {:.1}M | {:.0} | {:.1} % | {:.1} | {:.1} | {:.0} % | {paper} |",
                m.rays / 1e6,
                reads(m),
                100.0 * (1.0 - reads(m) / reads(&none)),
                m.disk_bytes / m.disk_reads / 1e3,
                speed(m),
                100.0 * (speed(m) / speed(&none) - 1.0),
            );
        };
        row("none", &none, "");
        for (order, paper) in [("hph", "93.6 % fewer, 208.5 % more MB/s"), ("chunks", ""), ("queues", "")] {
            row(order, &self.limited.render(&pack.path, &["--reorder", order], limits)?, paper);
        }
        Ok(())
    }

    /// Figure 7: the share of the pack that is in memory.
    fn memory(&self, pack: &Rendered) -> Result<()> {
        const ORDERS: [&str; 4] = ["none", "hph", "chunks", "queues"];
        println!("| memory | order | rays | Mrays/s | share of resident | {COUNT_HEADS} |");
        println!("|---|---|---:|---:|---:|{COUNT_LINE}|");
        let resident = self.resident(pack)?;
        let mut lines: Vec<plot::Line> = ORDERS.map(|order| (order.to_owned(), Vec::new())).into();
        for percent in [100, 50, 24, 12, 6] {
            for (line, order) in lines.iter_mut().zip(ORDERS) {
                let memory = pack.share(percent);
                let measured =
                    match self.limited.render(&pack.path, &["--reorder", order], (Some(memory), self.disk)) {
                        Ok(measured) => measured,
                        Err(error) if error.to_string().contains("too little") => {
                            println!("| {percent} % | {order} | too little memory for this picture |");
                            continue;
                        }
                        Err(error) => return Err(error),
                    };
                let share = 100.0 * measured.rate() / resident.rate();
                line.1.push((percent as f64, share));
                println!(
                    "| {percent} %, {} MiB | {order} | {:.1}M | {:.4} | {share:.1} % | {} |",
                    memory >> 20,
                    measured.rays / 1e6,
                    measured.rate(),
                    counts(&measured, pack, self.limited.threads)
                );
            }
        }
        if let Some(path) = &self.plot {
            let svg =
                plot::lines("memory, percent of the pack", "percent of the speed with all in memory", &lines);
            crate::output::write_whole(path, svg.as_bytes())?;
        }
        Ok(())
    }

    /// Threads, with the share in memory that the paper has.
    fn threads(&self, pack: &Rendered) -> Result<()> {
        let memory = pack.share(self.scene.percent);
        println!("| order | threads | Mrays/s | {COUNT_HEADS} |\n|---|---:|---:|{COUNT_LINE}|");
        for order in ["hph", "chunks", "queues"] {
            for threads in [1, 2, 4] {
                let limited = Limited {
                    threads,
                    raystrips: self.limited.raystrips.clone(),
                    limits: self.limited.limits.clone(),
                    options: self.limited.options.clone(),
                    ..self.limited
                };
                let measured =
                    limited.render(&pack.path, &["--reorder", order], (Some(memory), self.disk))?;
                println!(
                    "| {order} | {threads} | {:.4} | {} |",
                    measured.rate(),
                    counts(&measured, pack, threads)
                );
            }
        }
        Ok(())
    }
}

const COUNT_HEADS: &str =
    "rays/page | waiting | overhead | pages read/Mray | MB/Mray | reads/Mray | peak MiB, with page cache";
const COUNT_LINE: &str = "---:|---:|---:|---:|---:|---:|---:";

/// What all rows end with.
fn counts(measured: &Measured, pack: &Rendered, threads: u64) -> String {
    format!(
        "{:.0} | {:.0} % | {:.1} % | {:.0} | {:.1} | {:.0} | {:.0}, {:.0}",
        measured.rays / pack.pages,
        100.0 * measured.wait_seconds / (measured.seconds * threads as f64),
        overhead(measured, threads),
        measured.per_million(measured.pages_read),
        measured.per_million(measured.disk_bytes) / 1e6,
        measured.per_million(measured.disk_reads),
        measured.peak_bytes / 1048576.0,
        measured.group_peak_bytes / 1048576.0,
    )
}

/// Percent of the time that goes into finding an order.
fn overhead(measured: &Measured, threads: u64) -> f64 {
    100.0 * measured.overhead_seconds / (measured.seconds * threads as f64)
}
