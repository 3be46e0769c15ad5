//! What to render and how, and what can be wrong with it.

use crate::environment::Environment;
use crate::photon::PhotonParams;
use raystrips_geom::scene::Camera;
use std::{fmt, sync::Arc};
use thiserror::Error;

/// Most pixels along a side of a picture.
pub const MAX_EXTENT: u32 = 1 << 16;

/// Most samples a pixel: the film's sums hold eight contributions of the greatest size for each.
pub const MAX_SPP: u32 = 1 << 20;

/// How the value of a pixel is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Light, by path tracing.
    #[default]
    Path,
    /// Light, by photon mapping.
    Photon,
    /// Ambient occlusion: the cosine-weighted share of directions in which nothing is within a quarter of the
    /// diagonal of the scene. The background is white.
    Ao,
    /// (n + 1) / 2 of the geometric normal on the side of the viewer. The background is black.
    Normal,
}

impl Integrator {
    /// Whether pixels hold light, which has no greatest value, or data.
    pub fn is_light(self) -> bool {
        matches!(self, Integrator::Path | Integrator::Photon)
    }
}

impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Integrator::Path => "path",
            Integrator::Photon => "photon",
            Integrator::Ao => "ao",
            Integrator::Normal => "normal",
        })
    }
}

/// What to render and how. All but `threads` decide on the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderParams {
    /// What a pixel shows.
    pub integrator: Integrator,
    /// Pixels in a row, 1 to [`MAX_EXTENT`].
    pub width: u32,
    /// Rows, 1 to [`MAX_EXTENT`].
    pub height: u32,
    /// Samples a pixel, 1 to [`MAX_SPP`]; powers of two are best distributed.
    pub spp: u32,
    /// Another seed gives other noise.
    pub seed: u64,
    /// Threads to use; 0 for one each core.
    pub threads: usize,
    /// `None`: the first camera of the scene, else one that shows all of it.
    pub camera: Option<Camera>,
    /// Surfaces that a path is reflected by at most, for [`Integrator::Path`]
    /// and photons: 1 is direct light, 0 shows lights
    /// and sky only.
    pub max_bounces: u32,
    /// For [`Integrator::Photon`].
    pub photons: PhotonParams,
    /// Takes the place of the sky.
    pub environment: Option<Arc<Environment>>,
    /// Light scenes that have no light of their own by a sun and a sky.
    pub default_light: bool,
    /// Fill the film's albedo and normal.
    pub aovs: bool,
}

impl Default for RenderParams {
    fn default() -> RenderParams {
        RenderParams {
            integrator: Integrator::Path,
            width: 1024,
            height: 768,
            spp: 64,
            seed: 0,
            threads: 0,
            camera: None,
            max_bounces: 8,
            photons: PhotonParams::default(),
            environment: None,
            default_light: true,
            aovs: true,
        }
    }
}

impl RenderParams {
    pub(crate) fn validate(&self) -> Result<(), RenderError> {
        let extent = 1..=MAX_EXTENT;
        if !extent.contains(&self.width) || !extent.contains(&self.height) {
            return Err(RenderError::Size { width: self.width, height: self.height });
        }
        if !(1..=MAX_SPP).contains(&self.spp) {
            return Err(RenderError::Spp { spp: self.spp });
        }
        Ok(())
    }

    /// Width over height.
    pub(crate) fn aspect(&self) -> f32 {
        self.width as f32 / self.height as f32
    }
}

/// Why nothing was rendered.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The picture is empty or too large.
    #[error("a picture of {width}x{height} pixels: each side must have 1 to {MAX_EXTENT}")]
    Size {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// No samples or too many.
    #[error("{spp} samples a pixel: choose 1 to {MAX_SPP}")]
    Spp {
        /// Samples a pixel.
        spp: u32,
    },
    /// The camera sees nothing.
    #[error("camera {name:?} {problem}")]
    Camera {
        /// The camera's name.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The system gave no threads.
    #[error("cannot start the render threads")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A page cannot be read or is damaged.
    #[error(transparent)]
    Page(#[from] raystrips_tracer::OpenError),
    /// Rays that wait cannot be written to the scratch folder, or read from it.
    #[error("{}: {source}; make room there, or give another --scratch", folder.display())]
    Scratch {
        /// The folder.
        folder: std::path::PathBuf,
        /// What is wrong.
        source: std::io::Error,
    },
}
