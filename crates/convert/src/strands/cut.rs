//! Strands of a batch to windows.

use crate::block::{self, Points, StoredWindow};
use glam::Vec3;
use raystrips_meshio::StrandBatch;

/// Segments of a window: `docs/RESULTS.md`, "Hair".
const SEGMENTS: usize = 4;

/// A batch of the import as a block; positions are f32 where that loses nothing. And how many windows it has.
pub(crate) fn of_batch(batch: &StrandBatch) -> (Vec<u8>, u64) {
    let windows = windows(&batch.lengths);
    let of = (batch.geometry, batch.first_segment_id);
    let narrow: Vec<Vec3> = batch.positions.iter().map(|p| Vec3::from_array(p.map(|x| x as f32))).collect();
    let is_exact =
        narrow.iter().zip(&batch.positions).all(|(narrow, wide)| narrow.to_array().map(f64::from) == *wide);
    let points = if is_exact { Points::Narrow(&narrow) } else { Points::Wide(&batch.positions) };
    (block::of_windows(of, points, &batch.radii, &windows), windows.len() as u64)
}

/// The windows of strands of so many points each, which lie one after the other.
fn windows(lengths: &[u32]) -> Vec<StoredWindow> {
    let mut windows = Vec::new();
    let (mut point, mut segment) = (0, 0);
    for &length in lengths {
        let count = length as usize - 1;
        let parts = count.div_ceil(SEGMENTS);
        for part in 0..parts {
            // Parts of a strand are as long as each other, or longer by one.
            let (begin, end) = (count * part / parts, count * (part + 1) / parts);
            windows.push(StoredWindow {
                first: (point + begin) as u16,
                segments: (end - begin) as u16,
                segment: (segment + begin) as u16,
                strand: segment as u16,
            });
        }
        point += length as usize;
        segment += count;
    }
    windows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_of_a_strand_share_points_and_are_about_as_long() {
        let of = |lengths: &[u32]| {
            windows(lengths).iter().map(|w| (w.first, w.segments, w.segment, w.strand)).collect::<Vec<_>>()
        };
        assert_eq!(of(&[9]), [(0, 4, 0, 0), (4, 4, 4, 0)]);
        assert_eq!(of(&[2, 6, 2]), [(0, 1, 0, 0), (2, 2, 1, 1), (4, 3, 3, 1), (8, 1, 6, 6)]);
        assert_eq!(of(&[65536]).last(), Some(&(65531, 4, 65531, 0)));
    }
}
