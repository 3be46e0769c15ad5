//! Which meshes are sent once and shown by instances.

use super::buffer::Buffers;
use super::document::Document;
use super::instances::Instances;
use super::nodes::MeshNode;
use crate::instances::{can_show, saves_enough};
use crate::{ImportOptions, Result};
use glam::DAffine3;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use std::path::Path;

/// Meshes that are shown often enough.
pub(super) struct SharedMeshes {
    by_mesh: Vec<bool>,
}

impl SharedMeshes {
    /// None.
    pub fn none(document: &Document) -> SharedMeshes {
        SharedMeshes { by_mesh: vec![false; document.meshes.len()] }
    }

    /// Those of `nodes`, in a file that stands at `world_from_file`.
    pub fn of(
        path: &Path,
        document: &Document,
        buffers: &Buffers,
        nodes: &[MeshNode],
        world_from_file: DAffine3,
        options: &ImportOptions,
    ) -> Result<SharedMeshes> {
        let SharedMeshes { mut by_mesh } = SharedMeshes::none(document);
        if !options.instances {
            return Ok(SharedMeshes { by_mesh });
        }
        let mut shown = vec![0u64; document.meshes.len()];
        for node in nodes.iter().filter(|node| !has_skin(document, node)) {
            let instances = Instances::of(path, document, buffers, node)?;
            let places = (0..instances.count).map(|i| world_from_file * instances.file_from_mesh(node, i));
            shown[node.mesh] += places.filter(can_show).count() as u64;
        }
        for (mesh, is_shared) in by_mesh.iter_mut().enumerate() {
            let primitives = &document.meshes[mesh].primitives;
            let corners = primitives.iter().map(|primitive| corners(document, primitive));
            let triangles = corners.fold(0, u64::saturating_add) / 3;
            *is_shared = saves_enough(triangles, shown[mesh]) && primitives.iter().all(keeps_its_shape);
        }
        Ok(SharedMeshes { by_mesh })
    }

    /// True if the mesh of this node, which exists, is shared where the node shows it.
    pub fn holds(&self, document: &Document, node: &MeshNode) -> bool {
        self.by_mesh[node.mesh] && !has_skin(document, node)
    }
}

fn has_skin(document: &Document, node: &MeshNode) -> bool {
    node.node.is_some_and(|node| document.nodes[node].skin.is_some())
}

/// True for triangles that no weights displace: lines would have other widths in other places.
fn keeps_its_shape(primitive: &Primitive) -> bool {
    let is_of_triangles =
        !matches!(primitive.mode, Checked::Valid(Mode::Lines | Mode::LineLoop | Mode::LineStrip));
    is_of_triangles && primitive.targets.as_ref().is_none_or(Vec::is_empty)
}

/// Corners of a primitive as it says itself, which is checked when it is read.
fn corners(document: &Document, primitive: &Primitive) -> u64 {
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let accessor = primitive.indices.as_ref().or(positions).map(|index| index.value());
    accessor.and_then(|index| document.accessors.get(index)).map_or(0, |accessor| accessor.count.0)
}
