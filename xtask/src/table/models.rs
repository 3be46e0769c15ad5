//! The models that a table is printed for, one at a time.

use super::contestants::about_strips;
use crate::paper::mesh::Mesh;
use crate::paper::published;
use crate::sample_mesh;
use anyhow::{Context, Result};
use raystrips_convert::{ConvertParams, ConvertReport, Unobserved, convert};
use raystrips_tracer::Scene;
use std::path::{Path, PathBuf};

/// A model, its pack, and its triangles.
pub struct Model {
    /// Name of the file without extension.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// What the conversion with default parameters told.
    pub report: ConvertReport,
    /// The pack.
    pub scene: Scene,
    /// The triangles in the pack.
    pub mesh: Mesh,
}

impl Model {
    fn open(path: &Path, folder: &Path) -> Result<Model> {
        let pack = folder.join("model.rsp");
        let report = convert(
            &[path.to_owned()],
            &pack,
            &ConvertParams { proxies: None, ..ConvertParams::default() },
            &Unobserved,
        )?;
        let scene = Scene::open(&pack)?;
        let mesh = Mesh::of_scene(&scene);
        Ok(Model { name: stem(path), path: path.to_owned(), report, scene, mesh })
    }

    /// Triangles.
    pub fn triangles(&self) -> f64 {
        self.mesh.triangles.len() as f64
    }

    /// What the paper has on this model.
    pub fn published(&self) -> Option<&'static published::Model> {
        published::Model::of_file(&self.name)
    }
}

/// Calls `print` for each of `paths`, and for a small generated mesh if there are none.
pub fn each(paths: &[String], mut print: impl FnMut(&Model) -> Result<()>) -> Result<()> {
    let folder = tempfile::tempdir()?;
    for path in paths {
        print(&Model::open(Path::new(path), folder.path())?)?;
    }
    if paths.is_empty() {
        let path = folder.path().join("generated.obj");
        std::fs::write(&path, sample_mesh::obj()).context("cannot write the generated mesh")?;
        print(&Model::open(&path, folder.path())?)?;
    }
    Ok(())
}

/// The paper's models that are not among `paths`.
pub fn unmatched(paths: &[String]) -> Vec<&'static published::Model> {
    let stems: Vec<String> = paths.iter().map(|path| stem(Path::new(path))).collect();
    published::Model::others(stems.iter().map(String::as_str))
}

/// Prints `about`, and what else there is to say beneath a table of Ray-Strips.
pub fn print_notes(paths: &[String], about: &str) {
    let generated = "No models were given: the table is that of a small generated mesh. ";
    println!("\n{}{about} {}", if paths.is_empty() { generated } else { "" }, about_strips());
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
