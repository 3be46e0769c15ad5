//! Who is compared, on what.

use super::programs::{Programs, json, number};
use anyhow::Result;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Camera rays in the order of blocks of pixels, for packets.
pub const BLOCKS_FILE: &str = "primary_blocks.rays";
/// Pixels along a side of such a block.
pub const BLOCK: usize = 8;
/// Tracings in one run of a program, of which it tells the fastest.
const REPEAT: &str = "3";

/// A program in one of its modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contestant {
    Ours,
    /// Packets of the camera rays of blocks of pixels.
    OursPackets,
    /// With the mode of its scene.
    Embree(&'static str),
}

/// All of them, ours first.
pub const ALL: [Contestant; 6] = [
    Contestant::Ours,
    Contestant::OursPackets,
    Contestant::Embree("default"),
    Contestant::Embree("robust"),
    Contestant::Embree("compact"),
    Contestant::Embree("compact+robust"),
];

/// A ray file, and what is asked of its rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Name of the file that `make_rays` writes, without its ending.
    pub file: &'static str,
    /// Whether there is a hit, instead of the closest one.
    pub any_hit: bool,
}

const fn closest(file: &'static str) -> Kind {
    Kind { file, any_hit: false }
}

const fn any_hit(file: &'static str) -> Kind {
    Kind { file, any_hit: true }
}

/// The columns.
pub const KINDS: [Kind; 9] = [
    closest("primary"),
    closest("ao"),
    closest("ao_shuffled"),
    closest("bounce2"),
    closest("bounce2_shuffled"),
    closest("bounce3"),
    closest("chord"),
    any_hit("ao"),
    any_hit("ao_shuffled"),
];

impl Kind {
    /// Heads a column.
    pub fn name(self) -> String {
        format!("{}{}", self.file, if self.any_hit { " any" } else { "" })
    }
}

/// The files of a model.
pub struct Files {
    /// For Embree.
    pub model: PathBuf,
    /// For ours.
    pub pack: PathBuf,
    /// Folder of the ray files.
    pub rays: PathBuf,
}

impl Files {
    /// The ray file of a kind.
    pub fn rays_of(&self, kind: Kind) -> PathBuf {
        self.rays.join(format!("{}.rays", kind.file))
    }

    /// Whether there are rays of a kind: of what is not hit, none are diffused.
    pub fn has_rays(&self, kind: Kind) -> bool {
        self.rays_of(kind).metadata().is_ok_and(|file| file.len() > 0)
    }
}

/// What a run tells.
pub struct Run {
    /// Million rays a second, of the mean processor time of a thread.
    pub speed: f64,
    /// Where the program tells it.
    pub bytes_per_triangle: Option<f64>,
}

impl Contestant {
    /// Names a row.
    pub fn name(self) -> String {
        match self {
            Contestant::Ours => "raystrips".into(),
            Contestant::OursPackets => "raystrips, packets".into(),
            Contestant::Embree(mode) => format!("Embree {mode}"),
        }
    }

    /// Whether it takes part in a column. Packets are for rays that begin together.
    pub fn runs(self, kind: Kind, programs: &Programs) -> bool {
        self != Contestant::OursPackets || (programs.has_packets && kind == KINDS[0])
    }

    /// Traces the rays of a kind.
    pub fn run(self, programs: &Programs, files: &Files, kind: Kind, threads: u32) -> Result<Run> {
        let mut command = self.command(programs, files, kind);
        command.args(["--threads", &threads.to_string(), "--repeat", REPEAT]);
        let told = json(&mut command)?;
        let bytes_per_triangle = told["bytes_per_triangle"].as_f64();
        Ok(Run { speed: number(&told, "mrays_per_second_cpu")?, bytes_per_triangle })
    }

    /// Traces the rays of a kind once and writes the hits.
    pub fn write_hits(self, programs: &Programs, files: &Files, kind: Kind, hits: &Path) -> Result<()> {
        let mut command = self.command(programs, files, kind);
        json(command.args(["--repeat", "1", "-o"]).arg(hits)).map(drop)
    }

    fn command(self, programs: &Programs, files: &Files, kind: Kind) -> Command {
        if let Contestant::Embree(mode) = self {
            let mut command = Command::new(&programs.embree_trace);
            command.arg(&files.model).arg(files.rays_of(kind)).args(["--mode", mode]);
            return with(command, ["--query", "any"], kind.any_hit);
        }
        let rays = match self {
            Contestant::OursPackets => files.rays.join(BLOCKS_FILE),
            _ => files.rays_of(kind),
        };
        let mut command = Command::new(&programs.raystrips);
        command.arg("trace").arg(&files.pack).arg("--rays").arg(rays).arg("--json");
        let command = with(command, ["--occluded"], kind.any_hit);
        with(command, ["--packets"], self == Contestant::OursPackets)
    }
}

fn with<const N: usize>(mut command: Command, arguments: [&str; N], condition: bool) -> Command {
    if condition {
        command.args(arguments);
    }
    command
}
