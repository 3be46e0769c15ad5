//! Paths between two rays, in few bytes.

use crate::{sampler::PathSampler, wave::Path};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A [`Path`] that waits: what cannot be found again from the rest.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct WaitingPath {
    pub pixel: u32,
    pub sample_index: u32,
    pub throughput: Vec3,
    /// Not a number where the path has none.
    pub scatter_pdf: f32,
    pub segment: u32,
    pub passed: u16,
    pub errand: u8,
    pub medium: u8,
    pub width: f32,
    pub spread: f32,
    pub straight: f32,
}

impl WaitingPath {
    pub fn new(path: &Path) -> WaitingPath {
        let &Path {
            pixel,
            sampler,
            throughput,
            scatter_pdf,
            segment,
            bounces,
            passed,
            errand,
            medium,
            width,
            spread,
            straight,
        } = path;
        debug_assert!(
            path.is_shadow() || segment == bounces + passed,
            "each surface reflects a path or is passed"
        );
        WaitingPath {
            pixel,
            sample_index: sampler.sample_index(),
            throughput,
            scatter_pdf: scatter_pdf.unwrap_or(f32::NAN),
            segment,
            passed: passed as u16,
            errand,
            medium,
            width,
            spread,
            straight,
        }
    }

    /// True if it is a shadow ray on its way as a path.
    pub fn is_shadow(&self) -> bool {
        self.segment == Path::SHADOW
    }

    /// The path again, of a picture with `picture_width` pixels in a row and this seed.
    pub fn path(&self, picture_width: u32, seed: u64) -> Path {
        let &WaitingPath {
            pixel,
            sample_index,
            throughput,
            scatter_pdf,
            segment,
            passed,
            errand,
            medium,
            width,
            spread,
            straight,
        } = self;
        let passed = u32::from(passed);
        Path {
            pixel,
            sampler: PathSampler::new([pixel % picture_width, pixel / picture_width], sample_index, seed),
            throughput,
            scatter_pdf: (!scatter_pdf.is_nan()).then_some(scatter_pdf),
            segment,
            bounces: segment - passed,
            passed,
            errand,
            medium,
            width,
            spread,
            straight,
        }
    }
}
