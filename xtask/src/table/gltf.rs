//! `cargo xtask table gltf -o DIR FOLDER...`: every glTF file below some folders, converted and rendered as somebody does who
//! knows nothing of it, on one contact sheet.

use crate::compare::programs;
use crate::flags::Flags;
use anyhow::{Context, Result, bail};
use image::{RgbImage, imageops};
use std::path::{Path, PathBuf};
use std::process::Command;

/// How it is called.
pub const USAGE: &str = "cargo xtask table gltf -o DIR [--tile 256] [--spp 64] [--columns 6] FOLDER|FILE...";

/// Between pictures, and its gray.
const GAP: u32 = 4;
const GRAY: [u8; 3] = [30; 3];

/// Prints a row for each file and writes `contact_sheet.png`, whose pictures are in the same order, row by row.
pub fn print(arguments: &[String]) -> Result<()> {
    let flags = Flags::parse(arguments, &["-o", "--tile", "--spp", "--columns"], &[])?;
    let (Some(folder), false) = (flags.value("-o"), flags.rest.is_empty()) else { bail!("usage: {USAGE}") };
    let tile = flags.count("--tile")?.unwrap_or(256) as u32;
    let spp = flags.count("--spp")?.unwrap_or(64);
    let columns = flags.count("--columns")?.unwrap_or(6).max(1) as u32;
    let raystrips = programs::raystrips()?;
    let folder = PathBuf::from(folder);
    std::fs::create_dir_all(&folder)?;
    let mut files = Vec::new();
    flags.rest.iter().try_for_each(|path| gather(Path::new(path), &mut files))?;
    files.sort();
    println!("| | file | triangles | textures | MiB of pack | what is said |\n|---:|---|---:|---:|---:|---|");
    let mut pictures = Vec::new();
    for file in &files {
        let picture = folder.join(format!("{}.png", pictures.len() + 1));
        match render(&raystrips, file, &picture, (tile, spp)) {
            Ok(row) => {
                pictures.push(image::open(&picture)?.into_rgb8());
                println!("| {} | {} | {row} |", pictures.len(), file.display());
            }
            Err(refused) => println!("| | {} | | | | {refused} |", file.display()),
        }
    }
    if pictures.is_empty() {
        bail!("none of the files has anything to be seen");
    }
    let sheet = folder.join("contact_sheet.png");
    contact_sheet(&pictures, tile, columns).save(&sheet)?;
    println!("\n{}: {} pictures, row by row", sheet.display(), pictures.len());
    Ok(())
}

/// Adds all glTF files at or below `path`.
fn gather(path: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    if path.is_dir() {
        for entry in std::fs::read_dir(path).with_context(|| path.display().to_string())? {
            gather(&entry?.path(), files)?;
        }
    } else if path.extension().is_some_and(|ending| ending == "gltf" || ending == "glb") {
        files.push(path.to_owned());
    }
    Ok(())
}

/// The cells of a file, or why it was refused.
fn render(raystrips: &Path, file: &Path, picture: &Path, (tile, spp): (u32, u64)) -> Result<String, String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let pack = folder.path().join("a.rsp");
    let run = |command: &mut Command| {
        let output = command.output().map_err(|e| e.to_string())?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        match output.status.success() {
            true => Ok((output.stdout, said)),
            false => Err(cell(&said, file)),
        }
    };
    let (told, said) =
        run(Command::new(raystrips).arg("convert").arg(file).arg("-o").arg(&pack).arg("--json"))?;
    let told: serde_json::Value = serde_json::from_slice(&told).map_err(|e| e.to_string())?;
    let mut command = Command::new(raystrips);
    command.arg("render").arg(&pack).arg("-o").arg(picture);
    command.args(["--size", &format!("{tile}x{tile}"), "--spp", &spp.to_string()]);
    run(&mut command)?;
    let mebibytes = told["bytes"]["file"].as_f64().unwrap_or(0.0) / 1048576.0;
    Ok(format!("{} | {} | {mebibytes:.1} | {}", told["triangles"], told["textures"], cell(&said, file)))
}

/// Lines of standard error in one cell, without the name of the file in each.
fn cell(said: &str, file: &Path) -> String {
    let name = format!("{}: ", file.display());
    let lines = said.lines().map(|line| {
        let line = line.trim_start_matches("raystrips: ").trim_start_matches("warning: ");
        line.trim_start_matches("error: ").replacen(&name, "", 1).replace('|', "/")
    });
    lines.collect::<Vec<_>>().join("; ")
}

fn contact_sheet(pictures: &[RgbImage], tile: u32, columns: u32) -> RgbImage {
    let columns = columns.min(pictures.len() as u32);
    let rows = (pictures.len() as u32).div_ceil(columns);
    let extent = |count: u32| count * (tile + GAP) + GAP;
    let mut sheet = RgbImage::from_pixel(extent(columns), extent(rows), image::Rgb(GRAY));
    for (i, picture) in (0..).zip(pictures) {
        let place = |number: u32| i64::from(GAP + number * (tile + GAP));
        imageops::replace(&mut sheet, picture, place(i % columns), place(i / columns));
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_lie_row_by_row() {
        let picture = |value: u8| RgbImage::from_pixel(8, 8, image::Rgb([value; 3]));
        let sheet = contact_sheet(&[picture(1), picture(2), picture(3)], 8, 2);
        assert_eq!(sheet.dimensions(), (28, 28));
        let at = |x, y| sheet.get_pixel(x, y).0[0];
        assert_eq!([at(5, 5), at(17, 5), at(5, 17), at(17, 17)], [1, 2, 3, 30]);
    }

    #[test]
    fn what_is_said_becomes_one_cell() {
        let said = "raystrips: warning: a.glb: odd | odder\nraystrips: warning: more\n";
        assert_eq!(cell(said, Path::new("a.glb")), "odd / odder; more");
    }
}
