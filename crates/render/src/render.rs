//! From a world and parameters to a picture: tiles in parallel, each in waves.

use crate::{
    camera::CameraPaths,
    film::Film,
    integrator::{AmbientOcclusion, DirectLight, Normals, PathTracer, Shader},
    lights::{AreaLights, PunctualLights},
    material::Materials,
    params::{Integrator, RenderError, RenderParams},
    photon::{Lit, render_passes},
    sampling::power_heuristic,
    sky::{SkyLight, lighting},
    unfinished::Unfinished,
    wave::{Path, Tile, Wave, WaveContext},
    world::World,
};
use raystrips_tracer::OpenError;
use std::{
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
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
    /// Rays with which paths went on, and those of photons.
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
    /// Finding where rays probably hit, summed over threads.
    pub approximate: f64,
    /// Giving rays their places and sorting them, summed over threads.
    pub sort: f64,
    /// In the world's ray queries, summed over threads.
    pub trace: f64,
    /// Shading and adding up, summed over threads.
    pub shade: f64,
    /// Waiting for pages, summed over threads.
    pub wait: f64,
}

impl RenderStats {
    /// Counts a ray with which a path goes on.
    pub(crate) fn count(&mut self, path: &Path) {
        *(if path.is_shadow() { &mut self.shadow } else { &mut self.secondary }) += 1;
    }

    pub(crate) fn add(&mut self, other: &RenderStats) {
        self.primary += other.primary;
        self.shadow += other.shadow;
        self.secondary += other.secondary;
        self.seconds.generate += other.seconds.generate;
        self.seconds.approximate += other.seconds.approximate;
        self.seconds.sort += other.seconds.sort;
        self.seconds.trace += other.seconds.trace;
        self.seconds.shade += other.seconds.shade;
        self.seconds.wait += other.seconds.wait;
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

/// Asked and told while a picture is made.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// True when what is under way is to be finished and nothing else is to be begun. Asked often, by any thread.
    pub is_due: &'a (dyn Fn() -> bool + Sync),
    /// Told how far it has come, now and then, by one thread at a time.
    pub progress: &'a (dyn Fn(RenderProgress) + Sync),
}

impl RenderProgress {
    /// The same of a picture that it is part of.
    pub(crate) fn of_picture(self, params: &RenderParams) -> RenderProgress {
        let samples_total = RenderProgress::of(&RenderStats::default(), params).samples_total;
        RenderProgress { samples_total, ..self }
    }

    pub(crate) fn of(stats: &RenderStats, params: &RenderParams) -> RenderProgress {
        let &RenderStats { primary, shadow, secondary, .. } = stats;
        RenderProgress {
            samples_done: primary,
            samples_total: u64::from(params.width) * u64::from(params.height) * u64::from(params.spp),
            rays: primary + shadow + secondary,
        }
    }
}

/// Renders a picture. `progress` is called after each tile, by one thread at a time.
///
/// # Errors
/// Where the size, the samples or the camera are of no use, no threads can be started, or the world cannot answer.
pub fn render(
    world: &dyn World,
    params: &RenderParams,
    progress: &(dyn Fn(RenderProgress) + Sync),
) -> Result<RenderOutput, RenderError> {
    let watch = Watch { is_due: &|| false, progress };
    Ok(render_tiles(world, params, Unfinished::new(params), &watch)?.into_output())
}

/// Renders a picture tile by tile, from where it was left until it is finished or `watch` wants a pause.
///
/// # Errors
/// As of [`render`].
pub fn render_tiles(
    world: &dyn World,
    params: &RenderParams,
    begin: Unfinished,
    watch: &Watch,
) -> Result<Unfinished, RenderError> {
    with_shader(world, params, begin, watch, &|part| {
        let tiles = Tile::cover(part.params.width, part.params.height);
        render_given_tiles(world, &tiles, part)
    })
}

/// Paths that are to be followed: a picture, or part of the work for one.
pub(crate) struct Part<'a> {
    pub params: &'a RenderParams,
    pub shader: &'a dyn Shader,
    pub materials: &'a Materials,
    pub begin: Unfinished,
    pub watch: &'a Watch<'a>,
}

