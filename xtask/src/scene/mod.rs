//! `cargo xtask scene NAME --triangles N -o DIR`: scenes of any size, made here instead of downloaded.
//!
//! Scenes are streamed to PLY files, with a scene file beside them, so that memory does not grow with the number of
//! triangles. Same name, size and seed, same bytes, on every machine: sines are those of the `libm` crate.

mod assembly;
mod atrium;
mod cornell;
mod fur;
mod isosurface;
mod march;
mod noise;
mod pipes;
mod ply;
mod polygonize;
pub mod random;
mod refine;
mod relief;
mod sink;
mod solid;
mod statue;
#[cfg(test)]
mod testing;

use crate::flags::Flags;
use crate::output::write_whole;
use anyhow::{Context, Result, bail};
use assembly::Part;
use isosurface::Isosurface;
use pipes::Plant;
use ply::PlyWriter;
use sink::MeshSink;
use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "usage: cargo xtask scene atrium|cornell|isosurface|pipes|statue --triangles N -o DIR [--seed S]; \
     pipes: [--single-file]; statue: [--mesh FILE]; or cargo xtask scene fur --strands N -o DIR [--seed S]";

/// Makes the scene that the first argument names.
pub fn task(_root: &Path, arguments: &[String]) -> Result<ExitCode> {
    let options = ["--triangles", "--strands", "-o", "--seed", "--mesh"];
    let flags = Flags::parse(arguments, &options, &["--single-file"])?;
    let size = match flags.rest.as_slice() {
        [name] if name == "fur" => flags.count("--strands")?,
        _ => flags.count("--triangles")?,
    };
    let (Some(triangles), Some(folder), [name]) = (size, flags.value("-o"), flags.rest.as_slice()) else {
        bail!(USAGE)
    };
    let seed = flags.count("--seed")?.unwrap_or(1);
    let folder = Path::new(folder);
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    if name == "fur" {
        return make_fur(folder, triangles, seed);
    }
    let made = match name.as_str() {
        "atrium" => {
            let parts = atrium::parts(triangles, seed)?;
            make_parts(folder, triangles, &parts, &atrium::file_names(), &atrium::scene())?
        }
        "cornell" => {
            let parts = cornell::parts(triangles, seed)?;
            make_parts(folder, triangles, &parts, &cornell::MATERIALS, cornell::SCENE)?
        }
        "isosurface" => make_isosurface(folder, triangles, seed)?,
        "pipes" => make_pipes(folder, triangles, seed, flags.has("--single-file"))?,
        "statue" => make_statue(folder, triangles, seed, flags.value("--mesh"))?,
        _ => bail!("there is no scene '{name}'; {USAGE}"),
    };
    println!("{}: {made} triangles", folder.join("scene.toml").display());
    Ok(ExitCode::SUCCESS)
}

fn make_fur(folder: &Path, strands: u64, seed: u64) -> Result<ExitCode> {
    fur::write_coat(strands, seed, folder)?;
    let made = assembly::write(&fur::parts()?, 1.0, folder, &fur::MATERIALS)?;
    write_whole(&folder.join("scene.toml"), fur::SCENE.as_bytes())?;
    println!("{}: {strands} strands, {made} triangles", folder.join("scene.toml").display());
    Ok(ExitCode::SUCCESS)
}

fn make_isosurface(folder: &Path, triangles: u64, seed: u64) -> Result<u64> {
    let surface = Isosurface::with_triangles(triangles, seed)?;
    let mut writer = PlyWriter::create(&folder.join("isosurface.ply"))?;
    surface.generate(&mut writer)?;
    let made = writer.triangles();
    writer.finish()?;
    write_whole(&folder.join("scene.toml"), isosurface::SCENE.as_bytes())?;
    Ok(made)
}

fn make_statue(folder: &Path, triangles: u64, seed: u64, mesh: Option<&str>) -> Result<u64> {
    let (parts, scene) = match mesh {
        Some(path) => (statue::parts_of_mesh(Path::new(path), triangles, seed)?, statue::scene_of_mesh()),
        None => (statue::parts(triangles, seed)?, statue::scene()),
    };
    make_parts(folder, triangles, &parts, &[statue::MATERIAL], &scene)
}

/// Refines parts until there are as many triangles as are asked for, and writes a file for each material.
fn make_parts(folder: &Path, triangles: u64, parts: &[Part], materials: &[&str], scene: &str) -> Result<u64> {
    let made = assembly::write(parts, assembly::edge_for(parts, triangles), folder, materials)?;
    write_whole(&folder.join("scene.toml"), scene.as_bytes())?;
    Ok(made)
}

