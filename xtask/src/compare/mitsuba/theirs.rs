//! A scene as a file of Mitsuba, and its picture.

use super::picture::Picture;
use super::scene::{Color, Light, Scene, Surface};
use super::texture::Texture;
use crate::compare::programs::{json, number};
use crate::output::write_whole;
use anyhow::{Context, Result, bail};
use glam::DVec3;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// Name of the scene file.
const FILE: &str = "scene.xml";
/// Renders a scene file and writes its pixels.
const SCRIPT: &str = include_str!("../mitsuba.py");

/// Writes the scene file.
pub fn write(scene: &Scene, folder: &Path, size: [u32; 2], spp: u32, bounces: u32) -> Result<()> {
    write_whole(&folder.join(FILE), scene_file(scene, size, spp, bounces)?.as_bytes())
}

fn scene_file(scene: &Scene, [width, height]: [u32; 2], spp: u32, bounces: u32) -> Result<String> {
    let mut text =
        String::from("<!-- Written by cargo xtask compare mitsuba. -->\n<scene version=\"3.0.0\">\n");
    // Light that passes cut-outs is not found by the shadow rays of `path`. Depth counts the lamp, too.
    let integrator = if scene.is_cut_out() { "volpath" } else { "path" };
    let vector = |v: DVec3| format!("{}, {}, {}", v.x, v.y, v.z);
    writeln!(
        text,
        "<integrator type=\"{integrator}\"><integer name=\"max_depth\" value=\"{}\"/></integrator>\n\
         <sensor type=\"perspective\">\n\
         <string name=\"fov_axis\" value=\"y\"/><float name=\"fov\" value=\"{}\"/>\n\
         <float name=\"near_clip\" value=\"0.001\"/><float name=\"far_clip\" value=\"100000\"/>\n\
         <transform name=\"to_world\"><lookat origin=\"{}\" target=\"{}\" up=\"0, 1, 0\"/></transform>\n\
         <sampler type=\"multijitter\"><integer name=\"sample_count\" value=\"{spp}\"/></sampler>\n\
         <film type=\"hdrfilm\"><integer name=\"width\" value=\"{width}\"/>\
         <integer name=\"height\" value=\"{height}\"/>\n\
         <string name=\"pixel_format\" value=\"rgb\"/><string name=\"component_format\" value=\"float32\"/>\
         <rfilter type=\"box\"/></film>\n</sensor>",
        bounces + 1,
        scene.vertical_fov_degrees,
        vector(scene.position),
        vector(scene.target),
    )?;
    if scene.sky != [0.0; 3] {
        writeln!(text, "<emitter type=\"constant\">{}</emitter>", rgb("radiance", scene.sky))?;
    }
    for light in &scene.lights {
        match *light {
            Light::Point { position: DVec3 { x, y, z }, intensity } => writeln!(
                text,
                "<emitter type=\"point\"><point name=\"position\" x=\"{x}\" y=\"{y}\" z=\"{z}\"/>{}</emitter>",
                rgb("intensity", intensity)
            )?,
            Light::Directional { direction: DVec3 { x, y, z }, irradiance } => writeln!(
                text,
                "<emitter type=\"directional\"><vector name=\"direction\" x=\"{x}\" y=\"{y}\" z=\"{z}\"/>{}</emitter>",
                rgb("irradiance", irradiance)
            )?,
        }
    }
    for part in &scene.parts {
        writeln!(
            text,
            "<shape type=\"obj\"><string name=\"filename\" value=\"{}.obj\"/>\
             <boolean name=\"face_normals\" value=\"{}\"/>\n{}\n</shape>",
            part.name,
            !part.mesh.is_smooth,
            surface(&part.surface)
        )?;
    }
    text.push_str("</scene>\n");
    Ok(text)
}

fn rgb(name: &str, [r, g, b]: [f32; 3]) -> String {
    format!("<rgb name=\"{name}\" value=\"{r}, {g}, {b}\"/>")
}

fn color(name: &str, color: Color) -> String {
    match color {
        Color::Rgb(color) => rgb(name, color),
        Color::Textured(texture) => bitmap(name, texture, false),
    }
}

