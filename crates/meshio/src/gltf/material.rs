//! Materials: factors, textures, and those extensions that our materials can hold.

use super::document::is_missed;
use super::layers::{self, Layers};
use super::texture::{Named, Textures};
use crate::emit::Emitter;
use gltf::json::Material as JsonMaterial;
use gltf::json::extensions::material::{Material as Extensions, PbrSpecularGlossiness, Specular};
use gltf::json::material::AlphaMode as JsonAlphaMode;
use gltf::json::validation::Checked;
use raystrips_geom::Streams;
use raystrips_geom::scene::{AlphaMode, Material, MaterialTextures, SceneDesc};
use std::collections::BTreeSet;

/// Materials of a document, added to the scene when first used.
pub(super) struct Materials<'a> {
    textures: Textures<'a>,
    added: Vec<Option<u32>>,
    default: Option<u32>,
    not_read: BTreeSet<String>,
}

impl<'a> Materials<'a> {
    pub fn new(textures: Textures<'a>) -> Materials<'a> {
        let added = vec![None; textures.document.materials.len()];
        Materials { textures, added, default: None, not_read: BTreeSet::new() }
    }

    /// The material of this index, which must exist.
    pub fn get(&mut self, index: usize, out: &mut Emitter) -> u32 {
        if let Some(material) = self.added[index] {
            return material;
        }
        let json = &self.textures.document.materials[index];
        if let Some(extensions) = &json.extensions {
            self.not_read.extend(extensions.others.keys().filter(|name| is_missed(name)).cloned());
        }
        if json.occlusion_texture.is_some() {
            self.not_read.insert("occlusion (paths find themselves what is hidden)".into());
        }
        let material = self.convert(json, out);
        *self.added[index].insert(out.material(material))
    }

    /// What the specification gives to primitives without a material.
    pub fn default(&mut self, out: &mut Emitter) -> u32 {
        if let Some(material) = self.default {
            return material;
        }
        let material = self.convert(&JsonMaterial::default(), out);
        *self.default.insert(out.material(material))
    }

    /// Tells what is not read.
    pub fn finish(self, out: &mut Emitter) {
        if !self.not_read.is_empty() {
            let names: Vec<String> = self.not_read.into_iter().collect();
            let names = names.join(", ");
            out.warn(self.textures.path, format_args!("of materials this is not read: {names}"));
        }
    }

    fn convert(&mut self, json: &JsonMaterial, out: &mut Emitter) -> Material {
        let pbr = &json.pbr_metallic_roughness;
        let [red, green, blue, opacity] = pbr.base_color_factor.0;
        let mut material = Material {
            name: json.name.clone().unwrap_or_default(),
            base_color: [red, green, blue],
            alpha: opacity,
            emission: json.emissive_factor.0,
            metallic: pbr.metallic_factor.0,
            roughness: pbr.roughness_factor.0,
            double_sided: json.double_sided,
            specular: 1.0,
            ..Material::default()
        };
        let mut texture = |info: &Option<gltf::json::texture::Info>, is_srgb| {
            info.as_ref().map(|info| self.textures.get(&Named::of(info), is_srgb, out))
        };
        material.textures.base_color = texture(&pbr.base_color_texture, true);
        material.textures.metallic = texture(&pbr.metallic_roughness_texture, false);
        material.textures.roughness = material.textures.metallic;
        material.textures.emission = texture(&json.emissive_texture, true);
        if let Some(normal) = &json.normal_texture {
            material.textures.normal = Some(self.textures.get(&Named::of_normal(normal), false, out));
            material.normal_scale = if normal.scale.is_finite() { normal.scale } else { 1.0 };
        }
        if let Some(extensions) = &json.extensions {
            self.extend(&mut material, extensions, out);
        }
        material.drop_textures(|texture| texture == MaterialTextures::LOST);
        let cutoff = json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
        match json.alpha_mode {
            Checked::Valid(JsonAlphaMode::Blend) => material.alpha_mode = AlphaMode::Blend,
            Checked::Valid(JsonAlphaMode::Mask) => material.alpha_mode = AlphaMode::Mask(cutoff),
            _ => material.alpha = 1.0,
        }
        clamped(material)
    }

    fn extend(&mut self, material: &mut Material, extensions: &Extensions, out: &mut Emitter) {
        if let Some(glossy) = &extensions.pbr_specular_glossiness {
            self.take_glossiness(material, glossy, out);
        }
        let strength = extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength.0);
        material.emission = material.emission.map(|c| c * strength);
        if let Some(transmission) = &extensions.transmission {
            material.transmission = transmission.transmission_factor.0;
            let texture = transmission.transmission_texture.as_ref();
            material.textures.transmission =
                texture.map(|info| self.textures.get(&Named::of(info), false, out));
        }
        material.ior = extensions.ior.as_ref().map_or(material.ior, |i| i.ior.0);
        if let Some(specular) = &extensions.specular {
            self.take_specular(material, specular, out);
        }
        let volume = extensions.volume.as_ref().filter(|volume| volume.thickness_factor.0 > 0.0);
        material.thin = volume.is_none();
        if let Some(volume) = volume {
            material.absorption = absorption(volume.attenuation_color.0, volume.attenuation_distance.0);
        }
        Layers { textures: self.textures, extensions, out }.read(material);
        material.unlit = extensions.unlit.is_some();
    }

