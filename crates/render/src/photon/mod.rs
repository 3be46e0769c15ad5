//! Photon mapping (Jensen 1996): photons are sent out from the lights and kept where they land; what lamps send straight to a
//! surface is found by shadow rays, what comes to it through glass or from mirrors by the caustic photons there, and all
//! else by final gathering: one ray or some to other surfaces, whose light is that of the photons around there.
//!
//! So each kind of path from a light L by smooth surfaces S, glossy ones G and diffuse ones D to the eye E is found once (in
//! the notation of Heckbert 1990):
//!
//! | path | found by |
//! |---|---|
//! | `L (S or G)* E` | following the path from the eye |
//! | `L D (S or G)* E` | shadow rays; directions too of a sky |
//! | `L (S or G)+ D (S or G)* E` | caustic photons |
//! | `L ... D (S or G)* D (S or G)* E` | gathering from the photons of all kinds at the first of these D |
//!
//! G is a surface that reflects nothing diffusely and is narrower than a width ([`Bsdf::is_diffuse`](crate::bsdf::Bsdf)),
//! for photons and paths alike, so that none is missing and none is found twice. Lamps with a texture send out no photons:
//! a path that gathers goes on until it finds them.
//!
//! Of the light of strands photons tell nothing, since around these there are no discs with photons: a path that meets one
//! finds there what lamps send straight to it, and goes on until it meets a surface, whose photons may have come by more
//! reflections than are asked for in all.
//!
//! Photons are the paths of a picture of their own, so their rays go the way that all rays go: as they come, sorted, or from
//! page to page. Passes with photons of their own share the samples of a pixel, so photons of one pass alone are in memory.

mod emission;
mod gather;
mod map;
mod packed;
mod tracer;

use crate::{
    camera::CameraPaths,
    integrator::DirectLight,
    lights::{AreaLights, PunctualLights},
    material::Materials,
    params::{RenderError, RenderParams},
    render::{Part, RenderProgress, Watch},
    sampling::power_heuristic,
    sky::SkyLight,
    unfinished::Unfinished,
    world::World,
};
use emission::Emission;
use gather::Gather;
use raystrips_geom::scene::Light;
use tracer::PhotonTracer;

/// How photons are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotonParams {
    /// Photons sent out in a pass, rounded up to a multiple of 1024.
    pub count: u64,
    /// Photons of an estimate.
    pub nearest: u32,
    /// Passes, each with photons of its own; no more than there are samples.
    pub passes: u32,
    /// Rays that gather light at each diffuse surface seen, 1 to [`MAX_GATHER_RAYS`].
    pub gather_rays: u32,
}

/// Most rays that gather light at a surface.
pub const MAX_GATHER_RAYS: u32 = 64;

impl Default for PhotonParams {
    fn default() -> PhotonParams {
        PhotonParams { count: 100_000, nearest: 100, passes: 4, gather_rays: 1 }
    }
}

impl PhotonParams {
    /// Most bytes of memory that the photons of a pass take.
    pub fn bytes(&self, max_bounces: u32) -> u64 {
        let (_, sent) = self.grid();
        // Lists grow by doubling.
        sent * u64::from(max_bounces + 1) * 2 * tracer::KEPT_BYTES
    }

    /// Samples of each pixel of the picture whose paths are photons, and photons in all.
    fn grid(&self) -> (u32, u64) {
        let pixels = u64::from(SIDE * SIDE);
        let spp = self.count.div_ceil(pixels).clamp(1, u64::from(crate::MAX_SPP)) as u32;
        (spp, u64::from(spp) * pixels)
    }
}

/// Side of the picture whose paths are photons.
const SIDE: u32 = 32;
/// The allocator keeps this part of what photons no longer need, at about.
const ALLOCATOR_PART: u64 = 3;
/// Work of a pass has numbers of so many bits.
const PASS_BITS: u32 = 40;
/// No estimate is made from photons farther than this part of the scene's diagonal.
const MOST_RADIUS: f32 = 0.05;

/// What is lit, and by what.
pub(crate) struct Lit<'a> {
    pub world: &'a dyn World,
    pub materials: &'a Materials,
    pub lights: &'a [Light],
    pub sky: SkyLight<'a>,
}

