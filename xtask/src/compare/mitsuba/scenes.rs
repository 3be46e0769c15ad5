//! The scenes: each shows something that both renderers have a model of.

use super::mesh::{Mesh, Vertex};
use super::scene::{Color, Light, Part, Scene, Surface};
use super::texture::Texture;
use crate::scene::random::Random;
use anyhow::{Context, Result};
use glam::{DMat3, DVec3, EulerRot};
use raystrips_geom::scene::Projection;
use raystrips_meshio::{ImportOptions, TriangleBatch, TriangleSink, import};
use std::f64::consts::TAU;
use std::io;
use std::path::Path;

const GRAY: Color = Color::Rgb([0.5; 3]);
const WHITE: Color = Color::Rgb([0.8; 3]);
const DIM_SKY: [f32; 3] = [0.3, 0.35, 0.4];

/// All of them.
pub fn all(root: &Path) -> Result<Vec<Scene>> {
    let mut scenes = vec![cornell(&root.join("scenes/cornell/scene.toml"))?];
    scenes.extend(generated());
    Ok(scenes)
}

/// Those that need no files.
pub fn generated() -> Vec<Scene> {
    vec![textured(), lights(), metal(), glass(), frosted(), leaves(), bumpy(), plastic()]
}

/// The Cornell box of the repository, a mesh for each material.
fn cornell(file: &Path) -> Result<Scene> {
    let mut batches = Batches(Vec::new());
    let import = import(&[file.to_owned()], &ImportOptions::default(), &mut batches)?.scene;
    let camera = import.cameras.first().context("the Cornell box has no camera")?;
    let position = DVec3::from(camera.position);
    let Projection::Perspective { vertical_fov } = camera.projection else {
        anyhow::bail!("the camera of the Cornell box has no perspective");
    };
    let mut parts: Vec<Part> = Vec::new();
    for batch in batches.0 {
        let geometry = &import.geometries[batch.geometry as usize];
        let material = &import.materials[geometry.material as usize];
        let vertex = |position: &[f64; 3]| Vertex { position: DVec3::from(*position), ..Vertex::default() };
        let vertices = batch.positions.iter().map(vertex).collect();
        let mesh = Mesh { vertices, triangles: batch.triangles, is_smooth: false };
        let surface = match material.is_lamp() {
            true => Surface::Lamp { radiance: material.emission, gray: material.base_color[0] },
            false => Surface::Matte(Color::Rgb(material.base_color)),
        };
        match parts.iter_mut().find(|part| part.name == material.name) {
            Some(part) => part.mesh.append(&mesh),
            None => parts.push(Part { name: material.name.clone(), mesh, surface }),
        }
    }
    Ok(Scene {
        name: "cornell",
        position,
        target: position + DVec3::from(camera.forward.map(f64::from)),
        vertical_fov_degrees: vertical_fov.to_degrees(),
        sky: [0.0; 3],
        lights: Vec::new(),
        parts,
    })
}

/// Keeps what is imported.
struct Batches(Vec<TriangleBatch>);

impl TriangleSink for Batches {
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()> {
        self.0.push(batch);
        Ok(())
    }
}

fn part(name: &str, mesh: Mesh, surface: Surface) -> Part {
    Part { name: name.to_owned(), mesh, surface }
}

/// A floor with things on it, seen from above.
fn on_floor(name: &'static str, sky: [f32; 3], floor: Surface, things: Vec<Part>) -> Scene {
    let mut parts = vec![part("floor", Mesh::floor(12.0, 3.0), floor)];
    parts.extend(things);
    Scene {
        name,
        position: DVec3::new(0.0, 3.0, 6.0),
        target: DVec3::new(0.0, 0.6, 0.0),
        vertical_fov_degrees: 36.0,
        sky,
        lights: Vec::new(),
        parts,
    }
}

fn checker() -> Surface {
    Surface::Matte(Color::Textured(Texture::Checker))
}

fn lamp() -> Part {
    let surface = Surface::Lamp { radiance: [6.0, 5.5, 5.0], gray: 0.5 };
    part("lamp", Mesh::lamp(DVec3::new(1.0, 5.0, 1.0), 3.0), surface)
}

/// One that is found often enough by what rough glass scatters.
fn wide_lamp() -> Part {
    let surface = Surface::Lamp { radiance: [1.2, 1.1, 1.0], gray: 0.5 };
    part("lamp", Mesh::lamp(DVec3::new(0.0, 5.0, 0.0), 8.0), surface)
}

fn ball(name: &str, x: f64, surface: Surface) -> Part {
    part(name, Mesh::sphere(DVec3::new(x, 0.9, 0.0), 0.9), surface)
}

fn ring(name: &str, x: f64, surface: Surface) -> Part {
    part(name, Mesh::torus(DVec3::new(x, 0.35, 0.0), [0.8, 0.35], [4.0, 2.0]), surface)
}

