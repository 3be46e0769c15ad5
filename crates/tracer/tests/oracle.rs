//! Hits against brute force in f64, on every model of the corpus that has up to 100,000 triangles.
//!
//! The models lie in the folder that RAYSTRIPS_MODELS names, or in `../shared/models` beside the repository;
//! without them there is nothing to do. RAYSTRIPS_ORACLE_RAYS sets the rays a model; by default they are chosen
//! so that the test takes seconds.

mod support;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use raystrips_geom::{Hit, Ray};
use raystrips_tracer::{Kernel, Tracer};
use support::{Model, Random, corpus};

/// Largest model that is tested.
const MAX_TRIANGLES: u64 = 100_000;
/// Triangle tests a model when the number of rays is not given.
const DEFAULT_TESTS: u64 = 100_000_000;
/// Longest strips of the packs.
const STRIP_WINDOWS: [usize; 4] = [1, 2, 5, 42];
/// A hit or miss this close to the border of a triangle, and a distance off by this much, count as right; shares
/// of the scene's diagonal.
const TOLERANCE: f64 = 1e-6;

#[test]
fn hits_equal_brute_force() {
    let asked: Option<u64> = std::env::var("RAYSTRIPS_ORACLE_RAYS").ok().and_then(|n| n.parse().ok());
    let mut models = 0;
    for (i, path) in corpus().into_iter().enumerate() {
        // All lengths of strips in turn.
        let Ok(model) = Model::convert(&path, STRIP_WINDOWS[i % STRIP_WINDOWS.len()]) else { continue };
        if model.triangles.len() as u64 > MAX_TRIANGLES {
            continue;
        }
        let count = asked.unwrap_or((DEFAULT_TESTS / model.triangles.len() as u64).min(20_000));
        let report = check(&model, count);
        eprintln!(
            "{}: {} triangles, {count} rays, {} hits, {} at a border, distance off by {:.1e} of the diagonal",
            path.display(),
            model.triangles.len(),
            report.hits,
            report.borderline,
            report.worst
        );
        models += 1;
    }
    eprintln!("{models} models compared with brute force");
}

#[derive(Default)]
struct Report {
    hits: u64,
    borderline: u64,
    worst: f64,
}

fn check(model: &Model, count: u64) -> Report {
    let rays: Vec<Ray> = (0..count).map(|i| random_ray(model, &mut Random(i * 7919 + 1))).collect();
    let mut hits = Vec::new();
    for &kernel in Kernel::available() {
        let mut tracer = Tracer::with_kernel(&model.scene, kernel);
        let found: Vec<Hit> = rays.iter().map(|ray| tracer.intersect(ray)).collect();
        assert!(rays.iter().zip(&found).all(|(ray, hit)| tracer.occluded(ray) == hit.is_hit()));
        let mut batch = vec![Hit::MISS; rays.len()];
        tracer.intersect_batch(&rays, &mut batch);
        assert!(batch == found, "a batch differs from single rays on {}", model.name);
        let mut occluded = vec![false; rays.len()];
        tracer.occluded_batch(&rays, &mut occluded);
        assert!(occluded.iter().zip(&found).all(|(&any, hit)| any == hit.is_hit()));
        assert!(hits.is_empty() || hits == found, "kernels differ on {}", model.name);
        hits = found;
    }
    let reports = rays.par_iter().zip(&hits).map(|(ray, hit)| check_ray(model, ray, hit));
    reports.reduce(Report::default, |a, b| Report {
        hits: a.hits + b.hits,
        borderline: a.borderline + b.borderline,
        worst: a.worst.max(b.worst),
    })
}

