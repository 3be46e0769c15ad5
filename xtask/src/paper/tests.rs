//! All structures against the tracer of the program.

use super::bvh::{Minimal, Optimized, PlainBvh};
use super::mesh::Mesh;
use super::multi_bvh::{MultiBvh, SingleTriangles};
use super::ray_strip::{Params, RayStrips, Statistics};
use super::structure::{Stacks, Structure};
use crate::rays::{in_blocks, picture, ray_sets_of};
use crate::sample_mesh;
use glam::Vec3;
use raystrips_convert::{ConvertParams, Unobserved, convert};
use raystrips_geom::{Hit, Ray};
use raystrips_tracer::{Scene, Tracer};

/// Pixels along a side of the pictures.
const SIDE: usize = 160;
/// Of so many rays one may be at the border of a triangle, where other tests may see it differently.
const RAYS_A_BORDER: usize = 2000;

/// Packs and opens a model in OBJ.
fn open(obj: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let (model, pack) = (folder.path().join("model.obj"), folder.path().join("model.rsp"));
    std::fs::write(&model, obj).unwrap();
    convert(&[model], &pack, &ConvertParams { proxies: None, ..ConvertParams::default() }, &Unobserved)
        .unwrap();
    Scene::open(&pack).unwrap()
}

/// Camera rays in blocks of four, then all others.
fn rays(scene: &Scene) -> Vec<Ray> {
    let mut rays = in_blocks(&picture(scene, SIDE), SIDE, 2);
    rays.extend(axis_parallel(scene));
    rays.extend(ray_sets_of(scene, SIDE).into_iter().skip(1).flatten());
    rays.truncate(1 << 17);
    rays
}

/// Rays along the axes, whose directions have zeros of both signs.
fn axis_parallel(scene: &Scene) -> Vec<Ray> {
    let (center, radius) = (scene.bounds().center(), scene.bounds().diagonal() * 0.5);
    let turned = |axis: usize, v: Vec3| Vec3::new(v[axis], v[(axis + 1) % 3], v[(axis + 2) % 3]);
    let ray = |axis: usize, sign: f32, i: usize| {
        let [x, y] = [0.618_034, 0.414_214].map(|step: f32| (i as f32 * step).fract() - 0.5);
        let dir = turned(axis, Vec3::Z * sign);
        Ray::new(center + turned(axis, Vec3::new(x, y, 0.0)) * radius - dir * radius, dir)
    };
    let rays = |(axis, sign)| (0..2000).map(move |i| ray(axis, sign, i));
    [(0, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)].into_iter().flat_map(rays).collect()
}

/// True if hits differ otherwise than by rounding.
fn differ(a: &Hit, b: &Hit) -> bool {
    a.is_hit() != b.is_hit() || a.is_hit() && (a.t - b.t).abs() > 1e-4 * a.t.abs().max(1e-3)
}

/// Rays, and what the tracer finds for them.
struct Expected {
    rays: Vec<Ray>,
    hits: Vec<Hit>,
}

impl Expected {
    fn new(scene: &Scene) -> Expected {
        let rays = rays(scene);
        let mut tracer = Tracer::new(scene);
        let hits: Vec<Hit> = rays.iter().map(|ray| tracer.intersect(ray)).collect();
        assert!(hits.iter().filter(|hit| hit.is_hit()).count() > rays.len() / 50);
        Expected { rays, hits }
    }

    fn check(&self, name: &str, structure: &impl Structure) {
        let mut stacks = Stacks::default();
        let single = self.rays.iter().map(|ray| structure.intersect(&mut stacks, ray)).collect();
        let (packets, _) = self.rays.as_chunks::<4>();
        let packet = packets.iter().flat_map(|rays| structure.intersect_packet(&mut stacks, rays)).collect();
        for (how, found) in [("single", single), ("packets", packet)] {
            let found: Vec<Hit> = found;
            let wrong = found.iter().zip(&self.hits).filter(|(a, b)| differ(a, b)).count();
            assert!(wrong <= found.len() / RAYS_A_BORDER, "{name}, {how}: {wrong} of {} differ", found.len());
        }
    }
}

