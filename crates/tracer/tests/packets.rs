//! Packets give the hits of single rays, bit for bit.
#![allow(clippy::unwrap_used, reason = "a test")]

mod support;

use glam::Vec3;
use raystrips_geom::{Hit, Ray};
use raystrips_tracer::{Kernel, Tracer};
use std::path::Path;
use support::{Model, Random, corpus};

/// Packets a model.
const PACKETS: u64 = 300;
/// Largest file that is traced, so that the test takes seconds.
const MAX_BYTES: u64 = 4 << 20;
/// Longest strips of the packs.
const STRIP_WINDOWS: [usize; 2] = [1, 4];

#[test]
fn packets_equal_single_rays() {
    let small = |path: &&Path| path.metadata().is_ok_and(|m| m.len() < MAX_BYTES);
    let files = corpus();
    for (i, path) in files.iter().map(|p| p.as_path()).filter(small).step_by(7).enumerate() {
        if let Ok(model) = Model::convert(path, STRIP_WINDOWS[i % 2]) {
            check(&model);
        }
    }
}

fn check(model: &Model) {
    let packets: Vec<Vec<Ray>> = (0..PACKETS).map(|i| packet(model, &mut Random(i))).collect();
    for &kernel in Kernel::available() {
        let mut tracer = Tracer::with_kernel(&model.scene, kernel);
        for rays in &packets {
            let mut hits = vec![Hit::MISS; rays.len()];
            tracer.intersect_packet(rays, &mut hits);
            let single: Vec<Hit> = rays.iter().map(|ray| tracer.intersect(ray)).collect();
            assert!(hits == single, "{} with {}", model.name, kernel.name());
        }
    }
}

/// Up to 200 rays from one point: to near points, to points anywhere, some that end early, some that are no rays.
fn packet(model: &Model, random: &mut Random) -> Vec<Ray> {
    let center = model.scene.bounds().center();
    let radius = model.diagonal as f32 * 0.5;
    let from = center + random.direction() * radius * [0.2, 1.5, 30.0][random.below(3)];
    let toward = model.triangles[random.below(model.triangles.len())][0];
    let spread = radius * [0.0, 0.001, 0.05, 1.0][random.below(4)];
    let scale = [1.0, 1e-3, 1e-15][random.below(3)];
    let count = 1 + random.below(200);
    let ray = |_| {
        let to = toward + random.direction() * spread * random.unit();
        let ray = Ray::new(from, (to - from) * scale);
        match random.below(50) {
            0 => Ray { tfar: 0.9 / scale, ..ray },
            1 => Ray { tnear: 0.9 / scale, ..ray },
            2 => Ray { dir: Vec3::X, ..ray },
            3 if count > 150 => Ray { dir: Vec3::ZERO, ..ray },
            4 if count > 150 => Ray { tnear: -1.0 / scale, ..ray },
            _ => ray,
        }
    };
    (0..count).map(ray).collect()
}
