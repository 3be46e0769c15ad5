//! What shading leaves, on its way to the film.

use crate::{film::Film, interaction::SurfaceInteraction, wave::Path};
use glam::Vec3;

/// What shading leaves: added to a film later, in any order.
#[derive(Default)]
pub(crate) struct Deposits {
    light: Vec<(u32, Vec3)>,
    first_hits: Vec<FirstHit>,
    /// Pixels that got one more sample.
    samples: Vec<u32>,
}

struct FirstHit {
    pixel: u32,
    depth: f32,
    albedo: Vec3,
    normal: Vec3,
}

impl Deposits {
    /// Counts one more sample of a pixel.
    pub fn begin_sample(&mut self, pixel: u32) {
        self.samples.push(pixel);
    }

    /// Light that reaches a pixel.
    pub fn add(&mut self, pixel: u32, light: Vec3) {
        self.light.push((pixel, light));
    }

    /// The first surface of a path.
    pub fn add_first_hit(&mut self, path: &Path, hit: &SurfaceInteraction) {
        let (depth, albedo) = (path.straight + hit.distance, hit.material.albedo);
        self.first_hits.push(FirstHit { pixel: path.pixel, depth, albedo, normal: hit.shading_n });
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.light.len() + self.first_hits.len() + self.samples.len()
    }

    /// Puts all into `film`.
    pub fn flush(&mut self, film: &mut Film) {
        self.samples.drain(..).for_each(|pixel| film.begin_sample(pixel as usize));
        self.light.drain(..).for_each(|(pixel, light)| film.add(pixel as usize, light));
        for FirstHit { pixel, depth, albedo, normal } in self.first_hits.drain(..) {
            film.add_first_hit(pixel as usize, depth, albedo, normal);
        }
    }
}
