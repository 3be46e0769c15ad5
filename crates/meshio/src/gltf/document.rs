//! The JSON document: the types of the library for what they describe well, our own where it matters that
//! transforms keep their digits, and nothing for what is not used, so that an oddity there does no harm.

use super::{syntax, unsupported};
use crate::{ImportError, Place, Result};
use gltf::json::extensions::scene::khr_lights_punctual::Light;
use gltf::json::{Accessor, Buffer, Camera, Material, Mesh, buffer::View};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    #[serde(default)]
    extensions_used: Vec<String>,
    #[serde(default)]
    extensions_required: Vec<String>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub buffer_views: Vec<View>,
    #[serde(default)]
    pub cameras: Vec<Camera>,
    #[serde(default)]
    pub images: Vec<ImageEntry>,
    #[serde(default)]
    pub materials: Vec<Material>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub samplers: Vec<Sampler>,
    #[serde(default)]
    pub skins: Vec<Skin>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub textures: Vec<TextureEntry>,
    pub scene: Option<u32>,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: String,
    min_version: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    /// Not used, but a scene whose name is no string is no scene.
    #[serde(rename = "name")]
    _name: Option<String>,
    #[serde(default)]
    pub nodes: Vec<u32>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    pub name: Option<String>,
    #[serde(default)]
    pub children: Vec<u32>,
    pub mesh: Option<u32>,
    pub skin: Option<u32>,
    pub camera: Option<u32>,
    /// Of morph targets, instead of those of the mesh.
    pub weights: Option<Vec<f32>>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    #[serde(default)]
    pub extensions: NodeExtensions,
}

/// An image. Own types for these: those of the library refuse a texture without an image, which extensions may give.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct ImageEntry {
    pub uri: Option<String>,
    pub buffer_view: Option<u32>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Sampler {
    pub mag_filter: Option<u32>,
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
}

#[derive(Debug, Deserialize)]
pub(super) struct TextureEntry {
    pub source: Option<u32>,
    pub sampler: Option<u32>,
    #[serde(default)]
    pub extensions: TextureExtensions,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct TextureExtensions {
    #[serde(rename = "KHR_texture_basisu")]
    pub basisu: Option<OtherSource>,
    #[serde(rename = "EXT_texture_webp")]
    pub webp: Option<OtherSource>,
}

/// An image in another format.
#[derive(Debug, Deserialize)]
pub(super) struct OtherSource {
    pub source: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub inverse_bind_matrices: Option<usize>,
    #[serde(default)]
    pub joints: Vec<u32>,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct Extensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights: Option<Lights>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Lights {
    #[serde(default)]
    pub lights: Vec<Light>,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<NodeLight>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Instancing {
    /// Accessors by what they are.
    #[serde(default)]
    pub attributes: BTreeMap<String, usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct NodeLight {
    pub light: u32,
}

impl Document {
    pub fn parse(path: &Path, json: &[u8]) -> Result<Document> {
        let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
        // Some writers fill the chunk up with zeros and not with blanks.
        let end = json.iter().rposition(|&c| c != 0).map_or(0, |last| last + 1);
        let json = &json[..end];
        let document: Document = serde_json::from_slice(json).map_err(|error| {
            // Version 1.0 had objects where 2.0 has arrays: better to say that.
            match serde_json::from_slice::<VersionOnly>(json) {
                Ok(old) if !old.asset.version.starts_with("2") => version_error(path, &old.asset.version),
                _ => ImportError::syntax(
                    path,
                    Place::Whole,
                    format_args!("the JSON is not glTF 2.0: {error}; export the file again"),
                ),
            }
        })?;
        document.check(path)?;
        Ok(document)
    }

    fn check(&self, path: &Path) -> Result<()> {
        let least = self.asset.min_version.as_deref().unwrap_or("2.0");
        if !self.asset.version.starts_with("2.") || (least != "2.0" && least != "2.1") {
            return Err(version_error(path, &self.asset.version));
        }
        match self.extensions_required.iter().position(|name| is_missed(name)) {
            None => Ok(()),
            Some(i) => {
                let name = &self.extensions_required[i];
                let what = format!("{name} is required and not read here; export the file without it");
                Err(unsupported(path, format_args!("extensionsRequired[{i}]"), what))
            }
        }
    }

    /// Whether the file says that it means nothing without this extension.
    pub fn requires(&self, extension: &str) -> bool {
        self.extensions_required.iter().any(|name| name == extension)
    }

    /// Whether anything in it has to be decompressed, as far as it says so.
    pub fn is_compressed(&self) -> bool {
        self.extensions_used.iter().any(|name| name.ends_with("_compression"))
    }

    /// Extensions that are used and not read; materials tell of theirs.
    pub fn missed_extensions(&self) -> impl Iterator<Item = &str> {
        let all = self.extensions_used.iter().map(String::as_str);
        all.filter(|name| is_missed(name) && !name.starts_with("KHR_materials_"))
    }

    pub fn lights(&self) -> &[Light] {
        self.extensions.lights.as_ref().map_or(&[], |lights| &lights.lights)
    }
}

#[derive(Deserialize)]
struct VersionOnly {
    asset: Asset,
}

fn version_error(path: &Path, version: &str) -> ImportError {
    let what = format!("is glTF {version}; only version 2.0 is read, convert it first");
    unsupported(path, "asset.version", what)
}

/// Extensions that are read.
const READ: [&str; 20] = [
    "KHR_draco_mesh_compression",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_mesh_quantization",
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
];

/// Extensions that do not change the picture: what moves, what else could be shown, what is known of it.
const HARMLESS: [&str; 6] = [
    "KHR_animation_pointer",
    "KHR_materials_variants",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "EXT_mesh_features",
    "EXT_structural_metadata",
];

/// True for extensions without which the picture would be another one.
pub(super) fn is_missed(extension: &str) -> bool {
    !READ.contains(&extension) && !HARMLESS.contains(&extension)
}

/// The entry of `list` that `index` names, or an error at the place `at` that holds the index.
pub(super) fn entry<'a, T>(list: &'a [T], index: usize, path: &Path, at: impl fmt::Display) -> Result<&'a T> {
    list.get(index).ok_or_else(|| {
        syntax(
            path,
            at,
            format_args!("names entry {index} of a list of {}; export the file again", list.len()),
        )
    })
}
