//! Bytes a triangle, speed of conversion, and rays a second on one core, by length of strips.

use crate::clock::thread_time;
use crate::rays::ray_sets;
use anyhow::Result;
use raystrips_convert::{ConvertParams, ConvertReport, StripParams, Unobserved, convert};
use raystrips_geom::{Hit, Ray};
use raystrips_tracer::{Scene, Tracer};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Longest strips that are compared, in windows.
const STRIP_WINDOWS: [usize; 3] = [1, 2, 4];
/// Conversions and tracings, of which the fastest counts.
const REPEATS: usize = 5;

/// Prints a row for each model and length of strips.
pub fn print(models: &[String]) -> Result<()> {
    println!(
        "| model | triangles | strip windows | bytes/triangle | vertices | indices | strip trees | nodes | overhead \
         | Mtri/s | primary | ao | bounce2 | chord |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let folder = tempfile::tempdir()?;
    for model in models {
        for max_windows in STRIP_WINDOWS {
            row(Path::new(model), max_windows, &folder.path().join("model.rsp"))?;
        }
    }
    println!("\nRays: million a second of one thread's processor time, closest hit, the best of {REPEATS}.");
    Ok(())
}

fn row(model: &Path, max_windows: usize, pack: &Path) -> Result<()> {
    let params =
        ConvertParams { strips: StripParams { max_windows }, proxies: None, ..ConvertParams::default() };
    let (report, seconds) = fastest_conversion(model, pack, &params)?;
    let scene = Scene::open(pack)?;
    let manifest = &report.manifest;
    let per_triangle = |n: u64| n as f64 / manifest.triangles() as f64;
    let bytes = &manifest.bytes;
    print!(
        "| {} | {} | {max_windows} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
        model.file_stem().unwrap_or_default().display(),
        manifest.triangles(),
        manifest.bytes_per_triangle(),
        per_triangle(bytes.vertices),
        per_triangle(bytes.indices),
        per_triangle(bytes.strip_trees),
        per_triangle(bytes.nodes),
        per_triangle(bytes.page_overhead),
        manifest.triangles() as f64 / seconds / 1e6,
    );
    for rays in ray_sets(&scene) {
        print!(" {:.2} |", million_rays_per_second(&scene, &rays));
    }
    println!();
    Ok(())
}

fn fastest_conversion(model: &Path, pack: &Path, params: &ConvertParams) -> Result<(ConvertReport, f64)> {
    let mut best = f64::INFINITY;
    let mut report = None;
    for _ in 0..REPEATS {
        let begin = Instant::now();
        report = Some(convert(&[PathBuf::from(model)], pack, params, &Unobserved)?);
        best = best.min(begin.elapsed().as_secs_f64());
    }
    Ok((report.expect("it was converted at least once"), best))
}

fn million_rays_per_second(scene: &Scene, rays: &[Ray]) -> f64 {
    let mut tracer = Tracer::new(scene);
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut once = || {
        let begin = thread_time();
        tracer.intersect_batch(rays, std::hint::black_box(&mut hits));
        thread_time() - begin
    };
    let best = (0..REPEATS).map(|_| once()).min().expect("it was traced at least once");
    rays.len() as f64 / best.as_secs_f64() / 1e6
}
