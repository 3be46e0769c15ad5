//! Fewer strands that look like all of them from afar: stochastic simplification (Cook, Halstead, Planck, Ryu 2007).
//!
//! A strand stays by the rank of its number among all, which has nothing to do with where it is, and those that stay get
//! thicker. To keep the area of all they would have to be as many times thicker as there are fewer of them; a proxy of a
//! few hundredths would be a solid shell then, and rays that pass between strands would meet it far before their hit. By the
//! square root of that there is about as much to meet on the way in.

use super::Selected;
use crate::block::Block;
use glam::Vec3;

/// Thicker strands than this many times are not in their places any more.
const MOST_WIDENING: f64 = 8.0;

/// Which part of all strands stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StrandThinning {
    kept: f64,
}

impl StrandThinning {
    /// Keeps this part, at most all.
    pub fn new(kept: f64) -> StrandThinning {
        StrandThinning { kept: kept.clamp(0.0, 1.0) }
    }

    /// How many times as thick they get.
    pub fn widening(&self) -> f32 {
        self.kept.powf(-0.5).min(MOST_WIDENING) as f32
    }

    /// The windows of a block that stay, which were thinned by `before`.
    pub fn apply(&self, block: &Block, before: StrandThinning) -> Selected {
        let positions: Vec<Vec3> = block.points().collect();
        let radii: Vec<f32> = block.radii().collect();
        let stays = |strand: u16| rank(block.first_id() + u64::from(strand)) < self.kept;
        let windows = block.windows().filter(|window| stays(window.strand));
        let mut selected = Selected::new(windows, &positions, &radii);
        selected.widen(self.widening() / before.widening());
        selected
    }
}

impl Default for StrandThinning {
    /// All stay.
    fn default() -> StrandThinning {
        StrandThinning { kept: 1.0 }
    }
}

/// The rank of a strand among all, from 0 to 1 (finalizer of SplitMix64, Steele et al. 2014).
fn rank(strand: u64) -> f64 {
    let mut x = strand.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((x ^ x >> 31) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strands::of_batch;
    use raystrips_meshio::StrandBatch;

    #[test]
    fn thinning_twice_is_thinning_once() {
        let count = 5000;
        let batch = StrandBatch {
            positions: (0..9 * count).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
            radii: vec![1.0; 9 * count as usize],
            lengths: vec![9; count as usize],
            ..StrandBatch::default()
        };
        let (bytes, windows) = of_batch(&batch);
        assert_eq!(windows, 2 * count as u64);
        let block = Block::all(&bytes).next().unwrap().unwrap();
        let (half, tenth) = (StrandThinning::new(0.5), StrandThinning::new(0.1));
        let once = tenth.apply(&block, StrandThinning::default());
        let kept = once.windows() as f64 / windows as f64;
        assert!((0.08..0.12).contains(&kept), "{kept}");
        let bytes = half.apply(&block, StrandThinning::default()).block(0, 0);
        let block = Block::all(&bytes).next().unwrap().unwrap();
        let twice = tenth.apply(&block, half).block(0, 0);
        let twice = Block::all(&twice).next().unwrap().unwrap();
        assert!(twice.windows().eq(Block::all(&once.block(0, 0)).next().unwrap().unwrap().windows()));
        assert!(twice.radii().all(|radius| (radius - 10f32.sqrt()).abs() < 1e-5));
    }
}
