//! `cargo xtask table light`: the photon integrator against the path tracer, where both must find the same light.

use anyhow::{Context, Result};
use raystrips_convert::{ConvertParams, Unobserved, convert};
use raystrips_render::{Integrator, PhotonParams, RenderParams, TracedWorld, render};
use raystrips_tracer::Scene;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::Path;

/// Pixels on a side: the mean of all is compared.
const SIDE: u32 = 96;
/// Samples of the path-traced reference: few of its paths find the lamp through glass.
const REFERENCE_SPP: u32 = 1024;
const PHOTON_SPP: u32 = 64;

/// Both integrators on a scene.
struct Row {
    name: &'static str,
    path: f64,
    photon: f64,
    asked: f64,
}

/// Prints how far apart the integrators are.
pub fn print(root: &Path) -> Result<()> {
    println!("| scene | path tracer | photons | apart | asked |\n|---|---:|---:|---:|---:|");
    let folder = tempfile::tempdir()?;
    let sphere = folder.path().join("sphere.toml");
    write_sphere(folder.path(), &sphere)?;
    let cornell = root.join("scenes/cornell/scene.toml");
    for (name, scene, asked) in [
        ("diffuse Cornell box, mean radiance", cornell, 1.0),
        ("caustic of a glass sphere, mean radiance of the floor below", sphere, 3.0),
    ] {
        let row = compare(name, &scene, asked, folder.path()).with_context(|| scene.display().to_string())?;
        println!(
            "| {} | {:.5} | {:.5} | {:.2} % | {} % |",
            row.name,
            row.path,
            row.photon,
            100.0 * (row.photon / row.path - 1.0),
            row.asked,
        );
    }
    Ok(())
}

fn compare(name: &'static str, scene: &Path, asked: f64, folder: &Path) -> Result<Row> {
    let pack = folder.join("scene.rsp");
    convert(&[scene.to_owned()], &pack, &ConvertParams::default(), &Unobserved)?;
    let world = TracedWorld::new(Scene::open(&pack)?);
    let mean = |integrator, spp| -> Result<f64> {
        let photons = PhotonParams { count: 1_000_000, nearest: 100, passes: 8, gather_rays: 1 };
        let params = RenderParams {
            integrator,
            photons,
            width: SIDE,
            height: SIDE,
            spp,
            max_bounces: 16,
            ..RenderParams::default()
        };
        let film = render(&world, &params, &|_| ())?.film;
        let pixels = (SIDE * SIDE) as usize;
        let light = (0..pixels).flat_map(|pixel| film.rgb(pixel)).map(f64::from).sum::<f64>();
        Ok(light / (3 * pixels) as f64)
    };
    let (path, photon) = (mean(Integrator::Path, REFERENCE_SPP)?, mean(Integrator::Photon, PHOTON_SPP)?);
    Ok(Row { name, path, photon, asked })
}

/// A glass sphere between a lamp and a floor. The camera is right below it, so that it sees nothing but what the sphere
/// makes of the lamp's light.
fn write_sphere(folder: &Path, scene: &Path) -> Result<()> {
    std::fs::write(folder.join("sphere.obj"), sphere_obj(160))?;
    std::fs::write(folder.join("floor.obj"), "v -2 0 -2\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nf 1 2 3 4\n")?;
    std::fs::write(folder.join("lamp.obj"), "v -.3 3 -.3\nv .3 3 -.3\nv .3 3 .3\nv -.3 3 .3\nf 1 2 3 4\n")?;
    let text = r#"
camera = { position = [0.0, 0.44, 0.0], target = [0.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], vertical_fov_degrees = 80 }
sky = { color = [0.0, 0.0, 0.0] }
material = [
    { name = "glass", base_color = [1.0, 1.0, 1.0], roughness = 0.0, transmission = 1.0, ior = 1.5 },
    { name = "floor", base_color = [0.5, 0.5, 0.5] },
    { name = "lamp", base_color = [0.0, 0.0, 0.0], emission = [10.0, 10.0, 10.0] },
]
model = [
    { file = "sphere.obj", material = "glass" },
    { file = "floor.obj", material = "floor" },
    { file = "lamp.obj", material = "lamp" },
]
"#;
    Ok(std::fs::write(scene, text)?)
}

/// A sphere of radius 0.5 around (0, 1, 0), from rings of so many vertices.
fn sphere_obj(rings: u32) -> String {
    let mut text = String::new();
    let columns = 2 * rings;
    let mut vertex = |latitude: f64, longitude: f64| {
        let (sin, cos) = libm::sincos(latitude);
        let (x, z) = libm::sincos(longitude);
        _ = writeln!(text, "v {} {} {}", 0.5 * sin * x, 1.0 + 0.5 * cos, 0.5 * sin * z);
    };
    (0..=rings).for_each(|row| {
        (0..columns).for_each(|column| {
            vertex(PI * f64::from(row) / f64::from(rings), TAU * f64::from(column) / f64::from(columns));
        });
    });
    for row in 0..rings {
        for column in 0..columns {
            let number = |row: u32, column: u32| row * columns + column % columns + 1;
            let [a, b] = [number(row, column), number(row, column + 1)];
            let [c, d] = [number(row + 1, column + 1), number(row + 1, column)];
            _ = writeln!(text, "f {a} {d} {c} {b}");
        }
    }
    text
}
