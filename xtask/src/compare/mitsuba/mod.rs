//! `cargo xtask compare mitsuba`: our pictures beside those of an independent path tracer, Mitsuba 3.
//!
//! Both read the same meshes and textures; a scene is said once and written for each. Pictures are compared by the mean of
//! each channel and by structural similarity.

mod mesh;
mod ours;
mod picture;
mod scene;
mod scenes;
mod texture;
mod theirs;

use crate::flags::Flags;
use crate::output::write_whole;
use anyhow::{Context, Result, bail};
use picture::{Panel, Picture, apart, ssim};
use scene::Scene;
use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "usage: cargo run --release -p xtask -- compare mitsuba -o DIR [--python PYTHON] \
                     [--size 256x256] [--spp N] [--only SCENE]";
/// Samples a pixel, if not told otherwise: similarity of flat surfaces is lost to noise first.
const SPP: u64 = 1024;
/// Surfaces of a path at most: glass needs many.
const BOUNCES: u32 = 24;
/// About how wide each picture is in the one that shows all.
const STRIP_WIDTH: u32 = 128;

/// Prints a table, and leaves scenes and pictures in a folder.
pub fn task(root: &Path, arguments: &[String]) -> Result<ExitCode> {
    let flags = Flags::parse(arguments, &["-o", "--python", "--size", "--spp", "--only"], &[])?;
    let Some(folder) = flags.value("-o").filter(|_| flags.rest.is_empty()) else { bail!(USAGE) };
    let folder = std::path::absolute(folder)?;
    let python = flags.value("--python").unwrap_or("python3");
    let size = size(flags.value("--size").unwrap_or("256x256"))?;
    let spp = u32::try_from(flags.count("--spp")?.unwrap_or(SPP).max(1)).context("--spp: too many")?;
    let only = flags.value("--only");
    println!("| scene | mean, ours | mean, Mitsuba | apart | SSIM | s, ours | s, Mitsuba |");
    println!("|---|---|---|---:|---:|---:|---:|");
    let mut strip = Vec::new();
    let scenes = scenes::all(root)?;
    for scene in scenes.iter().filter(|scene| only.is_none_or(|name| name == scene.name)) {
        let of_scene = folder.join(scene.name);
        let compared = compare(scene, &of_scene, python, size, spp).context(scene.name)?;
        println!("{}", compared.row(scene.name));
        let Compared { ours, theirs, .. } = &compared;
        let panel = Panel::comparison(ours, theirs, 1, true);
        write_whole(&folder.join(format!("{}.png", scene.name)), &panel.png()?)?;
        let shrink = (size[0] / STRIP_WIDTH).max(1);
        strip.push(Panel::comparison(ours, theirs, shrink, false));
    }
    if strip.is_empty() {
        let names: Vec<&str> = scenes.iter().map(|scene| scene.name).collect();
        bail!("--only: there is no such scene; there are {}", names.join(", "));
    }
    write_whole(&folder.join("mitsuba.png"), &Panel::beside(&strip).png()?)?;
    Ok(ExitCode::SUCCESS)
}

/// Both pictures of a scene, and the seconds that each took.
struct Compared {
    ours: Picture,
    theirs: Picture,
    seconds: [f64; 2],
}

impl Compared {
    fn row(&self, name: &str) -> String {
        let mean = |picture: &Picture| picture.mean().map(|x| format!("{x:.4}")).join(" ");
        format!(
            "| {name} | {} | {} | {:.2} % | {:.4} | {:.1} | {:.1} |",
            mean(&self.ours),
            mean(&self.theirs),
            100.0 * apart(&self.ours, &self.theirs),
            ssim(&self.ours, &self.theirs),
            self.seconds[0],
            self.seconds[1],
        )
    }
}

fn compare(scene: &Scene, folder: &Path, python: &str, size: [u32; 2], spp: u32) -> Result<Compared> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    for part in &scene.parts {
        part.mesh.write(folder, &part.name)?;
        part.surface.textures().try_for_each(|texture| texture.write(folder))?;
    }
    ours::write(scene, folder)?;
    theirs::write(scene, folder, size, spp, BOUNCES)?;
    let (ours, our_seconds) = ours::picture(folder, size, spp, BOUNCES)?;
    let (theirs, their_seconds) = theirs::picture(python, folder, size)?;
    Ok(Compared { ours, theirs, seconds: [our_seconds, their_seconds] })
}

/// Width and height; windows of similarity need some.
fn size(text: &str) -> Result<[u32; 2]> {
    let numbers = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let size = numbers.filter(|size| size.iter().all(|extent| (16..=4096).contains(extent)));
    size.with_context(|| format!("--size {text}: not a size like 256x256, from 16x16 to 4096x4096"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_arguments_are_told() {
        let run = |line: &str| {
            let arguments: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
            task(Path::new(""), &arguments).unwrap_err().to_string()
        };
        assert!(run("").starts_with("usage"));
        assert!(run("-o a --size 8x8").contains("8x8"));
        assert_eq!(size("320x240").unwrap(), [320, 240]);
    }

    #[test]
    fn what_is_written_for_ours_is_rendered() {
        let folder = tempfile::tempdir().unwrap();
        for scene in scenes::generated() {
            let folder = folder.path().join(scene.name);
            std::fs::create_dir(&folder).unwrap();
            for part in &scene.parts {
                part.mesh.write(&folder, &part.name).unwrap();
                part.surface.textures().for_each(|texture| texture.write(&folder).unwrap());
            }
            ours::write(&scene, &folder).unwrap();
            let (picture, _) = ours::picture(&folder, [16, 16], 1, 4).unwrap();
            assert!(picture.mean().iter().all(|&mean| mean > 0.05 && mean < 2.0), "{}", scene.name);
        }
    }
}
