//! Strands on their way into a batch.

use crate::StrandBatch;
use crate::emit::MAX_POSITIONS;

/// The present batch of strands, and what is the same for all of a file.
#[derive(Default)]
pub(crate) struct Strands {
    /// Width that was given for the file.
    pub width: Option<f64>,
    /// Scene units of a unit of the file.
    pub scale: f64,
    /// Points of the present strand, in the world.
    pub points: Vec<Point>,
    batch: StrandBatch,
}

/// Position and radius.
pub(crate) type Point = ([f64; 3], f32);

impl Strands {
    /// True where a strand of so many points, whose first segment has this number, can go into the batch.
    pub fn takes(&self, geometry: u32, points: usize, first_segment_id: u64) -> bool {
        let batch = &self.batch;
        let segments = (batch.positions.len() - batch.lengths.len()) as u64;
        batch.lengths.is_empty()
            || batch.geometry == geometry
                && batch.positions.len() + points <= MAX_POSITIONS
                && batch.first_segment_id + segments == first_segment_id
    }

    /// Adds a strand that the batch takes.
    pub fn push(&mut self, geometry: u32, points: &[Point], first_segment_id: u64) {
        let batch = &mut self.batch;
        if batch.lengths.is_empty() {
            (batch.geometry, batch.first_segment_id) = (geometry, first_segment_id);
        }
        batch.positions.extend(points.iter().map(|(position, _)| position));
        batch.radii.extend(points.iter().map(|(_, radius)| radius));
        batch.lengths.push(points.len() as u32);
    }

    /// The batch, if there is anything in it.
    pub fn take(&mut self) -> Option<StrandBatch> {
        (!self.batch.lengths.is_empty()).then(|| std::mem::take(&mut self.batch))
    }
}
