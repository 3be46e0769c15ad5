//! glTF 2.0 in its binary form: one mesh over one list of positions, a primitive for each geometry.

use super::ExportMesh;
use glam::Vec3;
use raystrips_geom::Aabb;
use raystrips_geom::scene::Material;
use serde_json::{Value, json};
use std::io::{self, Write};

/// Numbers of the specification.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const GLTF: &[u8] = b"glTF";
const VERSION: u32 = 2;
const JSON_CHUNK: &[u8] = b"JSON";
const BINARY_CHUNK: &[u8] = b"BIN\0";
const HEAD_BYTES: usize = 12;
const CHUNK_HEAD_BYTES: usize = 8;
/// Those that materials may have.
const EXTENSIONS: [&str; 4] = [
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
];

pub(super) fn write(mesh: &ExportMesh, out: &mut dyn Write) -> io::Result<()> {
    let parts = mesh.by_geometry();
    let counts: Vec<(usize, usize)> = parts.iter().map(|(geometry, t)| (*geometry, t.len())).collect();
    let position_bytes = size_of_val(mesh.positions);
    let binary_bytes = position_bytes + size_of_val(mesh.triangles);
    let mut json = document(mesh, &counts, position_bytes, binary_bytes).to_string().into_bytes();
    // Chunks end at multiples of four; JSON is filled up with blanks.
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = HEAD_BYTES + 2 * CHUNK_HEAD_BYTES + json.len() + binary_bytes;
    let too_long =
        |_| io::Error::new(io::ErrorKind::FileTooLarge, "more than 4 GiB, which GLB cannot hold; write PLY");
    out.write_all(GLTF)?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&u32::try_from(length).map_err(too_long)?.to_le_bytes())?;
    out.write_all(&(json.len() as u32).to_le_bytes())?;
    out.write_all(JSON_CHUNK)?;
    out.write_all(&json)?;
    out.write_all(&(binary_bytes as u32).to_le_bytes())?;
    out.write_all(BINARY_CHUNK)?;
    let positions = mesh.positions.iter().flat_map(Vec3::to_array);
    positions.flat_map(f32::to_le_bytes).try_for_each(|byte| out.write_all(&[byte]))?;
    let corners = parts.iter().flat_map(|(_, triangles)| triangles).flatten();
    corners.flat_map(|v| v.to_le_bytes()).try_for_each(|byte| out.write_all(&[byte]))
}

/// All but the binary chunk.
fn document(mesh: &ExportMesh, parts: &[(usize, usize)], position_bytes: usize, bytes: usize) -> Value {
    let bounds = Aabb::of_points(mesh.positions.iter().copied());
    let mut accessors = vec![json!({
        "bufferView": 0, "componentType": FLOAT, "count": mesh.positions.len(), "type": "VEC3",
        "min": bounds.min.to_array(), "max": bounds.max.to_array(),
    })];
    let mut primitives = Vec::new();
    let mut offset = 0;
    for &(geometry, triangles) in parts {
        primitives.push(json!({
            "attributes": {"POSITION": 0}, "indices": accessors.len(),
            "material": mesh.scene.geometries[geometry].material,
        }));
        accessors.push(json!({
            "bufferView": 1, "byteOffset": offset, "componentType": UNSIGNED_INT, "count": 3 * triangles,
            "type": "SCALAR",
        }));
        offset += triangles * size_of::<[u32; 3]>();
    }
    json!({
        "asset": {"version": "2.0", "generator": concat!("raystrips ", env!("CARGO_PKG_VERSION"))},
        "extensionsUsed": EXTENSIONS,
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "translation": mesh.offset}],
        "meshes": [{"primitives": primitives}],
        "materials": mesh.scene.materials.iter().map(material).collect::<Vec<_>>(),
        "accessors": accessors,
        "bufferViews": [
            {"buffer": 0, "byteLength": position_bytes},
            {"buffer": 0, "byteOffset": position_bytes, "byteLength": bytes - position_bytes},
        ],
        "buffers": [{"byteLength": bytes}],
    })
}

fn material(material: &Material) -> Value {
    // Factors of textures, which are not written, say nothing without them.
    let mut bare = material.clone();
    bare.drop_textures(|_| true);
    let material = &bare;
    let [r, g, b] = material.base_color;
    // Factors end at 1; what is brighter takes an extension.
    let strength = material.emission.iter().fold(1.0f32, |most, &e| most.max(e));
    let mut extensions = json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}});
    if material.transmission > 0.0 {
        extensions["KHR_materials_transmission"] = json!({"transmissionFactor": material.transmission});
        extensions["KHR_materials_ior"] = json!({"ior": material.ior});
    }
    if material.unlit {
        extensions["KHR_materials_unlit"] = json!({});
    }
    json!({
        "name": material.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, material.alpha],
            "metallicFactor": material.metallic, "roughnessFactor": material.roughness,
        },
        "emissiveFactor": material.emission.map(|e| e / strength),
        "alphaMode": if material.alpha < 1.0 { "BLEND" } else { "OPAQUE" },
        "doubleSided": material.double_sided,
        "extensions": extensions,
    })
}
