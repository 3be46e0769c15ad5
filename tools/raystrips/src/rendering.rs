//! Renders a pack: where its pages are, and in which order rays are traced.

use crate::args::{CurveName, IntegratorName, RenderArgs, ReorderName};
use crate::camera;
use crate::files::extension;
use crate::residency::{self, Asked, Residency, Shares};
use crate::unfinished::{Keeping, Numbering};
use crate::units::grouped;
use anyhow::{Result, bail};
use raystrips_extmem::refuse_huge_pages;
use raystrips_pack::{Manifest, Pack};
use raystrips_render::{
    Curve, Environment, EnvironmentFile, HitPoints, Integrator, OrderParams, Ordering, PagedWorld,
    PhotonParams, QueueParams, RenderOutput, RenderParams, Schedule, TracedWorld, World, render_ordered,
    render_queued, render_tiles,
};
use raystrips_tracer::{GeometryBounds, PagePool, PoolCounts, Scene};
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// Pages go when the process has all of its memory but this part: what an allocator keeps grows slowly, and the system counts
/// tables of its own, too.
const SPARE_PART: u64 = 32;
/// Bytes of a chunk (Moon et al. 2010, section 6.1), and the part of the memory for pages that one may take.
const CHUNK_BYTES: u64 = 32 << 20;
const CHUNK_PART: u64 = 4;

/// A picture, and how it was made.
pub struct Rendered {
    pub params: RenderParams,
    pub output: RenderOutput,
    pub pages: Pages,
}

/// What was read of the pack.
pub struct Pages {
    pub counts: PoolCounts,
    pub triangles: u64,
    pub ordering: &'static str,
}

impl Pages {
    fn of_scene(scene: &Scene, ordering: &'static str) -> Pages {
        let counts = PoolCounts {
            read: scene.manifest().pages,
            bytes_read: scene.page_bytes(),
            ..PoolCounts::default()
        };
        Pages { counts, triangles: scene.manifest().primitives, ordering }
    }

    fn of_pool(pool: &PagePool, ordering: &'static str) -> Pages {
        Pages { counts: pool.counts(), triangles: pool.pack().manifest.primitives, ordering }
    }
}

