//! A scene as files of ours, and its picture.

use super::picture::Picture;
use super::scene::{Color, Light, Part, Scene, Surface};
use crate::output::write_whole;
use anyhow::{Result, bail};
use glam::DVec3;
use raystrips_convert::{ConvertParams, Unobserved, convert};
use raystrips_render::{RenderParams, TracedWorld, render};
use std::fmt::Write;
use std::path::Path;

/// Name of the scene file.
const FILE: &str = "scene.toml";

/// Writes the scene file, and a material library for each mesh, which has the textures.
pub fn write(scene: &Scene, folder: &Path) -> Result<()> {
    for part in &scene.parts {
        write_whole(&folder.join(format!("{}.mtl", part.name)), library(part)?.as_bytes())?;
    }
    write_whole(&folder.join(FILE), scene_file(scene)?.as_bytes())
}

fn library(part: &Part) -> Result<String> {
    let mut text = format!("newmtl {}\n", part.name);
    if let Color::Textured(texture) = part.surface.color() {
        writeln!(text, "map_Kd {}", texture.file())?;
    }
    match part.surface {
        Surface::Bumpy(_, normals) => writeln!(text, "norm {}", normals.file())?,
        Surface::CutOut(_, opacity) => writeln!(text, "map_d {}", opacity.file())?,
        _ => {}
    }
    Ok(text)
}

fn scene_file(scene: &Scene) -> Result<String> {
    let mut text = String::from("# Written by cargo xtask compare mitsuba.\n\n[camera]\n");
    let vector = |v: DVec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
    writeln!(text, "position = {}\ntarget = {}", vector(scene.position), vector(scene.target))?;
    writeln!(text, "vertical_fov_degrees = {:?}\n", scene.vertical_fov_degrees)?;
    writeln!(text, "[sky]\ncolor = {:?}\n", scene.sky)?;
    for light in &scene.lights {
        match *light {
            Light::Point { position, intensity } => {
                writeln!(text, "[[light]]\ntype = \"point\"\nposition = {}", vector(position))?;
                writeln!(text, "intensity = {intensity:?}\n")?;
            }
            Light::Directional { direction, irradiance } => {
                writeln!(text, "[[light]]\ntype = \"directional\"\ndirection = {}", vector(direction))?;
                writeln!(text, "intensity = {irradiance:?}\n")?;
            }
        }
    }
    for part in &scene.parts {
        let name = &part.name;
        writeln!(text, "[[material]]\nname = \"{name}\"\n{}", material(&part.surface))?;
        writeln!(text, "[[model]]\nfile = \"{name}.obj\"\n")?;
    }
    Ok(text)
}

fn material(surface: &Surface) -> String {
    let color = match surface.color() {
        Color::Rgb(color) => format!("base_color = {color:?}\n"),
        Color::Textured(_) => "base_color = [1.0, 1.0, 1.0]\n".into(),
    };
    let rest = match *surface {
        Surface::Matte(_) | Surface::Bumpy(..) | Surface::CutOut(..) => String::new(),
        Surface::Lamp { radiance, .. } => format!("emission = {radiance:?}\n"),
        Surface::WhiteMetal { roughness } | Surface::Metal { roughness, .. } => {
            format!("metallic = 1.0\nroughness = {roughness:?}\n")
        }
        Surface::Glass { roughness } => {
            format!("transmission = 1.0\nior = 1.5\nroughness = {roughness:?}\n")
        }
        Surface::Plastic { roughness, .. } => format!("ior = 1.5\nroughness = {roughness:?}\n"),
    };
    color + &rest
}

/// Renders what [`write`] has written; the seconds are those of the rendering alone.
pub fn picture(folder: &Path, [width, height]: [u32; 2], spp: u32, bounces: u32) -> Result<(Picture, f64)> {
    let pack = folder.join("scene.rsp");
    let report = convert(&[folder.join(FILE)], &pack, &ConvertParams::default(), &Unobserved)?;
    if let Some(warning) = report.warnings.first() {
        bail!("{warning}");
    }
    let world = TracedWorld::new(raystrips_tracer::Scene::open(&pack)?);
    let params = RenderParams { width, height, spp, max_bounces: bounces, ..RenderParams::default() };
    let output = render(&world, &params, &|_| ())?;
    let pixels = (0..(width * height) as usize).map(|pixel| output.film.rgb(pixel)).collect();
    Ok((Picture { size: [width, height], pixels }, output.stats.seconds.total))
}
