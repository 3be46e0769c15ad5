//! Cameras, lights, samplers, integrators, film and image files.
//!
//! [`render`] makes a picture of a [`World`]; [`write_image`] puts it into a file. Rays are generated, traced and shaded
//! in separate steps over arrays, and every random number and every sum is independent of the order of rays, so the
//! picture is bit-identical for any thread count and ordering. [`render_tiles`] takes rays as they come,
//! [`render_ordered`] sorts them, [`render_queued`] lets them wait for the pages of a [`PagedWorld`]; each goes on from an
//! [`Unfinished`] picture.

mod bsdf;
mod camera;
mod color;
mod deposits;
mod environment;
mod film;
mod hit_points;
mod image;
mod integrator;
mod interaction;
mod layers;
mod lights;
mod material;
mod offset;
mod ordered;
mod paged;
mod params;
mod photon;
mod process_limit;
mod queued;
mod render;
mod sampler;
mod sampling;
mod shadow;
mod sky;
mod starts;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod texture;
mod traced;
mod unfinished;
mod waiting_path;
mod wave;
mod world;

pub use camera::frame_bounds;
pub use environment::{Environment, EnvironmentError, EnvironmentFile, MAX_ENVIRONMENT_PIXELS};
pub use film::{Film, MAX_CONTRIBUTION, WRITTEN_PIXEL_BYTES};
pub use hit_points::HitPoints;
pub use image::{ImageError, ImageOptions, ToneCurve, write_image};
pub use ordered::{ORDERED_THREAD_BYTES, OrderParams, render_ordered};
pub use paged::PagedWorld;
pub use params::{Integrator, MAX_EXTENT, MAX_SPP, RenderError, RenderParams};
pub use photon::{MAX_GATHER_RAYS, PhotonParams};
pub use queued::{QUEUED_PAGE_BYTES, QUEUED_THREAD_BYTES, QueueParams, Schedule, render_queued};
pub use raystrips_reorder::{Curve, Ordering};
pub use render::{RenderOutput, RenderProgress, RenderStats, StageSeconds, Watch, render, render_tiles};
pub use sampler::sample;
pub use traced::TracedWorld;
pub use unfinished::Unfinished;
pub use world::{Emitter, Progress, Surface, World};
