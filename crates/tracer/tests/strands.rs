//! Rays against strands of hair: the same as by trying every segment, by all kernels, and without gaps in a chain.
#![allow(clippy::unwrap_used, reason = "a test")]

mod support;

use glam::{DVec3, Vec3};
use raystrips_convert::{ConvertParams, Unobserved, convert};
use raystrips_geom::{Hit, Ray, Segment, Shape};
use raystrips_tracer::{Kernel, Scene, Tracer};
use support::Random;

/// Points of a strand with their radii.
type Strand = Vec<(Vec3, f32)>;

/// A hair file of strands with this transparency.
fn file(strands: &[Strand], transparency: f32) -> Vec<u8> {
    let points: usize = strands.iter().map(Vec::len).sum();
    let mut bytes = b"HAIR".to_vec();
    for number in [strands.len() as u32, points as u32, 7, 0] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend([0.0, transparency, 1.0, 1.0, 1.0].into_iter().flat_map(f32::to_le_bytes));
    bytes.resize(128, 0);
    bytes.extend(strands.iter().flat_map(|strand| (strand.len() as u16 - 1).to_le_bytes()));
    let positions = strands.iter().flatten().flat_map(|(p, _)| p.to_array());
    bytes.extend(positions.flat_map(f32::to_le_bytes));
    bytes.extend(strands.iter().flatten().flat_map(|(_, radius)| (2.0 * radius).to_le_bytes()));
    bytes
}

fn scene(strands: &[Strand]) -> Scene {
    transparent_scene(strands, 0.0)
}

fn transparent_scene(strands: &[Strand], transparency: f32) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("a.hair"), folder.path().join("a.rsp"));
    std::fs::write(&input, file(strands, transparency)).unwrap();
    let report = convert(&[input], &output, &ConvertParams::default(), &Unobserved).unwrap();
    let segments: usize = strands.iter().map(|strand| strand.len() - 1).sum();
    assert_eq!((report.manifest.segments, report.manifest.triangles()), (segments as u64, 0));
    Scene::open(&output).unwrap()
}

/// Curled strands of some length with radii that vary along them, all leaning to one side.
fn fur(count: usize, radius: f32, lean: Vec3) -> Vec<Strand> {
    let mut random = Random(7);
    let mut strand = || {
        let points = 2 + (random.unit() * 14.0) as usize;
        let mut p = Vec3::new(random.unit(), random.unit(), random.unit());
        let mut step = (random.direction() + lean).normalize() * 0.04;
        let mut next = || {
            step = (step + random.direction() * 0.015).normalize() * 0.04;
            p += step;
            (p, radius * (0.2 + random.unit()))
        };
        (0..points).map(|_| next()).collect()
    };
    (0..count).map(|_| strand()).collect()
}

fn rays(count: usize) -> Vec<Ray> {
    let mut random = Random(11);
    let mut ray = || {
        let org = Vec3::splat(0.5) + random.direction() * (0.2 + 3.0 * random.unit());
        let to = Vec3::new(random.unit(), random.unit(), random.unit());
        Ray { org, tnear: 0.0, dir: to - org, tfar: if random.unit() < 0.3 { 1.0 } else { f32::INFINITY } }
    };
    (0..count).map(|_| ray()).collect()
}

/// How deep the ray gets into the segment, as a share of the radius, and where it enters it: by trying balls along the
/// segment, which has nothing to do with cones.
fn enter(ray: &Ray, segment: &Segment) -> (f64, f64) {
    let (org, dir) = (ray.org.as_dvec3(), ray.dir.as_dvec3());
    let [a, b] = segment.ends.map(|p| p.as_dvec3());
    let [ra, rb] = segment.radii.map(f64::from);
    let ball = |s: f64| {
        let (center, radius) = (a + (b - a) * s, ra + (rb - ra) * s);
        let middle = (center - org).dot(dir) / dir.length_squared();
        let distance = (org + dir * middle).distance(center);
        let depth = (radius * radius - distance * distance) / dir.length_squared();
        (1.0 - distance / radius, if depth >= 0.0 { middle - depth.sqrt() } else { f64::INFINITY })
    };
    // The greatest, where there is one extremum along the segment.
    let best = |key: &dyn Fn(f64) -> f64| {
        let (mut low, mut high) = (0.0f64, 1.0f64);
        for _ in 0..100 {
            let (p, q) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if key(p) > key(q) { high = q } else { low = p }
        }
        [0.0, (low + high) / 2.0, 1.0].into_iter().map(key).fold(f64::NEG_INFINITY, f64::max)
    };
    let middle = ball(0.5).0 * (ra + rb) / 2.0;
    if middle < -(a.distance(b) + ra.max(rb)) {
        return (middle / ra.max(rb), f64::INFINITY);
    }
    let depth = best(&|s| ball(s).0);
    let entry = (0..=400).map(|i| ball(f64::from(i) / 400.0).1).fold(f64::INFINITY, f64::min);
    (depth, entry)
}

