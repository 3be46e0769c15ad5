//! `cargo xtask table instances [MODEL [COUNT]]`: what it takes to show one model many times, in bytes and in rays a second.

use super::proxy::mesh_file::Mesh;
use crate::clock::{Times, thread_time};
use crate::rays::ray_sets;
use crate::sample_mesh;
use crate::scene::random::Random;
use anyhow::{Context, Result};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use raystrips_convert::{ConvertParams, Unobserved, convert};
use raystrips_geom::{Aabb, Hit, Ray};
use raystrips_meshio::ImportOptions;
use raystrips_tracer::{Scene, Tracer};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::rc::Rc;

pub const USAGE: &str = "cargo xtask table instances [MODEL [COUNT]]";

/// Quadrilaterals around the ring and its tube of the generated model: a million triangles.
const SIDES: [usize; 2] = [1250, 400];
/// Instances where no number is given.
const COUNT: usize = 1000;
/// As many are repeated too, to be compared.
const FEW: usize = 16;
/// Rounds in which every scene is traced once.
const ROUNDS: usize = 5;

/// Prints a row for each way to show the model.
pub fn print(arguments: &[String]) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let mesh = match arguments.first() {
        Some(path) => Mesh::read(Path::new(path))?,
        None => {
            let (positions, triangles) = sample_mesh::ring(SIDES);
            Mesh { positions, triangles, ..Mesh::default() }
        }
    };
    let count = arguments.get(1).map_or(Ok(COUNT), |text| text.parse()).context("COUNT is no number")?;
    let mut rows = Vec::new();
    for (name, count, instances) in [
        ("alone".to_owned(), 1, true),
        (format!("{FEW} copies"), FEW, false),
        (format!("{FEW} instances"), FEW, true),
        (format!("{count} instances"), count, true),
    ] {
        let input = write(&mesh, folder.path(), &places(&mesh, count))?;
        rows.push(Row::new(name, &input, &folder.path().join("a.rsp"), instances)?);
    }
    let around_each: Vec<Option<Row>> = rows.iter().map(|row| row.around_each(&rows[0])).collect();
    let mut rows: Vec<Row> =
        rows.into_iter().zip(around_each).flat_map(|(row, around)| [Some(row), around]).flatten().collect();
    for _ in 0..ROUNDS {
        rows.iter_mut().for_each(Row::trace);
    }
    println!(
        "| scene | triangles shown | file bytes | more than alone, an instance | bytes in memory | primary | ao | bounce2 | chord |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    rows.iter().for_each(|row| row.print(&rows[0]));
    println!(
        "\nMillion rays a second of one thread's processor time, closest hit, the median of {ROUNDS} rounds of all in turn; \
         behind it the speed beside the first row's in the same round. Rays are those of a picture of the whole scene, which \
         pass by more the more is shown; \"around each\": those of the first row, each around an instance by chance."
    );
    Ok(())
}

/// A scene that is traced.
struct Row {
    name: String,
    scene: Rc<Scene>,
    sets: [Vec<Ray>; 4],
    times: [Times; 4],
}

impl Row {
    fn new(name: String, input: &Path, pack: &Path, instances: bool) -> Result<Row> {
        let import = ImportOptions { instances, ..ImportOptions::default() };
        let params = ConvertParams { proxies: None, import, ..ConvertParams::default() };
        convert(&[input.to_owned()], pack, &params, &Unobserved)?;
        let scene = Rc::new(Scene::open(pack)?);
        let sets = ray_sets(&scene);
        Ok(Row { name, scene, sets, times: Default::default() })
    }

    /// The same scene with the rays of another one, whose model is shown here by instances, if there are any.
    fn around_each(&self, alone: &Row) -> Option<Row> {
        let instances = &self.scene.pack().instances;
        if instances.is_empty() {
            return None;
        }
        let mut random = Random::new(&[2]);
        let mut moved = |ray: &Ray| {
            let place = instances[(random.unit() * instances.len() as f64) as usize].world_from_local();
            let org = place.transform_point3(ray.org.as_dvec3()).as_vec3();
            Ray { org, dir: place.transform_vector3(ray.dir.as_dvec3()).as_vec3(), ..*ray }
        };
        Some(Row {
            name: format!("{}, around each", self.name),
            scene: self.scene.clone(),
            sets: alone.sets.each_ref().map(|rays| rays.iter().map(&mut moved).collect()),
            times: Default::default(),
        })
    }

