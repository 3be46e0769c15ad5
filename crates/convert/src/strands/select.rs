//! Some windows of a block, with their points.

use crate::block::{self, Points, StoredWindow};
use glam::Vec3;

/// Windows with the points that they name. Of windows that follow each other in a strand the second begins with the last
/// point of the first.
#[derive(Default)]
pub(crate) struct Selected {
    positions: Vec<Vec3>,
    radii: Vec<f32>,
    windows: Vec<StoredWindow>,
}

impl Selected {
    /// Takes `windows`, whose points are among `positions`.
    pub fn new(windows: impl Iterator<Item = StoredWindow>, positions: &[Vec3], radii: &[f32]) -> Selected {
        let mut selected = Selected::default();
        windows.for_each(|window| selected.add(window, positions, radii));
        selected
    }

    fn add(&mut self, window: StoredWindow, positions: &[Vec3], radii: &[f32]) {
        let follows = |last: &&StoredWindow| {
            last.strand == window.strand && last.segment + last.segments == window.segment
        };
        let shared = usize::from(self.windows.last().filter(follows).is_some());
        let first = self.positions.len() - shared;
        let points = usize::from(window.first) + shared..=usize::from(window.first + window.segments);
        self.positions.extend_from_slice(&positions[points.clone()]);
        self.radii.extend_from_slice(&radii[points]);
        self.windows.push(StoredWindow { first: first as u16, ..window });
    }

    /// Makes them thicker.
    pub fn widen(&mut self, factor: f32) {
        self.radii.iter_mut().for_each(|radius| *radius *= factor);
    }

    pub fn segments(&self) -> u64 {
        self.windows.iter().map(|window| u64::from(window.segments)).sum()
    }

    pub fn windows(&self) -> u64 {
        self.windows.len() as u64
    }

    /// A block of them.
    pub fn block(&self, geometry: u32, first_id: u64) -> Vec<u8> {
        block::of_windows((geometry, first_id), Points::Narrow(&self.positions), &self.radii, &self.windows)
    }
}
