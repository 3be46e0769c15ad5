//! Instances: the same as copies up to rounding, the same bits by any way, and without gaps.
#![allow(clippy::unwrap_used, reason = "a test")]

mod support;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use raystrips_convert::{ConvertParams, ImportOptions, Unobserved, convert};
use raystrips_geom::{Hit, Ray, Shape};
use raystrips_tracer::{Kernel, Scene, Tracer};
use serde_json::json;
use std::path::{Path, PathBuf};
use support::Random;

/// Segments from pole to pole of the ball; twice as many around it.
const RINGS: u32 = 48;

/// Positions and triangles of a closed ball with bumps, about 1 in radius.
fn ball() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let around = 2 * RINGS;
    let mut positions = vec![Vec3::Y];
    for ring in 1..RINGS {
        for i in 0..around {
            let polar = std::f32::consts::PI * ring as f32 / RINGS as f32;
            let azimuth = std::f32::consts::TAU * i as f32 / around as f32;
            let radius = 1.0 + 0.1 * (5.0 * azimuth).sin() * (3.0 * polar).sin();
            let (sin, cos) = polar.sin_cos();
            positions.push(Vec3::new(sin * azimuth.cos(), cos, sin * azimuth.sin()) * radius);
        }
    }
    positions.push(-Vec3::Y);
    let south = positions.len() as u32 - 1;
    let vertex = |ring: u32, i: u32| match ring {
        0 => 0,
        RINGS => south,
        _ => 1 + (ring - 1) * around + i % around,
    };
    let quads = (0..RINGS).flat_map(|ring| (0..around).map(move |i| (ring, i)));
    let triangles = quads.flat_map(|(ring, i)| {
        let corner = |down: u32, on: u32| vertex(ring + down, i + on);
        [[corner(0, 0), corner(0, 1), corner(1, 1)], [corner(0, 0), corner(1, 1), corner(1, 0)]]
    });
    (positions, triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect())
}

/// A glTF file in `folder` of balls at `places`, and of a square below them.
fn write_scene(folder: &Path, places: &[DAffine3]) -> PathBuf {
    let (mut positions, mut triangles) = ball();
    let counts = (positions.len(), 3 * triangles.len());
    positions
        .extend([(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, z)| Vec3::new(x, -4.0, z)));
    triangles.extend([[0, 2, 1], [0, 3, 2]]);
    let mut bytes: Vec<u8> = positions.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes).collect();
    let index_bytes = bytes.len();
    bytes.extend(triangles.as_flattened().iter().flat_map(|index| index.to_le_bytes()));
    std::fs::write(folder.join("a.bin"), &bytes).unwrap();
    let mesh =
        |first: u32| json!({"primitives": [{"attributes": {"POSITION": first}, "indices": first + 1}]});
    let node = |place: &DAffine3| json!({"mesh": 0, "matrix": glam::DMat4::from(*place).to_cols_array()});
    let mut nodes: Vec<_> = places.iter().map(node).collect();
    nodes.push(json!({"mesh": 1}));
    let view =
        |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let accessor = |view: u32, offset: usize, kind: &str, component: u32, count: usize| json!({"bufferView": view, "byteOffset": offset, "type": kind, "componentType": component, "count": count});
    let document = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": [mesh(0), mesh(2)],
        "buffers": [{"uri": "a.bin", "byteLength": bytes.len()}],
        "bufferViews": [view(0, index_bytes), view(index_bytes, bytes.len() - index_bytes)],
        "accessors": [
            accessor(0, 0, "VEC3", 5126, counts.0),
            accessor(1, 0, "SCALAR", 5125, counts.1),
            accessor(0, 12 * counts.0, "VEC3", 5126, 4),
            accessor(1, 4 * counts.1, "SCALAR", 5125, 6),
        ],
    });
    let path = folder.join("a.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    path
}

fn scene(places: &[DAffine3], instances: bool) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let input = write_scene(folder.path(), places);
    let import = ImportOptions { instances, ..ImportOptions::default() };
    let params = ConvertParams { import, keep_ids: true, proxies: None, ..ConvertParams::default() };
    let output = folder.path().join("a.rsp");
    convert(&[input], &output, &params, &Unobserved).unwrap();
    Scene::open(&output).unwrap()
}

/// Turned, scaled, drawn out, mirrored, and some into each other.
fn places() -> Vec<DAffine3> {
    let mut random = Random(3);
    let mut place = |i: usize| {
        let turn =
            DQuat::from_axis_angle(random.direction().as_dvec3().normalize(), f64::from(random.unit()) * 6.0);
        let stretch =
            [DVec3::ONE, DVec3::new(0.3, 0.9, 1.4), DVec3::new(-1.0, 1.0, 1.0), DVec3::splat(0.1)][i % 4];
        let at = DVec3::new(
            f64::from(i as u32 % 5) * 2.3 - 4.0,
            f64::from(random.unit()),
            f64::from(i as u32 / 5) * 2.1 - 4.0,
        );
        DAffine3 { matrix3: DMat3::from_quat(turn) * DMat3::from_diagonal(stretch), translation: at }
    };
    (0..20).map(&mut place).collect()
}