/// Diffuse surfaces with a texture, under a lamp.
fn textured() -> Scene {
    let bands = Surface::Matte(Color::Textured(Texture::Bands));
    let things = vec![ball("ball", -1.1, bands), ring("ring", 1.2, bands), lamp()];
    on_floor("textured", DIM_SKY, Surface::Matte(GRAY), things)
}

/// Smooth normals and a textured floor, with lights of no extent.
fn lights() -> Scene {
    let red = Surface::Matte(Color::Rgb([0.7, 0.3, 0.2]));
    let things = vec![ball("ball", -1.1, red), ring("ring", 1.2, Surface::Matte(WHITE))];
    let lights = vec![
        Light::Point { position: DVec3::new(-2.5, 4.0, 2.5), intensity: [18.0, 22.0, 26.0] },
        Light::Directional { direction: DVec3::new(-0.6, -1.0, -0.3), irradiance: [1.6, 1.4, 1.0] },
    ];
    Scene { lights, ..on_floor("lights", [0.0; 3], checker(), things) }
}

/// A white metal and a colored one.
fn metal() -> Scene {
    let gold = Surface::Metal { color: [0.95, 0.7, 0.35], roughness: 0.25 };
    let things =
        vec![ball("ball", -1.1, Surface::WhiteMetal { roughness: 0.2 }), ring("ring", 1.2, gold), lamp()];
    on_floor("metal", DIM_SKY, checker(), things)
}

fn glass() -> Scene {
    let clear = Surface::Glass { roughness: 0.0 };
    let things = vec![ball("ball", -1.1, clear), ring("ring", 1.2, clear), lamp()];
    on_floor("glass", [0.6; 3], checker(), things)
}

fn frosted() -> Scene {
    let rough = Surface::Glass { roughness: 0.45 };
    let things = vec![ball("ball", -1.1, rough), ring("ring", 1.2, rough), wide_lamp()];
    on_floor("frosted", [0.6; 3], checker(), things)
}

/// Cut-out leaves in the sun.
fn leaves() -> Scene {
    let mut random = Random::new(&[7]);
    let mut mesh = Mesh::default();
    for i in 0..40 {
        let angle = f64::from(i) * 2.4;
        let (sin, cos) = libm::sincos(angle);
        let distance = random.between(0.2, 1.8);
        let turn = DMat3::from_euler(
            EulerRot::YXZ,
            random.between(0.0, TAU),
            random.between(-1.5, -0.4),
            random.between(-0.4, 0.4),
        );
        let corner = DVec3::new(distance * sin, random.between(0.7, 1.8), distance * cos);
        mesh.append(&Mesh::parallelogram(corner, [turn.x_axis * 0.9, turn.y_axis * 0.9], 1.0));
    }
    let surface = Surface::CutOut(Color::Textured(Texture::Leaf), Texture::LeafShape);
    let sun = Light::Directional { direction: DVec3::new(-0.3, -1.0, -0.4), irradiance: [2.2, 2.0, 1.7] };
    let floor = Surface::Matte(Color::Rgb([0.6, 0.55, 0.5]));
    Scene {
        lights: vec![sun],
        ..on_floor("leaves", [0.3, 0.4, 0.55], floor, vec![part("leaves", mesh, surface)])
    }
}

/// Normals out of a texture, on a flat floor and round things.
fn bumpy() -> Scene {
    let bumpy = |color| Surface::Bumpy(color, Texture::Waves);
    let blue = bumpy(Color::Rgb([0.3, 0.4, 0.7]));
    let things = vec![ball("ball", -1.1, blue), ring("ring", 1.2, bumpy(WHITE))];
    let sun = Light::Directional { direction: DVec3::new(-0.6, -1.0, -0.5), irradiance: [2.0, 1.8, 1.5] };
    Scene { lights: vec![sun], ..on_floor("bumpy", DIM_SKY, bumpy(GRAY), things) }
}

/// A boundary above a diffuse surface.
fn plastic() -> Scene {
    let red = Surface::Plastic { color: Color::Rgb([0.7, 0.15, 0.1]), roughness: 0.1 };
    let bands = Surface::Plastic { color: Color::Textured(Texture::Bands), roughness: 0.2 };
    let things = vec![ball("ball", -1.1, red), ring("ring", 1.2, bands), lamp()];
    on_floor("plastic", DIM_SKY, checker(), things)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cornell_box_is_divided_by_material() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let scene = cornell(&root.join("scenes/cornell/scene.toml")).unwrap();
        let names: Vec<&str> = scene.parts.iter().map(|part| part.name.as_str()).collect();
        assert_eq!(names, ["white", "light", "green", "red"]);
        assert!(scene.parts.iter().all(|part| !part.mesh.triangles.is_empty()));
        assert!((scene.vertical_fov_degrees - 39.3076).abs() < 1e-3);
    }
}