/// Renders the pack at `path` as it is asked for.
pub fn run(
    path: &Path,
    args: &RenderArgs,
    environment: Option<&EnvironmentFile>,
    keeping: &Keeping,
) -> Result<Rendered> {
    let threads = if args.threads == 0 { std::thread::available_parallelism()?.get() } else { args.threads };
    let asked = Asked {
        memory: args.convert.source.memory,
        reorder: args.reorder,
        pixels: u64::from(args.size.0) * u64::from(args.size.1),
        aovs: has_aovs(args),
        threads: threads as u64,
        photon_bytes: match args.integrator {
            IntegratorName::Photon => photons(args).bytes(args.bounces),
            _ => 0,
        },
        environment_bytes: environment.map_or(0, EnvironmentFile::bytes),
        hit_proxy: ordering(args.reorder).filter(|(o, _)| o.needs_hit_points()).map(|_| args.hit_proxy),
    };
    let scratch = args.convert.source.scratch.as_deref();
    if let Some(missing) = scratch.filter(|folder| ordering(args.reorder).is_some() && !folder.is_dir()) {
        bail!("{}: no such folder for scratch files", missing.display());
    }
    let residency = residency::of(path, &asked)?;
    let environment = environment.map(|file| read_environment(file, args)).transpose()?;
    let params = |manifest: &Manifest| params(args, environment.clone(), manifest);
    match residency {
        Residency::Whole { ray_bytes } => {
            let world = TracedWorld::new(Scene::open(path)?);
            let params = params(world.scene().manifest())?;
            let output = match ordering(args.reorder) {
                None | Some((Ordering::None, _)) => {
                    let kept = (world.scene().pack(), Numbering::Tiles);
                    keeping.to_the_end(&params, kept, |begin, watch| {
                        render_tiles(&world, &params, begin, watch)
                    })?
                }
                Some((ordering, _)) => {
                    let geometries = world.scene().geometry_bounds();
                    let hit_points = hit_points(path, args, ordering, geometries, &world)?;
                    let buffer_bytes = args.ray_buffer.unwrap_or(ray_bytes).min(ray_bytes);
                    let order = order_params(args, ordering, buffer_bytes, hit_points.as_ref());
                    let order = OrderParams { scratch: None, ..order };
                    let kept = (world.scene().pack(), Numbering::Batches);
                    keeping.to_the_end(&params, kept, |begin, watch| {
                        render_ordered(&world, &params, &order, begin, watch)
                    })?
                }
            };
            let name = ordering(args.reorder).map_or("none", |(_, name)| name);
            Ok(Rendered { params, output, pages: Pages::of_scene(world.scene(), name) })
        }
        Residency::Paged(shares) => {
            refuse_huge_pages();
            let Some((ordering, name)) = ordering(args.reorder) else {
                return queued(path, args, &params, shares, keeping);
            };
            let Shares { page_bytes, ray_bytes, side_bytes, photon_bytes } = shares;
            let buffer_bytes = match ordering {
                Ordering::None => 0,
                _ => args.ray_buffer.unwrap_or(ray_bytes).min(page_bytes / 2),
            };
            let pool_bytes = page_bytes - buffer_bytes + photon_bytes;
            let world =
                PagedWorld::new(PagePool::open(path, pool_bytes, side_bytes)?).within(process_bytes(args));
            let pack = world.pool().pack();
            let params = params(&pack.manifest)?;
            let hit_points = hit_points(path, args, ordering, &pack.geometry_bounds, &world)?;
            let order = order_params(args, ordering, buffer_bytes, hit_points.as_ref());
            let mut output = match ordering {
                Ordering::None => keeping.to_the_end(&params, (pack, Numbering::Tiles), |begin, watch| {
                    render_tiles(&world, &params, begin, watch)
                })?,
                _ => keeping.to_the_end(&params, (pack, Numbering::Batches), |begin, watch| {
                    render_ordered(&world, &params, &order, begin, watch)
                })?,
            };
            // It was waited for within the tracing of rays.
            let waited = world.waited().as_secs_f64();
            output.stats.seconds.wait += waited;
            output.stats.seconds.trace -= waited;
            Ok(Rendered { params, output, pages: Pages::of_pool(world.pool(), name) })
        }
    }
}

/// Renders with rays that wait for pages or for chunks of pages.
fn queued(
    path: &Path,
    args: &RenderArgs,
    params: &dyn Fn(&Manifest) -> Result<RenderParams>,
    Shares { page_bytes, ray_bytes, side_bytes, photon_bytes }: Shares,
    keeping: &Keeping,
) -> Result<Rendered> {
    // The many rays of a chunk are served together, which takes memory of its own.
    let part = |bytes: u64| if args.reorder == ReorderName::Chunks { bytes / 4 * 3 } else { bytes };
    let (page_bytes, ray_bytes) = (part(page_bytes), part(ray_bytes));
    let world = PagedWorld::new(PagePool::open(path, page_bytes + photon_bytes, side_bytes)?);
    let params = params(&world.pool().pack().manifest)?;
    let process_bytes = process_bytes(args);
    let (paging, name) = match args.reorder {
        ReorderName::Chunks => {
            let read_bytes = CHUNK_BYTES.min(page_bytes / CHUNK_PART);
            (QueueParams { ray_bytes, process_bytes, read_bytes, schedule: Schedule::Benefit }, "chunks")
        }
        _ => {
            let read_bytes = world.pool().probe()?;
            (QueueParams { ray_bytes, process_bytes, read_bytes, schedule: Schedule::Longest }, "queues")
        }
    };
    let kept = (world.pool().pack(), Numbering::Batches);
    let output = keeping
        .to_the_end(&params, kept, |begin, watch| render_queued(&world, &params, &paging, begin, watch))?;
    Ok(Rendered { params, output, pages: Pages::of_pool(world.pool(), name) })
}

