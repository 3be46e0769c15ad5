//! Parts: what is shown many times and sent once.

use crate::emit::MAX_COORDINATE;
use crate::{Instance, TriangleBatch};
use glam::{DAffine3, DVec3};
use raystrips_geom::affine::{bounds_of, condition};

/// Greatest condition of the matrix of an instance. With more, what is rounded in a part would matter too much.
const MAX_CONDITION: f64 = 32.0;

/// Triangles of what is stored once: the nodes above smaller ones would take as much as copies.
const FEWEST_TRIANGLES: u64 = 256;
/// Triangles that have to be saved by it, some 300 KiB: rays are faster without instances.
const FEWEST_SAVED: u64 = 1 << 15;

/// True if so many triangles that are shown so often are better stored once.
pub(crate) fn saves_enough(triangles: u64, times: u64) -> bool {
    triangles >= FEWEST_TRIANGLES && triangles.saturating_mul(times.saturating_sub(1)) >= FEWEST_SAVED
}

/// True if a part can be shown this way; what cannot has to be repeated.
pub(crate) fn can_show(world_from_local: &DAffine3) -> bool {
    world_from_local.translation.is_finite() && condition(world_from_local.matrix3) <= MAX_CONDITION
}

/// Parts, and where they are shown.
#[derive(Default)]
pub(crate) struct Instances {
    pub all: Vec<Instance>,
    /// By number, beginning with 1.
    parts: Vec<Part>,
    /// What batches belong to.
    present: u32,
}

struct Part {
    triangles: u64,
    /// Least and greatest corner.
    bounds: [DVec3; 2],
}

impl Instances {
    /// Begins the next part and gives its number.
    pub fn begin_part(&mut self) -> u32 {
        self.parts.push(Part { triangles: 0, bounds: [DVec3::INFINITY, DVec3::NEG_INFINITY] });
        self.present = self.parts.len() as u32;
        self.present
    }

    /// True between the beginning and the end of a part.
    pub fn is_in_part(&self) -> bool {
        self.present != 0
    }

    /// From now on batches belong to the scene.
    pub fn end_part(&mut self) {
        self.present = 0;
    }

    /// Takes note of a batch. Gives the part that it belongs to, or 0.
    pub fn take(&mut self, batch: &TriangleBatch) -> u32 {
        if let Some(part) = self.present.checked_sub(1).map(|index| &mut self.parts[index as usize]) {
            part.triangles += batch.triangles.len() as u64;
            let positions = batch.positions.iter().map(|&p| DVec3::from_array(p));
            part.bounds = positions.fold(part.bounds, |[min, max], p| [min.min(p), max.max(p)]);
        }
        self.present
    }

    /// Adds an instance, but if it reaches too far out: then gives the number of its triangles, which are dropped.
    pub fn add(&mut self, instance: Instance) -> u64 {
        let Part { triangles, bounds } = self.parts[instance.part as usize - 1];
        if triangles == 0 {
            return 0;
        }
        let corners = bounds_of(bounds, &instance.world_from_local);
        // NaN is in no bounds.
        if !corners.iter().all(|corner| corner.abs().max_element() <= MAX_COORDINATE) {
            return triangles;
        }
        self.all.push(instance);
        0
    }
}
