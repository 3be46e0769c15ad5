//! glTF 2.0, as `.gltf` with buffers beside it or inside, and as `.glb`.
//!
//! The library `gltf` describes the JSON; everything that follows from it is checked and read here, because that
//! library's own readers panic on broken files, refuse quantized positions and load all buffers into memory.
//! Buffers are mapped, and only those that are asked for; compressed ones are decompressed once, into memory or a
//! scratch file. Meshes stand in the rest pose; those that are shown often are parts of which there are instances, if these
//! are wanted, others are repeated.

mod accessor;
mod buffer;
mod decoded;
mod document;
mod draco;
mod glb;
mod instances;
mod layers;
mod material;
mod meshopt;
mod morph;
mod nodes;
mod pose;
mod primitive;
mod shared;
mod skin;
mod survey;
mod texture;
mod vertices;

pub(crate) use survey::survey;

use crate::emit::Emitter;
use crate::map::Map;
use crate::{ImportError, Place, Result};
use buffer::Buffers;
use document::Document;
use material::Materials;
use primitive::Primitives;
use shared::SharedMeshes;
use skin::Skins;
use std::fmt;
use std::path::Path;
use texture::Textures;

/// Reads the file at `path` and says in words what it holds.
pub(crate) fn read(path: &Path, out: &mut Emitter) -> Result<String> {
    let map = Map::open(path)?;
    let container = glb::split(path, &map)?;
    let document = Document::parse(path, container.json)?;
    let missed: Vec<&str> = document.missed_extensions().collect();
    if !missed.is_empty() {
        out.warn(path, format_args!("of extensions this is not read: {}", missed.join(", ")));
    }
    let buffers = Buffers::new(path, &document, &map, container.binary, out.options);
    let scene = nodes::walk(path, &document, out)?;

    let textures = Textures { path, document: &document, buffers: &buffers };
    let materials = Materials::new(textures);
    let skins = Skins::new(path, &document, &buffers, &scene.file_from_node);
    // Parts have no parts.
    let shared = match out.is_in_part() {
        true => SharedMeshes::none(&document),
        false => SharedMeshes::of(path, &document, &buffers, &scene.meshes, out.placement(), out.options)?,
    };
    let width = out.strand_width();
    let mut primitives = Primitives::new(path, &document, &buffers, materials, skins, shared, width);
    let count = scene.meshes.len();
    for (i, node) in scene.meshes.iter().enumerate() {
        primitives.add_mesh(node, out)?;
        out.advance((map.len() as f64 * (i + 1) as f64 / count as f64) as u64);
    }
    primitives.finish(out);
    buffers.files().for_each(|file| out.note_file(file));
    Ok(format!("its scene has {count} meshes, of which none holds a triangle or a line of known width"))
}

/// True if the file at `path` has neither cameras nor lights.
pub(crate) fn shows_only_meshes(path: &Path) -> Result<bool> {
    let map = Map::open(path)?;
    let document = Document::parse(path, glb::split(path, &map)?.json)?;
    Ok(document.nodes.iter().all(|node| node.camera.is_none() && node.extensions.light.is_none()))
}

fn syntax(path: &Path, at: impl fmt::Display, what: impl fmt::Display) -> ImportError {
    ImportError::syntax(path, Place::Json(at.to_string()), what)
}

fn unsupported(path: &Path, at: impl fmt::Display, what: impl fmt::Display) -> ImportError {
    ImportError::unsupported(path, Place::Json(at.to_string()), what)
}

#[cfg(test)]
mod tests;