    fn trace(&mut self) {
        let mut tracer = Tracer::new(&self.scene);
        for (rays, times) in self.sets.iter().zip(&mut self.times) {
            let mut hits = vec![Hit::MISS; rays.len()];
            let begin = thread_time();
            tracer.intersect_batch(rays, std::hint::black_box(&mut hits));
            times.push(thread_time() - begin);
        }
    }

    fn print(&self, alone: &Row) {
        let (pack, one) = (self.scene.pack(), alone.scene.pack());
        let instances = pack.instances.len();
        let each = match instances {
            0 => String::new(),
            _ => format!("{:.1}", (pack.file_bytes as f64 - one.file_bytes as f64) / instances as f64),
        };
        print!(
            "| {} | {} | {} | {each} | {} |",
            self.name,
            self.scene.manifest().shown,
            pack.file_bytes,
            pack.resident_bytes() + self.scene.page_bytes(),
        );
        let columns = self.sets.iter().zip(&alone.sets).zip(self.times.iter().zip(&alone.times));
        for ((rays, base_rays), (times, base)) in columns {
            let rate = rays.len() as f64 / times.median() / 1e6;
            let ratio = base.ratio_to(times) * rays.len() as f64 / base_rays.len() as f64;
            print!(" {rate:.2} ({ratio:.2}) |");
        }
        println!();
    }
}

/// Where the mesh is shown `count` times, turned by chance, in a cube of cells of its size.
fn places(mesh: &Mesh, count: usize) -> Vec<DAffine3> {
    if count == 1 {
        return vec![DAffine3::IDENTITY];
    }
    let bounds = Aabb::of_points(mesh.positions.iter().copied());
    let (size, center) = (f64::from(bounds.diagonal()), bounds.center().as_dvec3());
    let side = (1..).find(|side| side * side * side >= count).expect("some cube is large enough");
    let mut random = Random::new(&[1]);
    let mut place = |i: usize| {
        let mut unit = || random.unit();
        let axis = DVec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5).normalize_or(DVec3::Y);
        let turn = DQuat::from_axis_angle(axis, std::f64::consts::TAU * unit());
        let cell = DVec3::new((i % side) as f64, (i / side % side) as f64, (i / side / side) as f64);
        DAffine3::from_rotation_translation(turn, cell * size - turn * center)
    };
    (0..count).map(&mut place).collect()
}

/// A glTF file in `folder` that shows the mesh at these places.
fn write(mesh: &Mesh, folder: &Path, places: &[DAffine3]) -> Result<PathBuf> {
    let numbers = mesh.positions.iter().flat_map(|p| p.to_array());
    let mut bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    let indices_at = bytes.len();
    bytes.extend(mesh.triangles.as_flattened().iter().flat_map(|index| index.to_le_bytes()));
    std::fs::write(folder.join("mesh.bin"), &bytes)?;
    let node = |place: &DAffine3| json!({"mesh": 0, "matrix": DMat4::from(*place).to_cols_array()});
    let view = |from: usize, to: usize| json!({"buffer": 0, "byteOffset": from, "byteLength": to - from});
    let (vertices, corners) = (mesh.positions.len(), 3 * mesh.triangles.len());
    let document = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": (0..places.len()).collect::<Vec<_>>()}],
        "nodes": places.iter().map(node).collect::<Vec<_>>(),
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"uri": "mesh.bin", "byteLength": bytes.len()}],
        "bufferViews": [view(0, indices_at), view(indices_at, bytes.len())],
        "accessors": [
            {"bufferView": 0, "type": "VEC3", "componentType": 5126, "count": vertices},
            {"bufferView": 1, "type": "SCALAR", "componentType": 5125, "count": corners},
        ],
    });
    let path = folder.join("instances.gltf");
    std::fs::write(&path, document.to_string())?;
    Ok(path)
}
