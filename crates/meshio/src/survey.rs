//! What an import will bring, told from headers and samples before it begins.

use crate::import::{Format, Inputs};
use crate::repeated::RepeatedModels;
use crate::{ImportOptions, Result, gltf, hair, obj, ply};
use std::path::{Path, PathBuf};

/// Sums over all models; a file that is placed twice counts twice, unless it is shown by instances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Survey {
    /// Of model files, not counting the files that those name.
    pub bytes: u64,
    /// To be read, whether or not they can be used; segments of strands in hair files count as triangles.
    pub triangles: u64,
    /// Places where parts are shown.
    pub instances: u64,
    /// That the files list.
    pub vertices: u64,
    /// Those of OBJ and text PLY, of which the import keeps 24 bytes each, for one file at a time; their colors, texture
    /// coordinates and normals count as they do.
    pub kept_vertices: u64,
    /// Those with normals, texture coordinates or colors, which come with the triangles unless these are left out.
    pub attributed_vertices: u64,
    /// False where counts are estimated.
    pub is_exact: bool,
}

/// Tells what an import of `inputs` with `options` will bring. Reads headers, glTF documents, and samples of OBJ files, which is a
/// matter of milliseconds.
///
/// # Errors
///
/// Those that [`import`](crate::import) would end with for what has been read.
pub fn survey(inputs: &[PathBuf], options: &ImportOptions) -> Result<Survey> {
    let inputs = Inputs::open(inputs)?;
    let mut all = Survey { is_exact: true, ..Survey::default() };
    let repeated = RepeatedModels::of(&inputs, options)?;
    for (i, (model, &(format, bytes))) in inputs.models.iter().zip(&inputs.formats).enumerate() {
        all.bytes = all.bytes.saturating_add(bytes);
        if let Some(first) = repeated.first(i) {
            all.instances = all.instances.saturating_add(1);
            if first != i {
                continue;
            }
        }
        let found = survey_model(&model.path, format, options)?;
        all.triangles = all.triangles.saturating_add(found.triangles);
        all.instances = all.instances.saturating_add(found.instances);
        all.vertices = all.vertices.saturating_add(found.vertices);
        all.attributed_vertices = all.attributed_vertices.saturating_add(found.attributed_vertices);
        all.kept_vertices = all.kept_vertices.saturating_add(found.kept_vertices);
        all.is_exact &= found.is_exact;
    }
    Ok(all)
}

/// The same of one model.
pub(crate) fn survey_model(path: &Path, format: Format, options: &ImportOptions) -> Result<Survey> {
    match format {
        Format::Obj => obj::survey(path, options),
        Format::Ply => ply::survey(path, options),
        Format::Gltf => gltf::survey(path, options),
        Format::Hair => hair::survey(path),
    }
}
