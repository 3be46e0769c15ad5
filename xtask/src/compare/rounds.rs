//! Speeds measured in turns: machines get faster and slower by the minute, so that only runs next to each other can be
//! compared.

use super::contestant::{ALL, Files, KINDS};
use super::programs::Programs;
use super::progress::Progress;
use anyhow::Result;

/// What was measured of a model.
#[derive(Default)]
pub struct Speeds {
    /// Million rays a second, by contestant, kind and round. Without rounds where a contestant does not take part.
    pub mrays: [[Vec<f64>; KINDS.len()]; ALL.len()],
    /// By contestant; ours is known from the conversion.
    pub bytes_per_triangle: [Option<f64>; ALL.len()],
}

/// Runs all contestants on all kinds of rays in each of `rounds`.
pub fn measure(programs: &Programs, files: &Files, threads: u32, rounds: usize) -> Result<Speeds> {
    let mut speeds = Speeds::default();
    let mut progress = Progress::new(rounds * KINDS.len() * ALL.len());
    for round in 0..rounds {
        for (column, &kind) in KINDS.iter().enumerate() {
            // Each is first in turn: what runs first may find the processor cooler.
            for row in (0..ALL.len()).map(|i| (i + round) % ALL.len()) {
                progress.step(&format!("round {}, {}, {}", round + 1, kind.name(), ALL[row].name()));
                if files.has_rays(kind) && ALL[row].runs(kind, programs) {
                    let run = ALL[row].run(programs, files, kind, threads)?;
                    speeds.mrays[row][column].push(run.speed);
                    speeds.bytes_per_triangle[row] = run.bytes_per_triangle;
                }
            }
        }
    }
    Ok(speeds)
}