    fn take_specular(&self, material: &mut Material, specular: &Specular, out: &mut Emitter) {
        material.specular = specular.specular_factor.0;
        material.specular_color = specular.specular_color_factor.0;
        let texture = |info: &Option<gltf::json::texture::Info>, is_srgb, out: &mut Emitter| {
            info.as_ref().map(|info| self.textures.get(&Named::of(info), is_srgb, out))
        };
        material.textures.specular = texture(&specular.specular_texture, false, out);
        material.textures.specular_color = texture(&specular.specular_color_texture, true, out);
    }

    /// The reflectance of a boundary straight on is 0.04 times its color (KHR_materials_specular), so that any can be had.
    fn take_glossiness(&self, material: &mut Material, glossy: &PbrSpecularGlossiness, out: &mut Emitter) {
        let [red, green, blue, opacity] = glossy.diffuse_factor.0;
        (material.base_color, material.alpha) = ([red, green, blue], opacity);
        (material.metallic, material.roughness) = (0.0, 1.0 - glossy.glossiness_factor.0);
        (material.textures.metallic, material.textures.roughness) = (None, None);
        material.specular_color = glossy.specular_factor.0.map(|c| c / 0.04);
        let mut texture = |info: &Option<gltf::json::texture::Info>| {
            info.as_ref().map(|info| self.textures.get(&Named::of(info), true, out))
        };
        material.textures.base_color = texture(&glossy.diffuse_texture);
        let specular = texture(&glossy.specular_glossiness_texture);
        (material.textures.specular_color, material.textures.glossiness) = (specular, specular);
    }
}

/// What vertices need for the textures of a material.
pub(super) fn tex_coords(scene: &SceneDesc, material: u32) -> Streams {
    let material = &scene.materials[material as usize];
    let sets = material.textures.all().map(|texture| scene.textures[texture as usize].tex_coord);
    let direction = (material.anisotropy.strength > 0.0).then_some(0);
    sets.chain(direction).fold(Streams::NONE, |all, set| {
        all.union(if set == 0 { Streams::TEX_COORDS_0 } else { Streams::TEX_COORDS_1 })
    })
}

/// Whether a material asks for the directions in which texture coordinates go.
pub(super) fn needs_tangents(scene: &SceneDesc, material: u32) -> bool {
    let material = &scene.materials[material as usize];
    material.textures.normal.or(material.textures.clearcoat_normal).is_some()
        || material.anisotropy.strength > 0.0
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
    let radiance = |c: f32| if c.is_finite() { c.max(0.0) } else { 0.0 };
    let material = layers::clamped(material);
    Material {
        base_color: material.base_color.map(|c| c.clamp(0.0, 1.0)),
        alpha: material.alpha.clamp(0.0, 1.0),
        emission: material.emission.map(radiance),
        metallic: material.metallic.clamp(0.0, 1.0),
        roughness: material.roughness.clamp(0.0, 1.0),
        transmission: material.transmission.clamp(0.0, 1.0),
        specular: material.specular.clamp(0.0, 1.0),
        specular_color: material.specular_color.map(radiance),
        // An index of 0 is the specification's way to turn Fresnel reflection off.
        ior: if material.ior >= 1.0 && material.ior.is_finite() { material.ior } else { 1.5 },
        ..material
    }
}
