//! `raystrips trace`.

use super::print_json;
use crate::args::TraceArgs;
use crate::files::{check_output, write_whole};
use crate::process::thread_cpu_time;
use anyhow::{Context, Result, bail};
use raystrips_geom::{Hit, Ray};
use raystrips_tracer::{Kernel, Scene, Tracer};
use serde_json::json;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Rays that a thread takes at a time.
const CHUNK: usize = 4096;
/// Bytes of a ray in a ray file.
const RAY_BYTES: usize = size_of::<Ray>();
/// Bytes of a hit in a hit file.
const HIT_BYTES: usize = 24;

/// Traces a file of rays.
pub fn run(args: &TraceArgs) -> Result<()> {
    if let Some(path) = &args.output {
        check_output(path, &[&args.pack, &args.rays])?;
    }
    let kernel = choose_kernel(args.kernel.as_deref())?;
    let scene = Scene::open(&args.pack)?;
    let mut rays = read_rays(&args.rays)?;
    let offset = scene.manifest().scene_offset;
    for ray in &mut rays {
        ray.org = (ray.org.as_dvec3() - glam::DVec3::from_array(offset)).as_vec3();
    }
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut best = Timing::WORST;
    for _ in 0..args.repeat {
        let timing = trace(&scene, kernel, args, &rays, &mut hits);
        best = Timing { wall: best.wall.min(timing.wall), cpu: best.cpu.min(timing.cpu) };
    }
    if let Some(path) = &args.output {
        write_whole(path, &encode(&scene, &hits, args.occluded))?;
    }
    report(args, kernel, &hits, best)
}

fn choose_kernel(name: Option<&str>) -> Result<Kernel> {
    let Some(name) = name else { return Ok(Kernel::best()) };
    let available = Kernel::available();
    available.iter().copied().find(|k| k.name() == name).with_context(|| {
        let names: Vec<&str> = available.iter().map(|k| k.name()).collect();
        format!("--kernel {name}: this processor has {}", names.join(", "))
    })
}

fn read_rays(path: &Path) -> Result<Vec<Ray>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    if bytes.len() % RAY_BYTES != 0 {
        bail!(
            "{}: {} bytes are not a whole number of rays; a ray is 8 little-endian f32: origin, tnear, direction, tfar",
            path.display(),
            bytes.len()
        );
    }
    Ok(bytes.chunks_exact(RAY_BYTES).map(bytemuck::pod_read_unaligned).collect())
}

/// Time in the tracer alone.
#[derive(Clone, Copy)]
struct Timing {
    wall: Duration,
    /// Mean processor time of a thread.
    cpu: Duration,
}

impl Timing {
    const WORST: Timing = Timing { wall: Duration::MAX, cpu: Duration::MAX };
}

fn trace(scene: &Scene, kernel: Kernel, args: &TraceArgs, rays: &[Ray], hits: &mut [Hit]) -> Timing {
    let threads = u32::from(args.threads);
    let next = AtomicUsize::new(0);
    let chunks: Vec<Mutex<&mut [Hit]>> = hits.chunks_mut(CHUNK).map(Mutex::new).collect();
    let work = || {
        let begin = thread_cpu_time();
        let mut tracer = Tracer::with_kernel(scene, kernel);
        loop {
            let chunk = next.fetch_add(1, Ordering::Relaxed);
            let Some(hits) = chunks.get(chunk) else { break };
            let mut hits = hits.lock().unwrap_or_else(|e| e.into_inner());
            let rays = &rays[chunk * CHUNK..][..hits.len()];
            if args.occluded {
                let occluded = &mut [false; CHUNK][..rays.len()];
                tracer.occluded_batch(rays, occluded);
                for (hit, &occluded) in hits.iter_mut().zip(occluded.iter()) {
                    *hit = if occluded { Hit { t: 0.0, prim_id: 0, ..Hit::MISS } } else { Hit::MISS };
                }
            } else if args.packets {
                tracer.intersect_packet(rays, &mut hits);
            } else {
                tracer.intersect_batch(rays, &mut hits);
            }
        }
        thread_cpu_time() - begin
    };
    let begin = Instant::now();
    let cpu: Duration = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|t| t.join().unwrap_or_default()).sum()
    });
    Timing { wall: begin.elapsed(), cpu: cpu / threads }
}

fn encode(scene: &Scene, hits: &[Hit], occluded: bool) -> Vec<u8> {
    if occluded {
        return hits.iter().map(|hit| u8::from(hit.is_hit())).collect();
    }
    let mut bytes = Vec::with_capacity(hits.len() * HIT_BYTES);
    for hit in hits {
        let (t, u, v, geometry, triangle) = if hit.is_hit() {
            let found = scene.resolve(hit);
            (hit.t, found.u, found.v, found.geometry, found.triangle)
        } else {
            (f32::INFINITY, 0.0, 0.0, u32::MAX, u64::MAX)
        };
        bytes.extend([t, u, v].into_iter().flat_map(f32::to_le_bytes));
        bytes.extend(geometry.to_le_bytes());
        bytes.extend(triangle.to_le_bytes());
    }
    bytes
}

fn report(args: &TraceArgs, kernel: Kernel, hits: &[Hit], best: Timing) -> Result<()> {
    let count = hits.iter().filter(|hit| hit.is_hit()).count();
    let rate = |time: Duration| hits.len() as f64 / time.as_secs_f64().max(1e-9) / 1e6;
    if args.json {
        return print_json(&json!({
            "rays": hits.len(),
            "hits": count,
            "seconds": best.wall.as_secs_f64(),
            "seconds_cpu": best.cpu.as_secs_f64(),
            "mrays_per_second": rate(best.wall),
            "mrays_per_second_cpu": rate(best.cpu),
            "threads": args.threads,
            "kernel": kernel.name(),
        }));
    }
    writeln!(
        std::io::stdout(),
        "{} rays, {count} hits, {:.3} s, {:.2} million rays/s ({}, {} threads)",
        hits.len(),
        best.wall.as_secs_f64(),
        rate(best.wall),
        kernel.name(),
        args.threads,
    )?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_ray_file_is_read_as_written() {
        let ray = Ray { org: Vec3::new(1.0, 2.0, 3.0), tnear: 0.5, dir: Vec3::NEG_Z, tfar: f32::INFINITY };
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytemuck::bytes_of(&ray)).unwrap();
        assert_eq!(read_rays(file.path()).unwrap(), [ray]);
        std::fs::write(file.path(), [0; 33]).unwrap();
        assert!(read_rays(file.path()).is_err());
    }
}
