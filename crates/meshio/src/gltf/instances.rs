//! `EXT_mesh_gpu_instancing`: a node shows its mesh at many places, which are in accessors.

use super::accessor::Accessor;
use super::buffer::Buffers;
use super::document::Document;
use super::nodes::MeshNode;
use super::syntax;
use crate::Result;
use glam::{DAffine3, DQuat, DVec3};
use gltf::json::accessor::Type;
use std::path::Path;

/// The places of a mesh.
pub(super) struct Instances<'a> {
    pub count: u64,
    translations: Option<Accessor<'a>>,
    rotations: Option<Accessor<'a>>,
    scales: Option<Accessor<'a>>,
}

impl<'a> Instances<'a> {
    /// Those of a node that was found, a single one if it has no list of them.
    pub fn of(
        path: &Path,
        document: &Document,
        buffers: &'a Buffers<'a>,
        found: &MeshNode,
    ) -> Result<Instances<'a>> {
        let mut instances = Instances { count: 1, translations: None, rotations: None, scales: None };
        let Some(node) = found.node else { return Ok(instances) };
        // Joints say where a mesh with a skin is.
        let json = document.nodes[node].extensions.instancing.as_ref();
        let Some(json) = json.filter(|_| document.nodes[node].skin.is_none()) else { return Ok(instances) };
        let at = format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
        let mut count = None;
        let mut open = |name: &str, kind: Type| -> Result<Option<Accessor<'a>>> {
            let Some(&index) = json.attributes.get(name) else { return Ok(None) };
            let at = format!("{at}.{name}");
            let accessor = Accessor::new(path, document, buffers, index, kind, &at)?;
            if *count.get_or_insert(accessor.count()) != accessor.count() {
                let what = "has another number of instances than the others; export the file again";
                return Err(syntax(path, at, what));
            }
            if accessor.is_without_bytes() {
                let what = "names an accessor without bufferView; export the file again";
                return Err(syntax(path, at, what));
            }
            Ok(Some(accessor))
        };
        instances.translations = open("TRANSLATION", Type::Vec3)?;
        instances.rotations = open("ROTATION", Type::Vec4)?;
        instances.scales = open("SCALE", Type::Vec3)?;
        // Attributes of other names, which are no places, do not make instances.
        instances.count = count.unwrap_or(1);
        Ok(instances)
    }

    /// Where instance `i` of the mesh of `found` stands in the file.
    pub fn file_from_mesh(&self, found: &MeshNode, i: u64) -> DAffine3 {
        found.file_from_local * self.local_from_instance(i)
    }

    fn local_from_instance(&self, i: u64) -> DAffine3 {
        let vector = |accessor: &Accessor| DVec3::from(accessor.components::<3>(i));
        let rotation = self.rotations.as_ref().map_or(DQuat::IDENTITY, |accessor| {
            let rotation = DQuat::from_array(accessor.components::<4>(i));
            if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY }
        });
        DAffine3::from_scale_rotation_translation(
            self.scales.as_ref().map_or(DVec3::ONE, vector),
            rotation,
            self.translations.as_ref().map_or(DVec3::ZERO, vector),
        )
    }
}
