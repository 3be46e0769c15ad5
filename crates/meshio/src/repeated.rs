//! Models that a scene file shows more than once: they are read once, as a part that instances show.

use crate::import::{Format, Inputs, Model};
use crate::instances::{can_show, saves_enough};
use crate::survey::survey_model;
use crate::{ImportOptions, Result, gltf};
use std::collections::BTreeMap;

/// For each model the first one that is the same, where both are shown by instances.
pub(crate) struct RepeatedModels {
    first: Vec<Option<usize>>,
}

impl RepeatedModels {
    /// Those of `inputs`.
    pub fn of(inputs: &Inputs, options: &ImportOptions) -> Result<RepeatedModels> {
        let mut first = vec![None; inputs.models.len()];
        let mut same: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        // A scene file may change the materials of its models, so those of another one are others.
        for (number, (_, models)) in inputs.scene_files.iter().enumerate().filter(|_| options.instances) {
            for i in models.clone() {
                let Model { path, world_from_file, material, strand_width } = &inputs.models[i];
                // Strands would have other widths in other places.
                let may_have_strands = !matches!(inputs.formats[i].0, Format::Ply);
                let has_strands = may_have_strands && strand_width.or(options.strand_width).is_some();
                if !has_strands && can_show(world_from_file) {
                    same.entry((number, path, material)).or_default().push(i);
                }
            }
        }
        for models in same.into_values().filter(|models| models.len() > 1) {
            if can_be_part(inputs, models[0], models.len() as u64, options)? {
                models.iter().for_each(|&i| first[i] = Some(models[0]));
            }
        }
        Ok(RepeatedModels { first })
    }

    /// The model that is read where model number `i` is shown by an instance of it.
    pub fn first(&self, i: usize) -> Option<usize> {
        self.first[i]
    }
}

/// True if a model is worth to be a part that is shown so often, and is one surface: parts have no parts, cameras or lights.
fn can_be_part(inputs: &Inputs, model: usize, times: u64, options: &ImportOptions) -> Result<bool> {
    let (path, (format, _)) = (&inputs.models[model].path, inputs.formats[model]);
    let is_surface = match format {
        Format::Obj | Format::Ply => true,
        Format::Gltf => gltf::shows_only_meshes(path)?,
        Format::Hair => false,
    };
    if !is_surface {
        return Ok(false);
    }
    let found = survey_model(path, format, options)?;
    Ok(found.instances == 0 && saves_enough(found.triangles, times))
}