/// Builds and checks all structures over `obj`.
fn check_all(obj: &str) {
    let scene = open(obj);
    let mesh = Mesh::of_scene(&scene);
    assert_eq!(mesh.triangles.len() as u64, scene.manifest().triangles());
    let expected = Expected::new(&scene);
    for leaf_size in [1, 4] {
        expected.check("minimal", &PlainBvh::<Minimal>::build(&mesh, leaf_size));
        expected.check("optimized", &PlainBvh::<Optimized>::build(&mesh, leaf_size));
    }
    let other = [(1, 1), (3, 2), (1000, 100)]
        .map(|(chunk_triangles, whole_units)| Params { chunk_triangles, whole_units });
    for params in [Params::PUBLISHED, Params::TUNED].into_iter().chain(other) {
        expected.check("Ray-Strips", &RayStrips::build(&mesh, params));
    }
    let multi = MultiBvh::build(&mesh);
    expected.check("multi-BVH", &multi);
    expected.check("multi-BVH, single triangles", &SingleTriangles(&multi));
}

#[test]
fn hits_agree_with_the_tracer() {
    check_all(&sample_mesh::obj());
}

#[test]
fn hits_agree_without_connectivity() {
    let mut obj = String::new();
    for i in 0..600 {
        let at = |k: u32| ((i * 3 + k) as f32 * 12.9898).sin() * 43758.547 % 1.0;
        let center = Vec3::new(at(0), at(1), at(2));
        for corner in [Vec3::X, Vec3::Y, Vec3::Z] {
            let p = center + corner * 0.2;
            obj += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
        obj += "f -3 -2 -1\n";
    }
    check_all(&obj);
}

#[test]
fn one_triangle() {
    check_all("v 0 0 0\nv 1 0 -1\nv 0 1 0\nf 1 2 3\n");
}

#[test]
fn strips_hold_every_triangle_once_and_swaps() {
    let scene = open(&sample_mesh::obj());
    let mesh = Mesh::of_scene(&scene);
    let strips = RayStrips::build(&mesh, Params::PUBLISHED);
    let statistics = strips.statistics();
    assert!(statistics.places >= statistics.triangles);
    assert!(statistics.strips >= statistics.chunks);
    assert_eq!(statistics.nodes, 2 * statistics.strips - 1);
    let held = strips.strips().flat_map(|strip| {
        let corners = |i: usize| [strip[i], strip[i + 1], strip[i + 2]];
        (0..strip.len() - 2).map(corners).filter(|[a, b, c]| a != b && b != c && c != a).collect::<Vec<_>>()
    });
    let sorted = |triangles: &mut Vec<[u32; 3]>| {
        triangles.iter_mut().for_each(|corners| corners.sort_unstable());
        triangles.sort_unstable();
    };
    let (mut held, mut all) = (held.collect::<Vec<_>>(), mesh.triangles.clone());
    sorted(&mut held);
    sorted(&mut all);
    assert_eq!(held, all);
}

#[test]
fn bytes_are_those_of_the_paper() {
    let scene = open(&sample_mesh::obj());
    let mesh = Mesh::of_scene(&scene);
    let (n, vertices) = (mesh.triangles.len() as u64, mesh.positions.len() as u64);
    let minimal = PlainBvh::<Minimal>::build(&mesh, 1).bytes();
    assert_eq!((minimal.geometry, minimal.hierarchy), (12 * n + 12 * vertices, 32 * (2 * n - 1)));
    let optimized = PlainBvh::<Optimized>::build(&mesh, 1).bytes();
    assert_eq!((optimized.geometry, optimized.hierarchy), (48 * n, 32 * (2 * n - 1)));
    let strips = RayStrips::build(&mesh, Params::PUBLISHED);
    let Statistics { strips: count, places, tree_nodes, nodes, .. } = strips.statistics();
    let geometry = 12 * vertices + (4 * (places + 2 * count) + 2 * count) as u64;
    assert_eq!(strips.bytes().geometry, geometry);
    assert_eq!(strips.bytes().hierarchy, (32 * nodes + 9 * tree_nodes) as u64);
}