#[test]
fn hits_are_those_of_every_segment_tried() {
    check_hits(&fur(200, 0.006, Vec3::ZERO));
}

/// Here boxes are turned.
#[test]
fn hits_of_combed_hair_are_those_of_every_segment_tried() {
    check_hits(&fur(200, 0.006, Vec3::new(2.0, 1.0, -3.0)));
}

fn check_hits(strands: &[Strand]) {
    let scene = scene(strands);
    let segments: Vec<Segment> = strands
        .iter()
        .flat_map(|strand| strand.windows(2))
        .map(|pair| Segment { ends: [pair[0].0, pair[1].0], radii: [pair[0].1, pair[1].1] })
        .collect();
    let mut met = 0;
    for ray in rays(1500) {
        let hit = Tracer::new(&scene).intersect(&ray);
        let entries = segments.iter().map(|segment| enter(&ray, segment));
        // What is hardly touched may be missed, since radii are rounded.
        let tolerance = 2.0 * scene.manifest().radius_error + 1e-4;
        let counts = |t: f64| f64::from(ray.tnear) < t && t < f64::from(ray.tfar);
        let (mut sure, mut possible) = (f64::INFINITY, f64::INFINITY);
        for (depth, t) in entries.filter(|&(depth, t)| depth > -tolerance && (counts(t) || t.is_infinite())) {
            possible = possible.min(if t.is_finite() { t } else { 0.0 });
            if depth > tolerance {
                sure = sure.min(t);
            }
        }
        let length = f64::from(ray.dir.length());
        let slack = 0.006 * 0.3 / length;
        if hit.is_hit() {
            met += 1;
            let t = f64::from(hit.t);
            assert!(t <= sure + slack && t >= possible - slack, "{t} of {possible} to {sure}");
            let Shape::Segment(segment) = scene.resolve(&hit).shape else { panic!("no triangles here") };
            let (center, radius) = ball_at(&segment, hit.u);
            let p = ray.org.as_dvec3() + ray.dir.as_dvec3() * t;
            assert!((p.distance(center) / radius - 1.0).abs() < 1e-3, "{} of {radius}", p.distance(center));
        } else {
            assert!(sure.is_infinite(), "missed what is entered at {sure}");
        }
    }
    assert!(met > 150, "{met} hits");
}

fn ball_at(segment: &Segment, share: f32) -> (DVec3, f64) {
    let [a, b] = segment.ends.map(|p| p.as_dvec3());
    let [ra, rb] = segment.radii.map(f64::from);
    let share = f64::from(share);
    (a + (b - a) * share, ra + (rb - ra) * share)
}

#[test]
fn kernels_agree_and_packets_and_batches_too() {
    check_kernels(&scene(&fur(2000, 0.003, Vec3::ZERO)));
    check_kernels(&scene(&fur(2000, 0.003, Vec3::new(1.0, 2.0, 1.0))));
}

/// Coordinates beside zero, whose clusters have fields of up to 32 bits, or floats.
#[test]
fn kernels_agree_on_wide_fields() {
    let mut random = Random(11);
    let mut strands = fur(2000, 0.003, Vec3::ZERO);
    for (p, _) in strands.iter_mut().flatten() {
        match (random.unit() * 40.0) as u32 {
            0 => p.x = (1.0 + random.unit()) / 1024.0,
            1 => p.y = (1.0 + random.unit()) * 1e-20,
            2 => p.z = -0.0,
            _ => {}
        }
    }
    check_kernels(&scene(&strands));
}

fn check_kernels(scene: &Scene) {
    let rays = rays(20_000);
    let mut expected = vec![Hit::MISS; rays.len()];
    Tracer::with_kernel(scene, Kernel::available()[0]).intersect_batch(&rays, &mut expected);
    assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 2000);
    let camera: Vec<Ray> = rays.iter().map(|ray| Ray::new(Vec3::splat(-2.0), ray.dir.abs())).collect();
    for &kernel in Kernel::available() {
        let mut tracer = Tracer::with_kernel(scene, kernel);
        let mut hits = vec![Hit::MISS; rays.len()];
        tracer.intersect_batch(&rays, &mut hits);
        assert!(hits == expected, "{}", kernel.name());
        let mut occluded = vec![false; rays.len()];
        tracer.occluded_batch(&rays, &mut occluded);
        assert!(occluded.iter().zip(&expected).all(|(&occluded, hit)| occluded == hit.is_hit()));
        let single: Vec<Hit> = camera.iter().map(|ray| tracer.intersect(ray)).collect();
        for (rays, single) in camera.chunks(64).zip(single.chunks(64)) {
            let mut hits = vec![Hit::MISS; rays.len()];
            tracer.intersect_packet(rays, &mut hits);
            assert_eq!(hits, single);
        }
    }
}

