//! `cargo xtask scene NAME --triangles N -o DIR`: scenes of any size, made here instead of downloaded.
//!
//! Scenes are streamed to PLY files, with a scene file beside them, so that memory does not grow with the number of
//! triangles. Same name, size and seed, same bytes, on every machine: sines are those of the `libm` crate.

mod isosurface;
mod ply;
mod random;
mod sink;

use crate::flags::Flags;
use crate::output::write_whole;
use anyhow::{Context, Result, bail};
use isosurface::Isosurface;
use ply::PlyWriter;
use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "usage: cargo xtask scene isosurface --triangles N -o DIR [--seed S]";

/// Makes the scene that the first argument names.
pub fn task(_root: &Path, arguments: &[String]) -> Result<ExitCode> {
    let flags = Flags::parse(arguments, &["--triangles", "-o", "--seed"], &[])?;
    let (Some(triangles), Some(folder), [name]) =
        (flags.count("--triangles")?, flags.value("-o"), flags.rest.as_slice())
    else {
        bail!(USAGE)
    };
    let seed = flags.count("--seed")?.unwrap_or(1);
    let folder = Path::new(folder);
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let made = match name.as_str() {
        "isosurface" => make_isosurface(folder, triangles, seed)?,
        _ => bail!("there is no scene '{name}'; {USAGE}"),
    };
    println!("{}: {made} triangles", folder.join("scene.toml").display());
    Ok(ExitCode::SUCCESS)
}

fn make_isosurface(folder: &Path, triangles: u64, seed: u64) -> Result<u64> {
    let mut writer = PlyWriter::create(&folder.join("isosurface.ply"))?;
    Isosurface::with_triangles(triangles, seed)?.generate(&mut writer)?;
    let made = writer.triangles();
    writer.finish()?;
    write_whole(&folder.join("scene.toml"), isosurface::SCENE.as_bytes())?;
    Ok(made)
}
