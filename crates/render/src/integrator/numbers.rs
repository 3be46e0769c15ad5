//! Random numbers of a path from the camera.

use crate::wave::Path;

/// Pairs of random numbers of a segment of a path.
#[derive(Clone, Copy)]
pub(crate) enum Pair {
    Direction,
    AreaLight,
    /// Which punctual light; which lobe of a surface.
    PunctualLight,
    /// Whether a partly opaque surface reflects; whether the path goes on.
    Survival,
    /// Where in an environment.
    Sky,
}

impl Pair {
    /// Pairs of a segment, but the one for the sky.
    const COUNT: u32 = 4;

    pub fn of(self, path: &Path) -> [f32; 2] {
        // The last pairs there are, so that the others are the same with and without an environment.
        if let Pair::Sky = self {
            return path.sampler.get_2d(u32::MAX - path.segment);
        }
        // Pair 0 of the path is the place in the pixel.
        path.sampler.get_2d(1 + path.segment * Pair::COUNT + self as u32)
    }
}