/// A ring that is one strand, looked at from its middle: no ray towards its center line gets out.
#[test]
fn chains_have_no_gaps() {
    let count = 720;
    let point = |i: usize| {
        let angle = std::f32::consts::TAU * i as f32 / count as f32;
        (Vec3::new(angle.cos(), 0.3 * (5.0 * angle).sin(), angle.sin()), 1e-4 * (1.5 + (3.0 * angle).sin()))
    };
    let ring: Strand = (0..=count).map(|i| point(i % count)).collect();
    let scene = scene(std::slice::from_ref(&ring));
    let mut tracer = Tracer::new(&scene);
    let mut random = Random(3);
    for i in 0..50_000 {
        // Points of the chain and places between them.
        let pair = [ring[i % count].0, ring[i % count + 1].0];
        let share = if i % 3 == 0 { 0.0 } else { random.unit() };
        let ray = Ray::new(random.direction() * 0.1, pair[0].lerp(pair[1], share));
        let ray = Ray { dir: ray.dir - ray.org, ..ray };
        assert!(tracer.intersect(&ray).is_hit(), "{ray:?}");
    }
}

/// A ray that starts in a strand leaves it without a hit.
#[test]
fn only_entries_are_hits() {
    let scene = scene(&[vec![(Vec3::ZERO, 0.1), (Vec3::X, 0.2)]]);
    let mut tracer = Tracer::new(&scene);
    let mut random = Random(5);
    for _ in 0..1000 {
        let inside = Vec3::new(0.1 + 0.8 * random.unit(), 0.05 * random.unit(), 0.05 * random.unit());
        assert!(!tracer.intersect(&Ray::new(inside, random.direction())).is_hit(), "{inside}");
        let outside = Vec3::new(inside.x, 5.0, 0.0);
        assert!(tracer.intersect(&Ray::new(outside, inside - outside)).is_hit());
    }
}

/// Rays through several strands, one behind the other: the share that is stopped is that of their opacities, closest hits
/// and any hits agree, and so do kernels.
#[test]
fn rays_pass_strands_by_chance() {
    let wall = |z: f32| -> Vec<Strand> {
        let strand = |x: i32| [-1.0, 1.0].map(|y| (Vec3::new(x as f32 * 0.1, y, z), 0.1)).to_vec();
        (-10..=10).map(strand).collect()
    };
    let strands: Vec<Strand> = [0.0, 0.5, 1.0].into_iter().flat_map(wall).collect();
    let scene = transparent_scene(&strands, 0.75);
    let mut random = Random(9);
    let mut place = || Vec3::new(random.unit() - 0.5, random.unit() - 0.5, 5.0);
    let rays: Vec<Ray> = (0..40_000).map(|_| Ray::new(place(), Vec3::NEG_Z)).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    Tracer::new(&scene).intersect_batch(&rays, &mut hits);
    assert!(hits.iter().all(Hit::is_hit), "opacity is for who asks for it");

    let scene = scene.with_opacity();
    Tracer::new(&scene).intersect_batch(&rays, &mut hits);
    let stopped = |range: std::ops::Range<f32>| {
        hits.iter().filter(|hit| range.contains(&hit.t)).count() as f64 / hits.len() as f64
    };
    // Strands of a wall overlap: a ray meets one or two of them, the second of which may stop it behind the first.
    let all = stopped(0.0..10.0);
    assert!((1.0 - 0.75f64.powi(3) - 0.02..=1.0 - 0.75f64.powi(6) + 0.02).contains(&all), "{all}");
    assert!(stopped(3.8..4.2) > stopped(4.3..4.7) && stopped(4.3..4.7) > stopped(4.8..5.2));
    for &kernel in Kernel::available() {
        let mut tracer = Tracer::with_kernel(&scene, kernel);
        let mut occluded = vec![false; rays.len()];
        tracer.occluded_batch(&rays, &mut occluded);
        assert!(occluded.iter().zip(&hits).all(|(&occluded, hit)| occluded == hit.is_hit()));
        assert!(rays.iter().zip(&hits).all(|(ray, hit)| tracer.intersect(ray) == *hit));
    }
}
