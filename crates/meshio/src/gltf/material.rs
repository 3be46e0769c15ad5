//! Materials: factors, and those extensions that our materials can hold.

use super::document::Document;
use crate::emit::Emitter;
use gltf::json::Material as JsonMaterial;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;
use raystrips_geom::scene::Material;
use std::path::Path;

/// Materials of a document, added to the scene when first used.
pub(super) struct Materials<'a> {
    path: &'a Path,
    document: &'a Document,
    added: Vec<Option<u32>>,
    default: Option<u32>,
    textured: bool,
}

impl<'a> Materials<'a> {
    pub fn new(path: &'a Path, document: &'a Document) -> Materials<'a> {
        let added = vec![None; document.materials.len()];
        Materials { path, document, added, default: None, textured: false }
    }

    /// The material of this index, which must exist.
    pub fn get(&mut self, index: usize, out: &mut Emitter) -> u32 {
        if let Some(material) = self.added[index] {
            return material;
        }
        let json = &self.document.materials[index];
        self.textured |= is_textured(json);
        *self.added[index].insert(out.material(convert(json)))
    }

    /// What the specification gives to primitives without a material.
    pub fn default(&mut self, out: &mut Emitter) -> u32 {
        *self.default.get_or_insert_with(|| out.material(convert(&JsonMaterial::default())))
    }

    pub fn finish(self, out: &mut Emitter) {
        if self.textured {
            out.warn(
                self.path,
                "textures are not read yet: textured materials have their plain color, are not metallic where a \
                 texture says where, and do not glow where a texture says where",
            );
        }
    }
}

fn is_textured(json: &JsonMaterial) -> bool {
    let pbr = &json.pbr_metallic_roughness;
    let glossy = json.extensions.as_ref().and_then(|extensions| extensions.pbr_specular_glossiness.as_ref());
    pbr.base_color_texture.is_some()
        || pbr.metallic_roughness_texture.is_some()
        || json.emissive_texture.is_some()
        || glossy.is_some_and(|glossy| glossy.diffuse_texture.is_some())
}

fn convert(json: &JsonMaterial) -> Material {
    let pbr = &json.pbr_metallic_roughness;
    let [red, green, blue, opacity] = pbr.base_color_factor.0;
    let mut material = Material {
        name: json.name.clone().unwrap_or_default(),
        base_color: [red, green, blue],
        alpha: opacity,
        emission: json.emissive_factor.0,
        // A factor of 1 is the default and means nothing where a texture that is not read says where metal is.
        metallic: if pbr.metallic_roughness_texture.is_some() { 0.0 } else { pbr.metallic_factor.0 },
        roughness: pbr.roughness_factor.0,
        double_sided: json.double_sided,
        specular: 1.0,
        ..Material::default()
    };
    if json.emissive_texture.is_some() {
        material.emission = [0.0; 3];
    }
    if let Some(extensions) = &json.extensions {
        if let Some(glossy) = &extensions.pbr_specular_glossiness {
            let [red, green, blue, opacity] = glossy.diffuse_factor.0;
            (material.base_color, material.alpha) = ([red, green, blue], opacity);
            (material.metallic, material.roughness) = (0.0, 1.0 - glossy.glossiness_factor.0);
        }
        let strength = extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength.0);
        material.emission = material.emission.map(|c| c * strength);
        material.transmission = extensions.transmission.as_ref().map_or(0.0, |t| t.transmission_factor.0);
        material.ior = extensions.ior.as_ref().map_or(material.ior, |i| i.ior.0);
        material.specular = extensions.specular.as_ref().map_or(1.0, |s| s.specular_factor.0);
        let volume = extensions.volume.as_ref().filter(|volume| volume.thickness_factor.0 > 0.0);
        material.thin = volume.is_none();
        if let Some(volume) = volume {
            material.absorption = absorption(volume.attenuation_color.0, volume.attenuation_distance.0);
        }
    }
    match json.alpha_mode {
        Checked::Valid(AlphaMode::Blend) => {}
        Checked::Valid(AlphaMode::Mask) => {
            let cutoff = json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
            material.alpha = if material.alpha >= cutoff { 1.0 } else { 0.0 };
        }
        _ => material.alpha = 1.0,
    }
    clamped(material)
}

/// Of a material of which light has `color` after `distance` (KHR_materials_volume).
fn absorption(color: [f32; 3], distance: f32) -> [f32; 3] {
    match distance > 0.0 && distance.is_finite() {
        // Black would be absorbed at once.
        true => color.map(|c| -c.clamp(1e-6, 1.0).ln() / distance),
        false => [0.0; 3],
    }
}

/// JSON may hold any number; the renderer may not get it.
fn clamped(material: Material) -> Material {
    Material {
        base_color: material.base_color.map(|c| c.clamp(0.0, 1.0)),
        alpha: material.alpha.clamp(0.0, 1.0),
        emission: material.emission.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 }),
        metallic: material.metallic.clamp(0.0, 1.0),
        roughness: material.roughness.clamp(0.0, 1.0),
        transmission: material.transmission.clamp(0.0, 1.0),
        specular: material.specular.clamp(0.0, 1.0),
        // An index of 0 is the specification's way to turn Fresnel reflection off.
        ior: if material.ior >= 1.0 && material.ior.is_finite() { material.ior } else { 1.5 },
        ..material
    }
}
