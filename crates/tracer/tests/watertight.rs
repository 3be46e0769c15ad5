//! No ray gets out of a closed mesh, aimed at edges and vertices above all.

#![allow(clippy::unwrap_used, reason = "a test")]

mod support;

use glam::Vec3;
use rayon::prelude::*;
use raystrips_geom::Ray;
use raystrips_tracer::{Kernel, Tracer};
use std::io::Write;
use std::path::Path;
use support::{Model, Random};

/// Rays of the test that always runs; RAYSTRIPS_WATERTIGHT_RAYS sets another number.
const RAYS: u64 = 10_000_000;

#[test]
fn no_ray_gets_out() {
    let rays = std::env::var("RAYSTRIPS_WATERTIGHT_RAYS").ok().and_then(|n| n.parse().ok()).unwrap_or(RAYS);
    check(rays);
}

#[test]
#[ignore = "takes minutes: a hundred times the rays"]
fn no_ray_gets_out_long() {
    check(RAYS * 100);
}

fn check(rays: u64) {
    let folder = tempfile::tempdir().unwrap();
    let blobs = [
        Blob { name: "round", rings: 40, size: 1.0, center: Vec3::ZERO, roughness: 0.0, strip_windows: 1 },
        Blob {
            name: "rough",
            rings: 150,
            size: 3.0,
            center: Vec3::new(0.3, -0.2, 0.1),
            roughness: 0.5,
            strip_windows: 1,
        },
        Blob {
            name: "far",
            rings: 60,
            size: 10.0,
            center: Vec3::new(55.0, -70.0, 31.0),
            roughness: 0.3,
            strip_windows: 7,
        },
    ];
    let per_blob = rays / (blobs.len() * Kernel::available().len()) as u64;
    for blob in blobs {
        let path = folder.path().join(format!("{}.ply", blob.name));
        blob.write(&path);
        let model = Model::convert(&path, blob.strip_windows).unwrap();
        for &kernel in Kernel::available() {
            let escapes = escapes(&model, blob.center, kernel, per_blob);
            eprintln!("{}, {}: {per_blob} rays, {escapes} escapes", blob.name, kernel.name());
            assert_eq!(escapes, 0);
        }
    }
}

/// Rays from near the center to vertices, to points of edges, and straight along the axes, that hit nothing.
fn escapes(model: &Model, center: Vec3, kernel: Kernel, rays: u64) -> u64 {
    const CHUNK: u64 = 1 << 16;
    let count = |chunk: u64| {
        let mut random = Random(chunk + 1);
        let mut tracer = Tracer::with_kernel(&model.scene, kernel);
        let ray = |random: &mut Random| {
            let org = center + random.direction() * random.unit() * 0.1;
            let [a, b, _] = model.triangles[random.below(model.triangles.len())];
            let target = match random.below(4) {
                0 => a,
                1 => a.lerp(b, random.unit()),
                2 => a.lerp(b, 0.5),
                _ => {
                    // In a plane with the vertex: the direction has a component of zero.
                    let axis = random.below(3);
                    let mut target = a;
                    target[axis] = org[axis];
                    target
                }
            };
            Ray::new(org, target - org)
        };
        let n = CHUNK.min(rays - chunk * CHUNK);
        (0..n).filter(|_| !tracer.intersect(&ray(&mut random)).is_hit()).count() as u64
    };
    (0..rays.div_ceil(CHUNK)).into_par_iter().map(count).sum()
}

/// A sphere of rings of quads with a bumpy surface: closed, with two vertices of high valence.
struct Blob {
    name: &'static str,
    rings: usize,
    size: f32,
    center: Vec3,
    roughness: f32,
    strip_windows: usize,
}

impl Blob {
    fn write(&self, path: &Path) {
        let sectors = self.rings * 2;
        let point = |ring: usize, sector: usize| {
            let (theta, phi) = (
                std::f32::consts::PI * ring as f32 / self.rings as f32,
                std::f32::consts::TAU * (sector % sectors) as f32 / sectors as f32,
            );
            let bump = Random((ring * 1009 + sector % sectors) as u64).unit();
            let radius = self.size * (1.0 + self.roughness * (bump - 0.5));
            self.center + Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * radius
        };
        let mut vertices = vec![point(0, 0), point(self.rings, 0)];
        for ring in 1..self.rings {
            vertices.extend((0..sectors).map(|sector| point(ring, sector)));
        }
        let at = |ring: usize, sector: usize| match ring {
            0 => 0,
            r if r == self.rings => 1,
            r => 2 + (r - 1) * sectors + sector % sectors,
        };
        let mut faces = Vec::new();
        for ring in 0..self.rings {
            for sector in 0..sectors {
                let [a, b, c, d] =
                    [at(ring, sector), at(ring, sector + 1), at(ring + 1, sector + 1), at(ring + 1, sector)];
                faces.extend(
                    [[a, b, c], [a, c, d]].into_iter().filter(|[x, y, z]| x != y && y != z && x != z),
                );
            }
        }
        let mut out = std::fs::File::create(path).unwrap();
        write!(
            out,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
             property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            vertices.len(),
            faces.len()
        )
        .unwrap();
        let mut bytes = Vec::new();
        vertices.iter().for_each(|v| bytes.extend(v.to_array().into_iter().flat_map(f32::to_le_bytes)));
        for face in faces {
            bytes.push(3);
            face.iter().for_each(|&v| bytes.extend((v as i32).to_le_bytes()));
        }
        out.write_all(&bytes).unwrap();
    }
}