/// For all that the process holds.
fn process_bytes(args: &RenderArgs) -> u64 {
    args.convert.source.memory.map_or(u64::MAX, |memory| memory - memory / SPARE_PART)
}

/// The ordering of generations that was asked for, with its name; `None` where it is none of those.
fn ordering(reorder: ReorderName) -> Option<(Ordering, &'static str)> {
    Some(match reorder {
        ReorderName::Auto | ReorderName::Queues | ReorderName::Chunks => return None,
        ReorderName::None => (Ordering::None, "none"),
        ReorderName::Origin => (Ordering::Origin, "origin"),
        ReorderName::OriginDir => (Ordering::OriginDir, "origin-dir"),
        ReorderName::Hph => (Ordering::Hph, "hph"),
        ReorderName::HphDir => (Ordering::HphDir, "hph-dir"),
        ReorderName::HphOrigin => (Ordering::HphOrigin, "hph-origin"),
    })
}

fn order_params<'a>(
    args: &'a RenderArgs,
    ordering: Ordering,
    buffer_bytes: u64,
    hit_points: Option<&'a HitPoints>,
) -> OrderParams<'a> {
    let beside_output = args.output.parent().filter(|folder| !folder.as_os_str().is_empty());
    OrderParams {
        ordering,
        curve: match args.curve {
            CurveName::Z => Curve::Z,
            CurveName::Hilbert => Curve::Hilbert,
        },
        buffer_bytes,
        scratch: Some(
            args.convert.source.scratch.as_deref().or(beside_output).unwrap_or_else(|| Path::new(".")),
        ),
        hit_points,
    }
}

/// What finds approximate hit points, for orderings that need them: by boxes alone where the pack has no proxy.
fn hit_points(
    path: &Path,
    args: &RenderArgs,
    ordering: Ordering,
    geometries: &[GeometryBounds],
    world: &dyn World,
) -> Result<Option<HitPoints>> {
    if !ordering.needs_hit_points() {
        return Ok(None);
    }
    let proxy = match residency::hit_proxy(&Pack::open(&mut File::open(path)?)?, args.hit_proxy) {
        Some(kind) => Scene::open_proxy(path, kind)?,
        None => None,
    };
    Ok(Some(HitPoints::new(proxy, geometries, &world.bounds())))
}

fn photons(args: &RenderArgs) -> PhotonParams {
    let &RenderArgs { photons: count, photons_nearest: nearest, photon_passes: passes, gather_rays, .. } =
        args;
    PhotonParams { count, nearest, passes, gather_rays }
}

/// PNG has no room for albedo and normal.
fn has_aovs(args: &RenderArgs) -> bool {
    extension(&args.output).as_deref() == Some("exr")
}

/// Reads the environment and says what is wrong with its values.
fn read_environment(file: &EnvironmentFile, args: &RenderArgs) -> Result<Arc<Environment>> {
    let environment = file.read()?.turned(args.env_rotation).scaled(args.env_strength);
    if environment.repaired() > 0 {
        eprintln!(
            "raystrips: warning: {}: {} values are negative or not finite and taken as 0",
            file.path().display(),
            grouped(environment.repaired())
        );
    }
    Ok(Arc::new(environment))
}

fn params(
    args: &RenderArgs,
    environment: Option<Arc<Environment>>,
    manifest: &Manifest,
) -> Result<RenderParams> {
    Ok(RenderParams {
        integrator: match args.integrator {
            IntegratorName::Path => Integrator::Path,
            IntegratorName::Photon => Integrator::Photon,
            IntegratorName::Ao => Integrator::Ao,
            IntegratorName::Normal => Integrator::Normal,
        },
        width: args.size.0,
        height: args.size.1,
        spp: args.spp,
        seed: args.seed,
        threads: args.threads,
        camera: args.camera.as_deref().map(|text| camera::parse(text, manifest)).transpose()?,
        max_bounces: args.bounces,
        photons: photons(args),
        environment,
        aovs: has_aovs(args),
        ..RenderParams::default()
    })
}
