//! `KHR_draco_mesh_compression`: primitives whose indices and attributes are in one compressed view.
//!
//! The codec needs a whole mesh in memory, so its size is bounded before it is decoded. What comes out is stored like
//! any other decompressed view.

use super::decoded::{Decoded, Store};
use super::{syntax, unsupported};
use crate::{ImportError, Result};
use draco_core::{
    DataType, DecodeLimits, DecoderBuffer, DracoError, ErrorKind, Mesh, MeshDecoder, PointAttribute,
    PointIndex,
};
use gltf::json::accessor::ComponentType;
use gltf::json::mesh::Primitive;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

pub(super) const NAME: &str = "KHR_draco_mesh_compression";
/// Bytes of memory that decoding may always take. With less, files that anyone can show would be refused.
const LEAST_BYTES: u64 = 128 << 20;
/// Bytes of memory that a triangle takes while its mesh is decoded: 20 to 120 as measured, by how it is coded.
const TRIANGLE_BYTES: u64 = 128;
/// Values are in memory as they are coded and as they are meant.
const VALUE_COPIES: u64 = 2;
/// Triangles or points that are stored at a time.
const PIECE: usize = 1 << 12;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Extension {
    pub buffer_view: usize,
    /// Semantics and the numbers that their attributes have in the compressed mesh.
    pub attributes: BTreeMap<String, u32>,
}

impl Extension {
    /// The extension of the primitive at the place `at`, if it has one.
    pub fn of(path: &Path, primitive: &Primitive, at: &str) -> Result<Option<Extension>> {
        let json = primitive.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
        json.map(Extension::deserialize).transpose().map_err(|error| {
            let what = format!("{error}; export the file again");
            syntax(path, format_args!("{at}.extensions.{NAME}"), what)
        })
    }
}

/// A mesh that was compressed.
pub(super) struct Decompressed {
    /// Three for each triangle, of four bytes.
    pub indices: Decoded,
    attributes: Vec<Attribute>,
}

/// An attribute, in the order of points.
pub(super) struct Attribute {
    id: u32,
    pub component: ComponentType,
    /// Components of an element.
    pub width: usize,
    pub bytes: Decoded,
}

impl Decompressed {
    /// Decompresses `source`, which belongs to the view that `at` names, in about `max_bytes` of memory.
    pub fn decode(
        path: &Path,
        source: &[u8],
        store: &Store,
        max_bytes: u64,
        at: &str,
    ) -> Result<Decompressed> {
        let max_bytes = max_bytes.max(LEAST_BYTES);
        let broken = |error: DracoError| broken(path, at, max_bytes, &error);
        let mesh = decoded(source, max_bytes).map_err(broken)?;
        let mut indices = store.writer();
        for faces in mesh.faces().chunks(PIECE) {
            let corners = faces.as_flattened().iter();
            indices.write(&corners.flat_map(|corner| corner.0.to_le_bytes()).collect::<Vec<u8>>())?;
        }
        let indices = indices.finish()?;
        let points = u32::try_from(mesh.num_points()).map_err(|_| broken(DracoError::general("points")))?;
        let mut attributes = Vec::new();
        for i in 0..mesh.num_attributes() {
            let attribute = mesh.try_attribute(i).map_err(broken)?;
            // Others cannot be named by an accessor, which has no such type either.
            if let Some(component) = component(attribute.data_type()) {
                let width = usize::from(attribute.num_components());
                let bytes = in_order(attribute, points, store)?
                    .ok_or_else(|| broken(DracoError::general("a point has no value")))?;
                attributes.push(Attribute { id: attribute.unique_id(), component, width, bytes });
            }
        }
        Ok(Decompressed { indices, attributes })
    }

    pub fn attribute(&self, id: u32) -> Option<&Attribute> {
        self.attributes.iter().find(|attribute| attribute.id == id)
    }

    pub fn release(&self) {
        self.indices.release();
        self.attributes.iter().for_each(|attribute| attribute.bytes.release());
    }
}

fn decoded(source: &[u8], max_bytes: u64) -> std::result::Result<Mesh, DracoError> {
    // One half for triangles, one for values.
    let half = max_bytes / 2;
    let limits = DecodeLimits::default()
        .with_max_decoded_bytes(half / VALUE_COPIES)
        .with_max_faces(half / TRIANGLE_BYTES);
    let mut mesh = Mesh::new();
    // It has no unsafe code and refuses what it does not expect, but nobody can promise that it does so everywhere.
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        MeshDecoder::new().decode(&mut DecoderBuffer::new(source).with_limits(limits), &mut mesh)
    }));
    outcome.unwrap_or_else(|_| Err(DracoError::general("it confuses the decoder"))).map(|()| mesh)
}

fn broken(path: &Path, at: &str, max_bytes: u64, error: &DracoError) -> ImportError {
    match error.kind() {
        ErrorKind::LimitExceeded => {
            let what = format!(
                "does not fit into the {} MiB that a compressed mesh may take here; give more memory, or decompress \
                 the file first, for example: npx @gltf-transform/cli copy IN.glb OUT.glb",
                max_bytes >> 20
            );
            unsupported(path, at, what)
        }
        _ => {
            let what =
                format!("the Draco mesh cannot be decoded ({error}); get the file again, or export it again");
            syntax(path, at, what)
        }
    }
}

/// The values of an attribute point by point; nothing if one has none.
fn in_order(attribute: &PointAttribute, points: u32, store: &Store) -> Result<Option<Decoded>> {
    let size = usize::from(attribute.num_components()) * attribute.data_type().byte_length();
    let (values, stride) = (attribute.buffer().data(), attribute.byte_stride());
    let Ok(stride) = usize::try_from(stride) else { return Ok(None) };
    let mut writer = store.writer();
    let mut piece = Vec::new();
    for first in (0..points).step_by(PIECE) {
        piece.clear();
        for point in first..points.min(first.saturating_add(PIECE as u32)) {
            let start = (attribute.mapped_index(PointIndex(point)).0 as usize).checked_mul(stride);
            let value = start.and_then(|start| values.get(start..)?.get(..size));
            let Some(value) = value else { return Ok(None) };
            piece.extend_from_slice(value);
        }
        writer.write(&piece)?;
    }
    writer.finish().map(Some)
}

fn component(of: DataType) -> Option<ComponentType> {
    Some(match of {
        DataType::Int8 => ComponentType::I8,
        DataType::Uint8 | DataType::Bool => ComponentType::U8,
        DataType::Int16 => ComponentType::I16,
        DataType::Uint16 => ComponentType::U16,
        DataType::Uint32 => ComponentType::U32,
        DataType::Float32 => ComponentType::F32,
        DataType::Int32 | DataType::Int64 | DataType::Uint64 | DataType::Float64 | DataType::Invalid => {
            return None;
        }
    })
}
