//! The one way in: what the inputs are, and who reads them.

use crate::emit::Emitter;
use crate::repeated::RepeatedModels;
use crate::scene_file::SceneFile;
use crate::{Import, ImportError, ImportOptions, Place, Result, TriangleSink, gltf, hair, map, obj, ply};
use glam::DAffine3;
use std::collections::HashMap;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Reads all `inputs` into one scene. Models stand where their files put them, those of a scene file where that
/// puts them.
///
/// Formats are told by the ending of the name: `.obj`, `.gltf`, `.glb`, `.ply`, `.hair`, `.toml`; glTF, PLY and hair also
/// by their first bytes.
///
/// # Errors
///
/// The first thing that keeps an input from being read as it is meant. Batches sent to the sink before are then
/// worthless. A file without triangles is an error too.
pub fn import(inputs: &[PathBuf], options: &ImportOptions, sink: &mut dyn TriangleSink) -> Result<Import> {
    let opened = Inputs::open(inputs)?;
    let repeated = RepeatedModels::of(&opened, options)?;
    let Inputs { models, formats, mut scene_files } = opened;
    let bytes_total = formats.iter().map(|(_, bytes)| bytes).sum();
    let mut parts = HashMap::new();

    let mut out = Emitter::new(options, sink, bytes_total);
    inputs.iter().for_each(|path| out.note_file(path));
    for (i, (model, (format, bytes))) in models.iter().zip(formats).enumerate() {
        let mut scene_file =
            scene_files.iter_mut().find(|(_, range)| range.contains(&i)).map(|(file, _)| file);
        let first_material = out.scene.materials.len();
        let material = match (&model.material, &mut scene_file) {
            (Some(name), Some(scene_file)) => scene_file.material(name, &mut out),
            _ => None,
        };
        out.note_file(&model.path);
        out.begin_file(model.world_from_file, material, model.strand_width)?;
        match repeated.first(i) {
            None => read_model(&model.path, format, &mut out)?,
            Some(first) => {
                if first == i {
                    parts.insert(first, out.begin_part()?);
                    read_model(&model.path, format, &mut out)?;
                    out.end_part()?;
                }
                out.instance(parts[&first], DAffine3::IDENTITY);
            }
        }
        out.end_file(bytes)?;
        if let Some(scene_file) = scene_file {
            scene_file.apply_to(&mut out.scene.materials[first_material..]);
        }
    }
    for (scene_file, _) in scene_files {
        scene_file.finish(&mut out);
    }
    finish(inputs, out)
}

/// What the inputs name, before any model is read.
pub(crate) struct Inputs {
    pub models: Vec<Model>,
    /// Of each model, with its size in bytes.
    pub formats: Vec<(Format, u64)>,
    /// With the range of the models that each has brought.
    pub scene_files: Vec<(SceneFile, Range<usize>)>,
}

impl Inputs {
    pub fn open(inputs: &[PathBuf]) -> Result<Inputs> {
        let mut models = Vec::new();
        let mut scene_files = Vec::new();
        for path in inputs {
            if ending(path) == "toml" {
                let scene_file = SceneFile::read(path)?;
                let first = models.len();
                models.extend(scene_file.models()?);
                scene_files.push((scene_file, first..models.len()));
            } else {
                models.push(Model {
                    path: path.clone(),
                    world_from_file: DAffine3::IDENTITY,
                    material: None,
                    strand_width: None,
                });
            }
        }
        let formats = models.iter().map(|model| Format::of(&model.path)).collect::<Result<Vec<_>>>()?;
        Ok(Inputs { models, formats, scene_files })
    }
}

/// A model file and where it stands.
#[derive(Debug)]
pub(crate) struct Model {
    pub path: PathBuf,
    pub world_from_file: DAffine3,
    /// Name of the material that all of it gets.
    pub material: Option<String>,
    /// How wide its strands are, in units of the file.
    pub strand_width: Option<f64>,
}

#[derive(Clone, Copy)]
pub(crate) enum Format {
    Obj,
    Ply,
    Gltf,
    Hair,
}

impl Format {
    /// The format of the file and its size in bytes.
    fn of(path: &Path) -> Result<(Format, u64)> {
        let mut file = map::open_regular(path).map_err(|e| ImportError::io(path, e))?;
        let bytes = file.metadata().map_err(|e| ImportError::io(path, e))?.len();
        let mut start = Vec::new();
        file.by_ref().take(4).read_to_end(&mut start).map_err(|e| ImportError::io(path, e))?;
        let format = match (start.as_slice(), ending(path).as_str()) {
            (b"glTF", _) | (_, "gltf" | "glb") => Format::Gltf,
            (b"HAIR", _) | (_, "hair") => Format::Hair,
            (b"ply\n" | b"ply\r", _) | (_, "ply") => Format::Ply,
            (_, "obj") => Format::Obj,
            (_, "gz" | "xz" | "zst" | "bz2" | "zip" | "7z") => {
                return Err(ImportError::unsupported(
                    path,
                    Place::Whole,
                    "is compressed; decompress it first",
                ));
            }
            _ => {
                let what = "is of no known format; convert it to .obj, .gltf, .glb, .ply or .hair";
                return Err(ImportError::unsupported(path, Place::Whole, what));
            }
        };
        Ok((format, bytes))
    }
}

fn read_model(path: &Path, format: Format, out: &mut Emitter) -> Result<()> {
    let first_id = out.next_triangle_id();
    let found = match format {
        Format::Obj => obj::read(path, out)?,
        Format::Ply => ply::read(path, out)?,
        Format::Gltf => gltf::read(path, out)?,
        Format::Hair => hair::read(path, out)?,
    };
    if out.next_triangle_id() == first_id {
        return Err(ImportError::NoTriangles { path: path.into(), found });
    }
    Ok(())
}

fn finish(inputs: &[PathBuf], out: Emitter) -> Result<Import> {
    let done = out.finish()?;
    if done.report.triangles == 0 && done.report.segments == 0 {
        let dropped = done.report.dropped;
        let found = format!(
            "all are dropped, {} with positions that are not finite, {} out of range",
            dropped.non_finite, dropped.out_of_range
        );
        let path = inputs.first().cloned().unwrap_or_default();
        return Err(ImportError::NoTriangles { path, found });
    }
    Ok(done)
}

/// The ending of the file's name in lower case; empty if it has none.
pub(crate) fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}