fn check_ray(model: &Model, ray: &Ray, hit: &Hit) -> Report {
    let tolerance = TOLERANCE * model.diagonal;
    let length = ray.dir.as_dvec3().length();
    // Nearest of the triangles that are surely hit, and of those that may be. One whose border the ray just
    // touches may be met anywhere between its nearest and its farthest corner, if it is seen from its side.
    let (mut sure, mut possible) = (f64::INFINITY, f64::INFINITY);
    let dir = ray.dir.as_dvec3() / length;
    for (corners, sphere) in model.triangles.iter().zip(&model.spheres) {
        if sphere.is_missed_by(ray.org.as_dvec3(), dir) {
            continue;
        }
        if let Some((distance, margin)) = distance_and_margin(ray, corners) {
            if margin > tolerance {
                sure = sure.min(distance);
                possible = possible.min(distance);
            } else {
                let along = |p: &Vec3| (p.as_dvec3() - ray.org.as_dvec3()).dot(ray.dir.as_dvec3()) / length;
                possible = corners
                    .iter()
                    .map(|p| along(p) - 3.0 * TOLERANCE * along(p).abs())
                    .fold(possible, f64::min);
            }
        }
    }
    let found = f64::from(hit.t) * length;
    let context = || format!("{}: {ray:?} {hit:?} sure {sure} possible {possible}", model.name);
    assert!(found <= sure + tolerance, "missed: {}", context());
    assert!(found >= possible - tolerance, "invented: {}", context());
    Report {
        hits: u64::from(hit.is_hit()),
        borderline: u64::from(sure != possible),
        worst: if sure == possible && sure.is_finite() { (found - sure).abs() / model.diagonal } else { 0.0 },
    }
}

/// Distance along the ray of a triangle and how far inside the triangle and its own ends it passes; `None` where
/// it passes farther outside than the tolerance allows for.
fn distance_and_margin(ray: &Ray, corners: &[Vec3; 3]) -> Option<(f64, f64)> {
    let dir = ray.dir.as_dvec3().normalize();
    let [a, b, c] = corners.map(|p| p.as_dvec3() - ray.org.as_dvec3());
    // Signed distances of the ray from the edges.
    let side = |p: DVec3, q: DVec3| {
        let normal = p.cross(q);
        let across = (q - p).reject_from_normalized(dir).length();
        if across > 0.0 { normal.dot(dir) / across } else { 0.0 }
    };
    let sides = [side(b, c), side(c, a), side(a, b)];
    let ng = (b - a).cross(c - a);
    let facing = ng.dot(dir);
    let least = sides.iter().map(|s| s * facing.signum()).fold(f64::INFINITY, f64::min);
    let slack = TOLERANCE * (a.length() + b.length() + c.length());
    if facing == 0.0 || least < -slack {
        return None;
    }
    let distance = ng.dot(a) / facing;
    let length = ray.dir.as_dvec3().length();
    let inside_ends = (distance - f64::from(ray.tnear) * length).min(f64::from(ray.tfar) * length - distance);
    (inside_ends >= -slack).then_some((distance, least.min(inside_ends)))
}

/// Chords of the bounding sphere, rays that leave a surface, rays along an axis, rays at a vertex.
fn random_ray(model: &Model, random: &mut Random) -> Ray {
    let center = model.scene.bounds().center();
    let radius = model.diagonal as f32 * 0.5;
    let from = center + random.direction() * radius * 1.1;
    let triangle = model.triangles[random.below(model.triangles.len())];
    match random.below(4) {
        0 => {
            let to = center + random.direction() * radius;
            Ray { org: from, tnear: 0.0, dir: to - from, tfar: 1.0 }
        }
        1 => {
            let [u, v] = [random.unit() * 0.5, random.unit() * 0.5];
            let on = triangle[0] * (1.0 - u - v) + triangle[1] * u + triangle[2] * v;
            Ray { tnear: radius * 1e-3, ..Ray::new(on, random.direction()) }
        }
        2 => {
            let mut dir = Vec3::ZERO;
            dir[random.below(3)] = if random.below(2) == 0 { 1.0 } else { -1.0 };
            let to = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
            Ray::new(to - dir * radius * 2.0, dir)
        }
        _ => Ray::new(from, (triangle[random.below(3)] - from).normalize()),
    }
}
