//! From a world and parameters to a picture: tiles in parallel, each in waves.

use crate::{
    camera::{CameraRays, frame_bounds},
    film::Film,
    integrator::{AmbientOcclusion, Normals, PathTracer, Shader},
    lights::{AreaLights, PunctualLights},
    material::Materials,
    params::{Integrator, RenderError, RenderParams},
    sky::lighting,
    wave::{Tile, Wave, WaveContext},
    world::World,
};
use std::{
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};

/// A finished picture.
#[derive(Clone, Debug)]
pub struct RenderOutput {
    /// The picture.
    pub film: Film,
    /// What it took.
    pub stats: RenderStats,
}

/// Counts and times of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RenderStats {
    /// Rays from the camera.
    pub primary: u64,
    /// Rays that ask whether a light is seen.
    pub shadow: u64,
    /// Rays with which paths went on.
    pub secondary: u64,
    /// Where the time went.
    pub seconds: StageSeconds,
}

/// Seconds by stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// From start to end.
    pub total: f64,
    /// Making camera rays, summed over threads.
    pub generate: f64,
    /// In the world's ray queries, summed over threads.
    pub trace: f64,
    /// Shading and adding up, summed over threads.
    pub shade: f64,
}

impl RenderStats {
    fn add(&mut self, other: &RenderStats) {
        self.primary += other.primary;
        self.shadow += other.shadow;
        self.secondary += other.secondary;
        self.seconds.generate += other.seconds.generate;
        self.seconds.trace += other.seconds.trace;
        self.seconds.shade += other.seconds.shade;
    }
}

/// How far a picture has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderProgress {
    /// Samples finished.
    pub samples_done: u64,
    /// Samples of the whole picture.
    pub samples_total: u64,
    /// Rays of all kinds traced so far.
    pub rays: u64,
}

/// Renders a picture. `progress` is called after each tile, by one thread at a time.
///
/// # Errors
/// Where the size, the samples or the camera are of no use, or no threads can be started.
pub fn render(
    world: &dyn World,
    params: &RenderParams,
    progress: &(dyn Fn(RenderProgress) + Sync),
) -> Result<RenderOutput, RenderError> {
    params.validate()?;
    let description = world.description();
    let materials = Materials::new(description);
    let (lights, sky) = lighting(description, params.default_light);
    let run = |shader: &dyn Shader| {
        let tiles = Tile::cover(params.width, params.height);
        render_tiles(world, params, &materials, shader, &tiles, progress)
    };
    match params.integrator {
        Integrator::Path => run(&PathTracer::new(
            AreaLights::new(world.emitters(), &materials),
            PunctualLights::new(&lights),
            sky,
            params.max_bounces,
        )),
        Integrator::Ao => run(&AmbientOcclusion::new(&world.bounds())),
        Integrator::Normal => run(&Normals),
    }
}

/// Renders the tiles; threads take them in the order given.
pub(crate) fn render_tiles(
    world: &dyn World,
    params: &RenderParams,
    materials: &Materials,
    shader: &dyn Shader,
    tiles: &[Tile],
    progress: &(dyn Fn(RenderProgress) + Sync),
) -> Result<RenderOutput, RenderError> {
    let start = Instant::now();
    let camera = params.camera.as_ref().or(world.description().cameras.first()).cloned();
    let camera = camera.unwrap_or_else(|| frame_bounds(&world.bounds(), params.aspect()));
    let camera = CameraRays::new(&camera, params.aspect())?;
    let context = WaveContext { world, params, camera: &camera, materials, shader };

    let samples_total = u64::from(params.width) * u64::from(params.height) * u64::from(params.spp);
    let film = Film::new(params.width, params.height, params.aovs);
    let output = Mutex::new(RenderOutput { film, stats: RenderStats::default() });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(params.threads).build()?;
    let next_tile = AtomicUsize::new(0);
    pool.broadcast(|_| {
        let mut wave = Wave::default();
        while let Some(tile) = tiles.get(next_tile.fetch_add(1, Ordering::Relaxed)) {
            let (tile_film, tile_stats) = wave.render_tile(&context, tile);
            let mut output = output.lock().expect("no thread panics while it holds the film");
            output.film.paste(tile.x, tile.y, &tile_film);
            output.stats.add(&tile_stats);
            let RenderStats { primary, shadow, secondary, .. } = output.stats;
            progress(RenderProgress {
                samples_done: primary,
                samples_total,
                rays: primary + shadow + secondary,
            });
        }
    });
    let mut output = output.into_inner().expect("no thread panics while it holds the film");
    output.stats.seconds.total = start.elapsed().as_secs_f64();
    Ok(output)
}