/// A texture; `is_raw`: not of colors.
fn bitmap(name: &str, texture: Texture, is_raw: bool) -> String {
    format!(
        "<texture type=\"bitmap\" name=\"{name}\"><string name=\"filename\" value=\"{}\"/>\
         <boolean name=\"raw\" value=\"{is_raw}\"/></texture>",
        texture.file()
    )
}

fn bsdf(kind: &str, inside: &str) -> String {
    format!("<bsdf type=\"{kind}\">{inside}</bsdf>")
}

fn surface(surface: &Surface) -> String {
    let matte = bsdf("diffuse", &color("reflectance", surface.color()));
    let alpha = |roughness: f32| {
        let alpha = roughness * roughness;
        format!("<string name=\"distribution\" value=\"ggx\"/><float name=\"alpha\" value=\"{alpha}\"/>")
    };
    let ior = "<float name=\"int_ior\" value=\"1.5\"/><float name=\"ext_ior\" value=\"1\"/>";
    match *surface {
        Surface::Matte(_) => bsdf("twosided", &matte),
        Surface::Bumpy(_, normals) => {
            // By default light that comes flat to the surface is dimmed (Estevez, Lecocq, Stein 2019).
            let plain = "<boolean name=\"use_shadowing_function\" value=\"false\"/>";
            let inside = bitmap("normalmap", normals, true) + plain + &matte;
            bsdf("twosided", &bsdf("normalmap", &inside))
        }
        Surface::CutOut(_, opacity) => {
            bsdf("mask", &(bitmap("opacity", opacity, true) + &bsdf("twosided", &matte)))
        }
        Surface::Lamp { radiance, .. } => {
            bsdf("twosided", &matte)
                + &format!("<emitter type=\"area\">{}</emitter>", rgb("radiance", radiance))
        }
        Surface::WhiteMetal { roughness } => {
            let material = "<string name=\"material\" value=\"none\"/>";
            bsdf("twosided", &bsdf("roughconductor", &(alpha(roughness) + material)))
        }
        Surface::Metal { color, roughness } => {
            let numbers = format!(
                "<float name=\"metallic\" value=\"1\"/><float name=\"roughness\" value=\"{roughness}\"/>"
            );
            bsdf("twosided", &bsdf("principled", &(rgb("base_color", color) + &numbers)))
        }
        Surface::Glass { roughness: 0.0 } => bsdf("dielectric", ior),
        Surface::Glass { roughness } => bsdf("roughdielectric", &(alpha(roughness) + ior)),
        Surface::Plastic { color: below, roughness } => {
            let below = color("diffuse_reflectance", below);
            bsdf("twosided", &bsdf("roughplastic", &(alpha(roughness) + ior + &below)))
        }
    }
}

/// Renders what [`write`] has written; the seconds are those of the rendering alone.
pub fn picture(python: &str, folder: &Path, size: [u32; 2]) -> Result<(Picture, f64)> {
    let pixels = folder.join("mitsuba.f32");
    let mut command = Command::new(python);
    command.arg("-c").arg(SCRIPT).arg(folder.join(FILE)).arg(&pixels);
    let answer =
        json(&mut command).context("Mitsuba did not render; it comes with pip install mitsuba numpy")?;
    let bytes = std::fs::read(&pixels).with_context(|| pixels.display().to_string())?;
    let values: Vec<f32> = bytes.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    let pixels = values.as_chunks().0.to_vec();
    if pixels.len() != (size[0] * size[1]) as usize {
        bail!("Mitsuba made {} pixels of {}x{}", pixels.len(), size[0], size[1]);
    }
    Ok((Picture { size, pixels }, number(&answer, "seconds")?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::mitsuba::scenes;

    #[test]
    fn elements_are_closed() {
        for scene in scenes::generated() {
            let text = scene_file(&scene, [16, 16], 4, 8).unwrap();
            let of = |mark: &str| text.matches(mark).count();
            for element in ["bsdf", "texture", "shape", "emitter"] {
                assert_eq!(of(&format!("<{element} ")), of(&format!("</{element}>")), "{}", scene.name);
            }
            assert_eq!(of("value=\"volpath\"") + of("type=\"volpath\""), usize::from(scene.is_cut_out()));
        }
    }
}
