//! What a glTF document shows, told from the counts of its accessors.

use super::buffer::Buffers;
use super::document::Document;
use super::instances::Instances;
use super::material::Materials;
use super::primitive::{MeshCounts, Primitives};
use super::shared::SharedMeshes;
use super::skin::Skins;
use super::texture::Textures;
use super::{glb, nodes};
use crate::emit::Emitter;
use crate::map::Map;
use crate::survey::Survey;
use crate::{ImportOptions, Result, TriangleBatch, TriangleSink};
use glam::DAffine3;
use std::collections::HashMap;
use std::io;
use std::path::Path;

/// Takes what the walk over the nodes finds on its way.
struct Nowhere;

impl TriangleSink for Nowhere {
    fn batch(&mut self, _: TriangleBatch) -> io::Result<()> {
        Ok(())
    }
}

/// Tells what the file at `path` holds, a mesh as often as it is shown if that is not by instances.
pub(crate) fn survey(path: &Path, options: &ImportOptions) -> Result<Survey> {
    let map = Map::open(path)?;
    let container = glb::split(path, &map)?;
    let document = Document::parse(path, container.json)?;
    let mut sink = Nowhere;
    let buffers = Buffers::new(path, &document, &map, container.binary, options);
    let scene = nodes::walk(path, &document, &mut Emitter::new(options, &mut sink, 0))?;
    let textures = Textures { path, document: &document, buffers: &buffers };
    let materials = Materials::new(textures);
    let skins = Skins::new(path, &document, &buffers, &scene.file_from_node);
    let world_from_file = DAffine3::IDENTITY;
    let shared = SharedMeshes::of(path, &document, &buffers, &scene.meshes, world_from_file, options)?;
    let mut primitives = Primitives::new(path, &document, &buffers, materials, skins, shared, None);
    let mut meshes: HashMap<usize, MeshCounts> = HashMap::new();
    let mut survey = Survey { is_exact: true, bytes: map.len() as u64, ..Survey::default() };
    for node in &scene.meshes {
        let is_new = !meshes.contains_key(&node.mesh);
        let counts = match meshes.get(&node.mesh) {
            Some(counts) => *counts,
            None => *meshes.entry(node.mesh).or_insert(primitives.count_mesh(node.mesh)?),
        };
        let mut times = Instances::of(path, &document, &buffers, node)?.count;
        if primitives.shares(node) {
            survey.instances = survey.instances.saturating_add(times);
            times = u64::from(is_new);
        }
        let add = |all: &mut u64, count: u64| *all = all.saturating_add(count.saturating_mul(times));
        add(&mut survey.triangles, counts.triangles);
        add(&mut survey.vertices, counts.vertices);
        add(&mut survey.attributed_vertices, counts.attributed_vertices);
        survey.is_exact &= counts.is_exact;
    }
    Ok(survey)
}
