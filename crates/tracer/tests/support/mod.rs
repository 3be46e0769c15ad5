//! Models as packs and as triangles, and random numbers.
#![allow(dead_code)] // Each test takes what it needs.

use glam::{DVec3, Vec3};
use raystrips_convert::{ConvertParams, StripParams, Unobserved, convert};
use raystrips_meshio::{ImportOptions, TriangleBatch, TriangleSink, import};
use raystrips_tracer::Scene;
use std::path::{Path, PathBuf};

/// A model as a pack and, read on its own, as triangles.
pub struct Model {
    pub name: String,
    pub scene: Scene,
    /// In the space of the pack.
    pub triangles: Vec<[Vec3; 3]>,
    /// Around each triangle, and somewhat larger: to pass over most triangles quickly.
    pub spheres: Vec<Sphere>,
    pub diagonal: f64,
}

#[derive(Clone, Copy)]
pub struct Sphere {
    center: DVec3,
    radius: f64,
}

impl Sphere {
    fn around(corners: &[Vec3; 3]) -> Sphere {
        let corners = corners.map(|p| p.as_dvec3());
        let center = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = corners.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        Sphere { center, radius }
    }

    /// Whether the line, `dir` of unit length, passes clearly outside.
    #[inline]
    pub fn is_missed_by(&self, org: DVec3, dir: DVec3) -> bool {
        let to_center = self.center - org;
        let along = to_center.dot(dir);
        let radius = self.radius + 1e-5 * (along.abs() + self.radius);
        to_center.length_squared() - along * along > radius * radius * 1.0001
    }
}

impl Model {
    pub fn convert(path: &Path, max_windows: usize) -> Result<Model, String> {
        let params =
            ConvertParams { strips: StripParams { max_windows }, proxies: None, ..ConvertParams::default() };
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        let pack = folder.path().join("model.rsp");
        convert(&[path.to_owned()], &pack, &params, &Unobserved).map_err(|e| e.to_string())?;
        let scene = Scene::open(&pack).map_err(|e| e.to_string())?;
        let mut soup =
            Soup { offset: DVec3::from_array(scene.manifest().scene_offset), triangles: Vec::new() };
        import(&[path.to_owned()], &ImportOptions::default(), &mut soup).map_err(|e| e.to_string())?;
        let diagonal = f64::from(scene.bounds().diagonal());
        let spheres = soup.triangles.iter().map(Sphere::around).collect();
        Ok(Model { name: path.display().to_string(), scene, triangles: soup.triangles, spheres, diagonal })
    }
}

struct Soup {
    offset: DVec3,
    triangles: Vec<[Vec3; 3]>,
}

impl TriangleSink for Soup {
    fn batch(&mut self, batch: TriangleBatch) -> std::io::Result<()> {
        let place = |v: u32| (DVec3::from_array(batch.positions[v as usize]) - self.offset).as_vec3();
        self.triangles.extend(batch.triangles.iter().map(|t| t.map(place)));
        Ok(())
    }
}

/// Every model file of the corpus; empty, with a word on it, where there is none.
pub fn corpus() -> Vec<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/models");
    let folder = std::env::var_os("RAYSTRIPS_MODELS").map_or(beside, PathBuf::from);
    let mut files = Vec::new();
    collect(&folder, &mut files);
    files.sort();
    if files.is_empty() {
        eprintln!("skipped: no model corpus at {}; name one with RAYSTRIPS_MODELS", folder.display());
    }
    files
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if matches!(path.extension().and_then(|e| e.to_str()), Some("obj" | "ply" | "gltf" | "glb")) {
            files.push(path);
        }
    }
}

/// Splitmix64.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub fn direction(&mut self) -> Vec3 {
        let z = 2.0 * self.unit() - 1.0;
        let angle = std::f32::consts::TAU * self.unit();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * angle.cos(), r * angle.sin(), z)
    }
}