/// Renders with the shader that the parameters ask for. `drive` follows its paths.
pub(crate) fn with_shader(
    world: &dyn World,
    params: &RenderParams,
    begin: Unfinished,
    watch: &Watch,
    drive: &dyn Fn(Part) -> Result<Unfinished, RenderError>,
) -> Result<Unfinished, RenderError> {
    params.validate()?;
    let description = world.description();
    let materials = Materials::new(description);
    let environment = params.environment.as_deref();
    let (lights, sky) = lighting(description, params.default_light && environment.is_none());
    let sky = environment.map_or(SkyLight::Smooth(sky), SkyLight::Environment);
    let camera = CameraPaths::new(params, world)?;
    let shader: Box<dyn Shader> = match params.integrator {
        Integrator::Path => {
            let direct = DirectLight {
                area_lights: AreaLights::new(world.emitters(), &materials),
                punctual_lights: PunctualLights::new(&lights),
                weight: power_heuristic,
                sky,
                sky_weight: power_heuristic,
            };
            Box::new(PathTracer::new(camera, direct, params.max_bounces))
        }
        Integrator::Photon => {
            let lit = Lit { world, materials: &materials, lights: &lights, sky };
            return render_passes(&lit, params, begin, watch, drive);
        }
        Integrator::Ao => Box::new(AmbientOcclusion::new(camera, &world.bounds())),
        Integrator::Normal => Box::new(Normals { camera }),
    };
    drive(Part { params, shader: &*shader, materials: &materials, begin, watch })
}

/// Renders the tiles from where it was left; threads take them in the order given.
pub(crate) fn render_given_tiles(
    world: &dyn World,
    tiles: &[Tile],
    part: Part,
) -> Result<Unfinished, RenderError> {
    let start = Instant::now();
    let Part { params, shader, materials, begin, watch } = part;
    let context = WaveContext { world, params, materials, shader };

    let pool = rayon::ThreadPoolBuilder::new().num_threads(params.threads).build()?;
    let next_tile = AtomicU64::new(begin.next.min(tiles.len() as u64));
    let end = AtomicU64::new(tiles.len() as u64);
    let output = Mutex::new(begin.output);
    let outcomes = pool.broadcast(|_| {
        let mut wave = Wave::default();
        while let Some(number) = take_number(&next_tile, &end) {
            let tile = &tiles[number as usize];
            let outcome = wave.render_tile(&context, tile);
            // The others need not go on when one failed.
            let (tile_film, tile_stats) = outcome.inspect_err(|_| end.store(0, Ordering::Relaxed))?;
            let mut output = output.lock().expect("no thread panics while it holds the film");
            output.film.add_tile(tile.x, tile.y, &tile_film);
            output.stats.add(&tile_stats);
            (watch.progress)(RenderProgress::of(&output.stats, params));
            if (watch.is_due)() {
                end.store(0, Ordering::Relaxed);
            }
        }
        Ok(())
    });
    outcomes.into_iter().collect::<Result<(), OpenError>>()?;
    let mut output = output.into_inner().expect("no thread panics while it holds the film");
    output.stats.seconds.total += start.elapsed().as_secs_f64();
    let next = next_tile.into_inner();
    Ok(Unfinished { output, next, is_finished: next == tiles.len() as u64 })
}

/// The next number below `end`.
pub(crate) fn take_number(next: &AtomicU64, end: &AtomicU64) -> Option<u64> {
    let end = end.load(Ordering::Relaxed);
    next.try_update(Ordering::Relaxed, Ordering::Relaxed, |n| (n < end).then_some(n + 1)).ok()
}
