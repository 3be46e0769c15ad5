//! What waits for pages, in few bytes.

use super::starts::CameraPacket;
use crate::{
    sampler::PathSampler,
    wave::{Path, PendingLight},
};
use glam::Vec3;
use raystrips_geom::{Hit, Ray};
use raystrips_reorder::Parcel;
use raystrips_tracer::{PACKET, RayBuffer};

/// A [`Path`] that waits: what cannot be found again from the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WaitingPath {
    pixel: u32,
    sample_index: u32,
    throughput: Vec3,
    /// Not a number where the path has none.
    scatter_pdf: f32,
    segment: u32,
    passed: u32,
    distance: f32,
}

impl WaitingPath {
    pub fn new(path: &Path) -> WaitingPath {
        let &Path { pixel, sampler, throughput, scatter_pdf, segment, bounces, passed, distance } = path;
        debug_assert_eq!(segment, bounces + passed, "each surface reflects a path or is passed");
        WaitingPath {
            pixel,
            sample_index: sampler.sample_index(),
            throughput,
            scatter_pdf: scatter_pdf.unwrap_or(f32::NAN),
            segment,
            passed,
            distance,
        }
    }

    /// The path again, of a picture with `width` pixels in a row and this seed.
    pub fn path(&self, width: u32, seed: u64) -> Path {
        let &WaitingPath { pixel, sample_index, throughput, scatter_pdf, segment, passed, distance } = self;
        Path {
            pixel,
            sampler: PathSampler::new([pixel % width, pixel / width], sample_index, seed),
            throughput,
            scatter_pdf: (!scatter_pdf.is_nan()).then_some(scatter_pdf),
            segment,
            bounces: segment - passed,
            passed,
            distance,
        }
    }
}

/// A ray that has its hit.
#[derive(Clone, Copy)]
pub(super) struct Answer {
    pub path: WaitingPath,
    pub ray: Ray,
    pub hit: Hit,
}

/// Bytes of a ray that waits, at about, with what queues have to spare.
pub(super) const RAY_BYTES: usize = 80;

/// What waits for a run of pages.
#[derive(Default)]
pub(super) struct Waiting {
    pub closest: RayBuffer<WaitingPath>,
    pub shadow: RayBuffer<PendingLight>,
    /// Hits in one of the pages, whose surface is needed.
    pub hits: Vec<Answer>,
    pub packets: Vec<CameraPacket>,
}

impl Parcel for Waiting {
    fn append(&mut self, other: &mut Waiting) {
        self.closest.append(&mut other.closest);
        self.shadow.append(&mut other.shadow);
        self.hits.append(&mut other.hits);
        self.packets.append(&mut other.packets);
    }

    fn rays(&self) -> usize {
        self.closest.len() + self.shadow.len() + self.hits.len() + self.packets.len() * PACKET
    }

    fn bytes(&self) -> usize {
        self.closest.bytes()
            + self.shadow.bytes()
            + self.hits.capacity() * size_of::<Answer>()
            + self.packets.capacity() * size_of::<CameraPacket>()
    }
}
