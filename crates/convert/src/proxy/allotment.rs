//! How far each piece of a level is to be simplified.
//!
//! As if all pieces were one: a collapse is done wherever it costs less than what is left. What that cost is, some pieces
//! tell that are simplified to see; where the count has to be right, all of them do.

use super::piece::Reading;
use crate::distribute::Pieces;
use crate::queue::in_order;
use crate::{ConvertError, Observer};
use raystrips_simplify::{CostCurve, Target};

/// A level has as many triangles as are left over this, at the least.
const LEVEL_FACTOR: u64 = 8;
/// From this many times the asked count on, the next level is the last one.
const LAST_FACTOR: f64 = 1.6;
/// What the level before the last one leaves, as a multiple of the asked count.
const BEFORE_LAST: f64 = 1.3;
/// One piece of so many is simplified to see what it costs.
const PIECES_PER_SAMPLE: usize = 16;
/// Least pieces that are: few on the first level, where it takes most of the time and there are levels to come.
const FIRST_SAMPLES: usize = 3;
const LATER_SAMPLES: usize = 8;
/// Pieces that are simplified to see are left with this part of what is expected of them, since some have to lose more.
const BEYOND: u64 = 4;

/// How many triangles a level is to leave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Goal {
    pub triangles: u64,
    /// False if there is a level before it.
    pub is_first: bool,
    /// False if there is a level after it.
    pub is_last: bool,
}

impl Goal {
    /// What to do with so many triangles in so many pieces to come to the `wanted` ones.
    pub fn of(triangles: u64, pieces: usize, is_first: bool, wanted: u64) -> Goal {
        let is_last = pieces == 1 || triangles as f64 <= LAST_FACTOR * wanted as f64;
        let before_last = (wanted as f64 * BEFORE_LAST) as u64;
        let triangles = if is_last { wanted } else { before_last.max(triangles / LEVEL_FACTOR) };
        Goal { triangles, is_first, is_last }
    }

    /// Which of so many pieces tell what a model is made of.
    pub fn looks(&self, pieces: usize) -> Vec<usize> {
        Goal { is_last: false, ..*self }.samples(pieces)
    }

    /// Which of so many pieces tell what collapses cost.
    fn samples(&self, pieces: usize) -> Vec<usize> {
        let least = if self.is_first { FIRST_SAMPLES } else { LATER_SAMPLES };
        let count = match self.is_last {
            true => pieces,
            false => pieces.div_ceil(PIECES_PER_SAMPLE).max(least).min(pieces),
        };
        (0..count).map(|i| i * pieces / count).collect()
    }
}

/// What each piece is to be simplified to.
pub(crate) enum Allotment {
    /// Triangles of each piece.
    Counts(Vec<u64>),
    /// The same cost for all, but this part of the triangles stays: pieces that were not looked at may be unlike those
    /// that were, and what is gone does not come back.
    Cost { max_cost: f64, least_part: f64 },
}

impl Allotment {
    /// Looks at the pieces of a level with this goal. `wanted` triangles are to be left in the end.
    pub fn new(
        pieces: &Pieces,
        reading: &Reading,
        goal: Goal,
        wanted: u64,
        at_a_time: usize,
        observer: &dyn Observer,
    ) -> Result<Allotment, ConvertError> {
        let count = pieces.sources.len();
        if count == 1 {
            return Ok(Allotment::Counts(vec![goal.triangles]));
        }
        let samples = goal.samples(count);
        let total = pieces.triangles();
        let part = goal.triangles as f64 / total as f64;
        let work = |i: usize| {
            let left = (pieces.sources[samples[i]].triangles as f64 * part) as u64 / BEYOND;
            reading.curve(pieces, samples[i], left as usize)
        };
        let mut curves = Vec::new();
        in_order(0..samples.len(), at_a_time, observer, &work, &mut |_, curve| {
            curves.push(curve);
            Ok(())
        })?;
        if goal.is_last {
            return Ok(Allotment::Counts(CostCurve::divide(&curves, goal.triangles)));
        }
        let sampled: u64 = samples.iter().map(|&i| pieces.sources[i].triangles).sum();
        Ok(Allotment::Cost {
            max_cost: CostCurve::max_cost(&curves, (sampled as f64 * part) as u64),
            least_part: wanted as f64 / total as f64,
        })
    }

    /// The target of piece `number`, which has so many triangles.
    pub fn target(&self, number: usize, triangles: u64) -> Target {
        match self {
            Allotment::Counts(counts) => Target::triangles(counts[number] as usize),
            Allotment::Cost { max_cost, least_part } => {
                Target { triangles: (triangles as f64 * least_part).ceil() as usize, max_cost: *max_cost }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_come_to_the_count() {
        for (mut triangles, wanted) in [(100_000_000, 2_000_000), (100_000_000, 20_000), (700_000, 690_000)] {
            let mut levels = 0;
            loop {
                let goal = Goal::of(triangles, if triangles > 1 << 18 { 2 } else { 1 }, levels == 0, wanted);
                assert!(goal.triangles >= wanted && goal.triangles < triangles, "{triangles}: {goal:?}");
                levels += 1;
                triangles = goal.triangles;
                if goal.is_last {
                    break;
                }
            }
            assert!(triangles == wanted && levels <= 4, "{levels}");
        }
    }
}