/// Renders all passes, from where it was left until it is finished or `watch` wants a pause. `drive` finds the light of the
/// paths of a shader.
pub(crate) fn render_passes(
    lit: &Lit,
    params: &RenderParams,
    begin: Unfinished,
    watch: &Watch,
    drive: &dyn Fn(Part) -> Result<Unfinished, RenderError>,
) -> Result<Unfinished, RenderError> {
    let passes = params.photons.passes.clamp(1, params.spp);
    let (mut pass, mut next) = ((begin.next >> PASS_BITS) as u32, begin.next & ((1 << PASS_BITS) - 1));
    let mut output = begin.output;
    let paused = |output, pass: u32, next: u64| {
        Ok(Unfinished { output, next: u64::from(pass) << PASS_BITS | next, is_finished: false })
    };
    while pass < passes {
        // While photons are sent out nobody knows how many will land.
        let mut memory = lit.world.lend(params.photons.bytes(params.max_bounces));
        let gather = send_photons(lit, params, pass, drive, &mut output.stats)?;
        if let Some(memory) = &mut memory {
            let freed = memory.bytes().saturating_sub(gather.bytes());
            memory.shrink(gather.bytes() + freed / ALLOCATOR_PART);
        }
        let samples =
            [pass, pass + 1].map(|p| (u64::from(p) * u64::from(params.spp) / u64::from(passes)) as u32);
        let camera = CameraPaths::new(params, lit.world)?.starting_at(samples[0]);
        let of_pass = RenderParams { spp: samples[1] - samples[0], ..params.clone() };
        let progress = |told: RenderProgress| (watch.progress)(told.of_picture(params));
        let done = drive(Part {
            params: &of_pass,
            shader: &gather.with_camera(camera),
            materials: lit.materials,
            begin: Unfinished { output, next, is_finished: false },
            watch: &Watch { is_due: watch.is_due, progress: &progress },
        })?;
        output = done.output;
        if !done.is_finished {
            return paused(output, pass, done.next);
        }
        (pass, next) = (pass + 1, 0);
    }
    Ok(Unfinished { output, next: u64::from(pass) << PASS_BITS, is_finished: true })
}

/// Sends out the photons of a pass. A pause has to wait for that: half of them are of no use.
fn send_photons<'a>(
    lit: &Lit<'a>,
    params: &RenderParams,
    pass: u32,
    drive: &dyn Fn(Part) -> Result<Unfinished, RenderError>,
    stats: &mut crate::RenderStats,
) -> Result<Gather<'a>, RenderError> {
    let (spp, sent) = params.photons.grid();
    let seed = photon_seed(params.seed, pass);
    let photon_params = RenderParams { width: SIDE, height: SIDE, spp, seed, aovs: false, ..params.clone() };
    let area_lights = || AreaLights::new(lit.world.emitters(), lit.materials);
    let emission = Emission::new(area_lights(), lit.lights, lit.sky, &lit.world.bounds());
    let tracer = PhotonTracer::new(emission, seed, params.max_bounces);
    let done = drive(Part {
        params: &photon_params,
        shader: &tracer,
        materials: lit.materials,
        begin: Unfinished::new(&photon_params),
        watch: &Watch { is_due: &|| false, progress: &|_| () },
    })?;
    let mut photon_stats = done.output.stats;
    photon_stats.secondary += std::mem::take(&mut photon_stats.primary);
    stats.add(&photon_stats);
    stats.seconds.total += photon_stats.seconds.total;
    let estimate = (params.photons.nearest, MOST_RADIUS * lit.world.bounds().diagonal());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(params.threads).build()?;
    let maps = pool.install(|| tracer.into_maps(1.0 / sent as f32, estimate));
    // What lamps send straight here is not looked for in any other way.
    let direct = DirectLight {
        area_lights: area_lights(),
        punctual_lights: PunctualLights::new(lit.lights),
        weight: |_, _| 1.0,
        sky: lit.sky,
        sky_weight: power_heuristic,
    };
    let mut of_scene = lit.world.description().materials.iter();
    let has_textured_lamps = of_scene.any(|material| material.is_emissive() && !material.is_lamp());
    let rays = params.photons.gather_rays.clamp(1, MAX_GATHER_RAYS);
    Ok(Gather::new(maps, estimate, rays, direct, has_textured_lamps, params.max_bounces))
}

/// Photons have random numbers of their own in every pass.
fn photon_seed(seed: u64, pass: u32) -> u64 {
    (seed ^ 0x7068_6f74_6f6e).wrapping_add(u64::from(pass) << 32)
}
