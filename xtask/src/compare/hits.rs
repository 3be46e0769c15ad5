//! Whether two programs found the same: their hit files side by side.

use super::contestant::{Contestant, Files, KINDS};
use super::programs::Programs;
use anyhow::{Context, Result, bail};
use std::path::Path;

/// Bytes of a hit, which begin with its distance as f32.
const HIT_BYTES: usize = 24;
/// Distances may differ by so much of themselves.
const TOLERANCE: f32 = 1e-4;

/// What differs.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Differences {
    /// Rays that were compared.
    pub rays: usize,
    /// Rays that only one of the two found to hit.
    pub hit_or_miss: usize,
    /// Rays that hit at other distances.
    pub distance: usize,
}

/// Compares ours with Embree in its robust mode over all kinds of rays.
pub fn compare(programs: &Programs, files: &Files, scratch: &Path) -> Result<Differences> {
    let mut all = Differences::default();
    for kind in KINDS.into_iter().filter(|&kind| !kind.any_hit && files.has_rays(kind)) {
        let distances = |contestant: Contestant| {
            let hits = scratch.join("hits");
            contestant.write_hits(programs, files, kind, &hits)?;
            distances(&std::fs::read(&hits).with_context(|| hits.display().to_string())?)
        };
        all.add(&distances(Contestant::Ours)?, &distances(Contestant::Embree("robust"))?)?;
    }
    Ok(all)
}

fn distances(bytes: &[u8]) -> Result<Vec<f32>> {
    if !bytes.len().is_multiple_of(HIT_BYTES) {
        bail!("{} bytes are not a whole number of hits", bytes.len());
    }
    Ok(bytes
        .chunks_exact(HIT_BYTES)
        .map(|hit| f32::from_le_bytes([hit[0], hit[1], hit[2], hit[3]]))
        .collect())
}

impl Differences {
    fn add(&mut self, ours: &[f32], theirs: &[f32]) -> Result<()> {
        if ours.len() != theirs.len() {
            bail!("{} hits of ours, {} of Embree's", ours.len(), theirs.len());
        }
        self.rays += ours.len();
        for (&a, &b) in ours.iter().zip(theirs) {
            match (a.is_finite(), b.is_finite()) {
                (true, true) => {
                    self.distance += usize::from((a - b).abs() > TOLERANCE * a.abs().max(b.abs()))
                }
                (false, false) => {}
                _ => self.hit_or_miss += 1,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_counted() {
        let mut differences = Differences::default();
        let none = f32::INFINITY;
        differences.add(&[1.0, 1.0, none, none, 5.0], &[1.00001, 1.1, none, 2.0, none]).unwrap();
        assert_eq!(differences, Differences { rays: 5, hit_or_miss: 2, distance: 1 });
        assert!(differences.add(&[1.0], &[]).is_err());
    }

    #[test]
    fn distances_are_at_the_begin() {
        let mut bytes = [7; 48];
        bytes[24..28].copy_from_slice(&2f32.to_le_bytes());
        assert_eq!(distances(&bytes).unwrap()[1], 2.0);
        assert!(distances(&bytes[1..]).is_err());
    }
}