fn rays(count: usize) -> Vec<Ray> {
    let mut random = Random(5);
    let mut ray = || {
        let org = random.direction() * (1.0 + 20.0 * random.unit());
        let to = Vec3::new(10.0 * random.unit() - 5.0, 2.0 * random.unit() - 1.0, 10.0 * random.unit() - 5.0);
        let dir = (to - org) * (0.1 + random.unit());
        Ray { org, tnear: 0.0, dir, tfar: if random.unit() < 0.2 { 1.0 } else { f32::INFINITY } }
    };
    (0..count).map(|_| ray()).collect()
}

fn trace(scene: &Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    Tracer::new(scene).intersect_batch(rays, &mut hits);
    hits
}

#[test]
fn instances_are_where_copies_are() {
    let (instanced, copied) = (scene(&places(), true), scene(&places(), false));
    assert_eq!((instanced.manifest().instances, copied.manifest().instances), (20, 0));
    assert_eq!(instanced.manifest().shown, copied.manifest().primitives);
    assert!(instanced.manifest().primitives * 19 < copied.manifest().primitives);
    assert!((instanced.bounds().diagonal() - copied.bounds().diagonal()).abs() < 0.2);
    let rays = rays(50_000);
    let (mut hit, mut others) = (0, 0);
    for ((ray, a), b) in rays.iter().zip(trace(&instanced, &rays)).zip(trace(&copied, &rays)) {
        // Along a silhouette rounding decides.
        if a.is_hit() != b.is_hit() || (a.t - b.t).abs() > 1e-4 * b.t {
            others += 1;
            continue;
        }
        if !a.is_hit() {
            continue;
        }
        hit += 1;
        let (found, copy) = (instanced.resolve(&a), copied.resolve(&b));
        let (Shape::Triangle(corners), Shape::Triangle(expected)) = (found.shape, copy.shape) else {
            panic!()
        };
        let point = |[p0, p1, p2]: [Vec3; 3], u: f32, v: f32| p0 * (1.0 - u - v) + p1 * u + p2 * v;
        let at = point(corners, found.u, found.v);
        assert!(at.distance(ray.at(b.t)) < 1e-4 * (1.0 + b.t * ray.dir.length()));
        let normal = |[p0, p1, p2]: [Vec3; 3]| (p1 - p0).cross(p2 - p0).normalize();
        if corners.iter().zip(&expected).all(|(a, b)| a.distance(*b) < 1e-4) {
            assert!(normal(corners).dot(normal(expected)) > 0.999, "wound alike, also where mirrored");
            assert_eq!(found.geometry, copy.geometry);
        }
    }
    assert!(hit > 20_000 && others < 20, "{hit} {others}");
}

#[test]
fn every_way_to_trace_gives_the_same_bits() {
    let scene = scene(&places(), true);
    let mut rays = rays(5_000);
    // Rays that keep together, too.
    let org = Vec3::new(0.5, 3.0, -12.0);
    let towards = |i: u32| Vec3::new((i % 64) as f32 * 0.15 - 4.0, -1.0 - (i / 64) as f32 * 0.05, 12.0);
    rays.extend((0..64 * 64).map(|i| Ray::new(org, towards(i))));
    let expected = trace(&scene, &rays);
    assert!(expected.iter().any(|hit| hit.instance == 7));
    for &kernel in Kernel::available() {
        let mut tracer = Tracer::with_kernel(&scene, kernel);
        let mut hits = vec![Hit::MISS; rays.len()];
        tracer.intersect_batch(&rays, &mut hits);
        assert_eq!(hits, expected, "{}", kernel.name());
        tracer.intersect_packet(&rays, &mut hits);
        assert_eq!(hits, expected, "{}", kernel.name());
        for (ray, hit) in rays.iter().zip(&expected) {
            assert_eq!(tracer.intersect(ray), *hit);
            assert_eq!(tracer.occluded(ray), hit.is_hit());
        }
    }
}

/// Whichever is looked into first.
#[test]
fn of_two_at_one_place_the_first_is_hit() {
    let scene = scene(&[DAffine3::IDENTITY; 6], true);
    let rays = rays(5_000);
    let hits = trace(&scene, &rays);
    let instances: Vec<u32> = hits.iter().filter(|hit| hit.is_hit()).map(|hit| hit.instance).collect();
    assert!(instances.contains(&0) && instances.iter().all(|&i| i == 0 || i == Hit::NO_INSTANCE));
}

#[test]
fn no_ray_slips_into_a_closed_instance() {
    let places = places();
    let scene = scene(&places, true);
    let mut random = Random(9);
    let mut tracer = Tracer::new(&scene);
    for i in 0..60_000 {
        let place = &places[i % places.len()];
        // From far outside to a point inside, some through vertices and edges of the ball on the way.
        let inside = place.transform_point3(random.direction().as_dvec3() * 0.2).as_vec3();
        let far = 10f32.powf(3.0 * random.unit() + 1.0);
        let org = inside + random.direction() * far;
        let ray = Ray { org, tnear: 0.0, dir: inside - org, tfar: 1.0 };
        assert!(tracer.intersect(&ray).is_hit(), "{ray:?} into ball {}", i % places.len());
    }
}
