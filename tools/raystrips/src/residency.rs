//! How a pack is rendered in the memory that there is.

use crate::args::{HitProxyName, ReorderName};
use crate::units::bytes;
use anyhow::{Context, Result, bail};
use raystrips_extmem::spare_memory;
use raystrips_pack::Pack;
use raystrips_render::{
    Film, ORDERED_THREAD_BYTES, QUEUED_PAGE_BYTES, QUEUED_THREAD_BYTES, WRITTEN_PIXEL_BYTES,
};
use raystrips_tracer::{PagePool, ProxyKind};
use std::fs::File;
use std::path::Path;

/// Memory of a rendering apart from all that is named below. Measured.
const BASE_BYTES: u64 = 12 << 20;
/// Memory of each thread when all pages are in memory.
const THREAD_BYTES: u64 = 8 << 20;
/// Part of the memory for pages and rays that is for rays.
const RAY_PART: f64 = 0.3;
/// The same for rays that are sorted, if not all pages are in memory: what has no room is written and read in runs, which
/// costs less than pages that have none.
const SORTED_RAY_PART: f64 = 0.08;
/// More rays than fit here do not wait longer for their pages.
const MOST_RAY_BYTES: u64 = 512 << 20;
/// Least pages in memory, of the largest size: some a thread, and those that are read.
const LEAST_PAGES: u64 = 64;
/// Part of the memory for pages and rays that is for attributes and images, if they do not fit in less.
const SIDE_PART: u64 = 4;
/// Least memory for rays that wait.
const LEAST_RAY_BYTES: u64 = 8 << 20;

/// Where the pages of a pack are while it is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Residency {
    /// All in memory.
    Whole { ray_bytes: u64 },
    /// Some in memory.
    Paged(Shares),
}

/// How memory is divided when only some pages are in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shares {
    /// For pages, and rays that wait.
    pub page_bytes: u64,
    /// Of these, for rays.
    pub ray_bytes: u64,
    /// For attributes and images.
    pub side_bytes: u64,
    /// For pages while photons do not need it.
    pub photon_bytes: u64,
}

/// What is to be rendered.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Memory of the process, if that was given.
    pub memory: Option<u64>,
    pub reorder: ReorderName,
    pub pixels: u64,
    /// With albedo and normal.
    pub aovs: bool,
    pub threads: u64,
    /// For photons.
    pub photon_bytes: u64,
    /// For an environment.
    pub environment_bytes: u64,
    /// What is to find approximate hit points, if they are needed.
    pub hit_proxy: Option<HitProxyName>,
}

/// The proxy of the pack that is meant, or the next best.
pub fn hit_proxy(pack: &Pack, name: HitProxyName) -> Option<ProxyKind> {
    let kinds = match name {
        HitProxyName::Coarse => [ProxyKind::Coarse, ProxyKind::Fine],
        HitProxyName::Fine => [ProxyKind::Fine, ProxyKind::Coarse],
        HitProxyName::None => return None,
    };
    kinds.into_iter().find(|&kind| pack.proxy(kind).is_some())
}

/// Decides how the pack at `path` is rendered.
pub fn of(path: &Path, asked: &Asked) -> Result<Residency> {
    let Asked { memory, reorder, pixels, aovs, threads, photon_bytes, environment_bytes, .. } = *asked;
    let pack =
        File::open(path).map_err(raystrips_pack::PackError::from).and_then(|mut file| Pack::open(&mut file));
    let pack = pack.with_context(|| path.display().to_string())?;
    let proxy = asked.hit_proxy.and_then(|name| hit_proxy(&pack, name)).and_then(|kind| pack.proxy(kind));
    let proxy_bytes = proxy.map_or(0, |(_, bytes)| bytes);
    let taken =
        BASE_BYTES + pixels * Film::pixel_bytes(aovs) + proxy_bytes + photon_bytes + environment_bytes;
    let given = memory.or_else(spare_memory).unwrap_or(u64::MAX);
    let rays = if matches!(reorder, ReorderName::None | ReorderName::Auto) { 0 } else { LEAST_RAY_BYTES };
    let in_memory = pack.file_bytes + pack.shading.tile_bytes();
    let whole = taken + threads * THREAD_BYTES + pixels * WRITTEN_PIXEL_BYTES + in_memory + rays;
    let for_rays =
        |bytes: u64, part: f64| ((bytes as f64 * part) as u64).clamp(LEAST_RAY_BYTES, MOST_RAY_BYTES);
    let is_whole = match reorder {
        ReorderName::Queues | ReorderName::Chunks => false,
        _ => whole <= given,
    };
    if is_whole {
        return Ok(Residency::Whole { ray_bytes: for_rays(given.saturating_sub(whole), RAY_PART) });
    }
    let pages = pack.directory.len() as u64;
    let (for_order, ray_part) = match reorder {
        ReorderName::Auto | ReorderName::Queues | ReorderName::Chunks => {
            (threads * QUEUED_THREAD_BYTES + pages * QUEUED_PAGE_BYTES, RAY_PART)
        }
        _ => (threads * ORDERED_THREAD_BYTES, SORTED_RAY_PART),
    };
    let taken = taken + for_order + PagePool::resident_bytes(&pack);
    // The pages are gone when the picture is written.
    let least_side = PagePool::least_side_bytes(&pack);
    let least_shared = (LEAST_PAGES * PagePool::frame_bytes(&pack) + LEAST_RAY_BYTES + least_side)
        .max(pixels * WRITTEN_PIXEL_BYTES);
    if given < taken + least_shared {
        bail!(
            "{}: {} of memory is too little for this picture; use --memory {}M",
            path.display(),
            bytes(given),
            (taken + least_shared).div_ceil(1 << 20)
        );
    }
    let shared = given - taken;
    let side_bytes = (shared / SIDE_PART).min(2 * pack.shading.bytes()).max(least_side);
    let page_bytes = shared - side_bytes;
    let ray_bytes = for_rays(page_bytes, ray_part);
    Ok(Residency::Paged(Shares { page_bytes, ray_bytes, side_bytes, photon_bytes }))
}