/// Writes a file for each material, or one for all.
fn make_pipes(folder: &Path, triangles: u64, seed: u64, single_file: bool) -> Result<u64> {
    let plant = Plant::with_triangles(triangles, seed)?;
    let names: Vec<String> =
        if single_file { vec![pipes::SINGLE_FILE.to_owned()] } else { pipes::file_names().collect() };
    let writers: Result<Vec<PlyWriter>> =
        names.iter().map(|name| PlyWriter::create(&folder.join(name))).collect();
    let mut writers = writers?;
    let made = plant.generate(|part| {
        let writer = &mut writers[if single_file { 0 } else { part.material }];
        let base = writer.vertices();
        part.shape.positions.iter().try_for_each(|&position| writer.vertex(position).map(drop))?;
        part.shape.triangles.iter().try_for_each(|triangle| writer.triangle(triangle.map(|v| base + v)))
    })?;
    let used: Vec<bool> = writers.iter().map(|writer| writer.triangles() > 0).collect();
    let with_parts = writers.into_iter().filter(|writer| writer.triangles() > 0);
    with_parts.into_iter().try_for_each(PlyWriter::finish)?;
    let scene = if single_file { plant.scene_of_one_file() } else { plant.scene(&used) };
    write_whole(&folder.join("scene.toml"), scene.as_bytes())?;
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystrips_convert::{ConvertParams, Unobserved, convert};
    use std::collections::BTreeMap;

    fn make(line: &str, folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let mut arguments: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        arguments.extend(["-o".to_owned(), folder.display().to_string()]);
        task(Path::new(""), &arguments).unwrap();
        let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap());
        files.map(|f| (f.file_name().into_string().unwrap(), std::fs::read(f.path()).unwrap())).collect()
    }

    #[test]
    fn same_arguments_same_bytes_and_packs() {
        for (line, count) in [
            ("isosurface --triangles 20K", 20_000.0),
            ("pipes --triangles 50K --seed 2", 50_000.0),
            ("pipes --triangles 50K --single-file", 50_000.0),
            ("statue --triangles 50K --seed 2", 50_000.0),
            ("atrium --triangles 50K", 50_000.0),
            ("cornell --triangles 50K", 50_000.0),
        ] {
            let [first, second] = [(); 2].map(|()| tempfile::tempdir().unwrap());
            let files = make(line, first.path());
            assert!(files == make(line, second.path()), "{line}");
            let pack = second.path().join("scene.rsp");
            let scene = first.path().join("scene.toml");
            let report = convert(
                &[scene],
                &pack,
                &ConvertParams { proxies: None, ..ConvertParams::default() },
                &Unobserved,
            )
            .unwrap();
            assert!((report.manifest.triangles() as f64 / count - 1.0).abs() < 0.02, "{line}");
            assert!(report.warnings.is_empty(), "{line}: {:?}", report.warnings);
        }
    }

    #[test]
    fn fur_has_as_many_strands_as_were_asked_for() {
        let [first, second] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let files = make("fur --strands 2K --seed 3", first.path());
        assert!(files == make("fur --strands 2K --seed 3", second.path()));
        let (scene, pack) = (first.path().join("scene.toml"), second.path().join("scene.rsp"));
        let report = convert(&[scene], &pack, &ConvertParams::default(), &Unobserved).unwrap();
        assert_eq!(report.manifest.segments, 16_000);
        assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    }

    #[test]
    fn meshes_of_files_are_refined() {
        let [folder, first, second] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        let model = folder.path().join("model.obj");
        std::fs::write(&model, crate::sample_mesh::obj()).unwrap();
        let line = format!("statue --triangles 60K --mesh {}", model.display());
        let files = make(&line, first.path());
        assert!(files == make(&line, second.path()));
        let scene = first.path().join("scene.toml");
        let pack = second.path().join("scene.rsp");
        let report = convert(
            &[scene],
            &pack,
            &ConvertParams { proxies: None, ..ConvertParams::default() },
            &Unobserved,
        )
        .unwrap();
        assert!((report.manifest.triangles() as f64 / 6e4 - 1.0).abs() < 0.02);
        let few = line.replace("60K", "5K");
        let arguments: Vec<String> = few.split_whitespace().chain(["-o", "."]).map(str::to_owned).collect();
        assert!(task(Path::new(""), &arguments).unwrap_err().to_string().contains("7680 triangles"));
    }

    #[test]
    fn wrong_arguments_tell_the_usage() {
        let run = |line: &str| {
            let arguments: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
            task(Path::new(""), &arguments).unwrap_err().to_string()
        };
        assert!(run("isosurface").starts_with("usage"));
        assert!(run("pipes --triangles 5x -o .").contains("5x"));
    }
}
