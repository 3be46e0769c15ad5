//! Extensions of materials for what lies over a surface or changes its boundary: clear coats, sheen, anisotropy,
//! iridescence.

use super::texture::{Named, Textures};
use crate::emit::Emitter;
use gltf::json::extensions::material::Material as Extensions;
use gltf::json::material::NormalTexture;
use gltf::json::texture::Info;
use raystrips_geom::scene::{Anisotropy, Clearcoat, Iridescence, Material, Sheen};
use serde::Deserialize;
use serde::de::DeserializeOwned;

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonClearcoat {
    clearcoat_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<NormalTexture>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonSheen {
    sheen_color_factor: [f32; 3],
    sheen_color_texture: Option<Info>,
    sheen_roughness_factor: f32,
    sheen_roughness_texture: Option<Info>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonAnisotropy {
    anisotropy_strength: f32,
    anisotropy_rotation: f32,
    anisotropy_texture: Option<Info>,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonIridescence {
    iridescence_factor: f32,
    iridescence_texture: Option<Info>,
    iridescence_ior: f32,
    iridescence_thickness_minimum: f32,
    iridescence_thickness_maximum: f32,
    iridescence_thickness_texture: Option<Info>,
}

impl Default for JsonIridescence {
    fn default() -> JsonIridescence {
        let Iridescence { strength, ior, least_thickness, thickness } = Iridescence::default();
        JsonIridescence {
            iridescence_factor: strength,
            iridescence_texture: None,
            iridescence_ior: ior,
            iridescence_thickness_minimum: least_thickness,
            iridescence_thickness_maximum: thickness,
            iridescence_thickness_texture: None,
        }
    }
}

/// Reads the layers of one material.
pub(super) struct Layers<'a, 'e, 's> {
    pub textures: Textures<'a>,
    pub extensions: &'a Extensions,
    pub out: &'e mut Emitter<'s>,
}

impl Layers<'_, '_, '_> {
    pub fn read(&mut self, material: &mut Material) {
        if let Some(json) = self.extension("KHR_materials_clearcoat") {
            self.clearcoat(json, material);
        }
        if let Some(json) = self.extension("KHR_materials_sheen") {
            self.sheen(json, material);
        }
        if let Some(json) = self.extension("KHR_materials_anisotropy") {
            self.anisotropy(&json, material);
        }
        if let Some(json) = self.extension("KHR_materials_iridescence") {
            self.iridescence(&json, material);
        }
    }

    /// An extension; nothing where its JSON does not fit, which is told.
    fn extension<T: DeserializeOwned>(&mut self, name: &str) -> Option<T> {
        let parsed = T::deserialize(self.extensions.others.get(name)?);
        let tell = |error: &_| self.out.warn(self.textures.path, format_args!("{name} is left out: {error}"));
        parsed.inspect_err(tell).ok()
    }

    fn texture(&mut self, info: &Option<Info>, is_srgb: bool) -> Option<u32> {
        Some(self.textures.get(&Named::of(info.as_ref()?), is_srgb, self.out))
    }

    fn clearcoat(&mut self, json: JsonClearcoat, material: &mut Material) {
        let normal_scale = json.clearcoat_normal_texture.as_ref().map_or(1.0, |normal| normal.scale);
        material.clearcoat = Clearcoat {
            strength: json.clearcoat_factor,
            roughness: json.clearcoat_roughness_factor,
            normal_scale,
        };
        material.textures.clearcoat = self.texture(&json.clearcoat_texture, false);
        material.textures.clearcoat_roughness = self.texture(&json.clearcoat_roughness_texture, false);
        let normal = json.clearcoat_normal_texture.as_ref();
        material.textures.clearcoat_normal =
            normal.map(|normal| self.textures.get(&Named::of_normal(normal), false, self.out));
    }

    fn sheen(&mut self, json: JsonSheen, material: &mut Material) {
        material.sheen = Sheen { color: json.sheen_color_factor, roughness: json.sheen_roughness_factor };
        material.textures.sheen_color = self.texture(&json.sheen_color_texture, true);
        material.textures.sheen_roughness = self.texture(&json.sheen_roughness_texture, false);
    }

    fn anisotropy(&mut self, json: &JsonAnisotropy, material: &mut Material) {
        material.anisotropy =
            Anisotropy { strength: json.anisotropy_strength, rotation: json.anisotropy_rotation };
        material.textures.anisotropy = self.texture(&json.anisotropy_texture, false);
    }

    fn iridescence(&mut self, json: &JsonIridescence, material: &mut Material) {
        material.iridescence = Iridescence {
            strength: json.iridescence_factor,
            ior: json.iridescence_ior,
            least_thickness: json.iridescence_thickness_minimum,
            thickness: json.iridescence_thickness_maximum,
        };
        material.textures.iridescence = self.texture(&json.iridescence_texture, false);
        material.textures.iridescence_thickness = self.texture(&json.iridescence_thickness_texture, false);
    }
}

/// Numbers of layers in their ranges: JSON may hold any.
pub(super) fn clamped(material: Material) -> Material {
    let share = |x: f32| x.clamp(0.0, 1.0);
    let Material { clearcoat, sheen, anisotropy, iridescence, .. } = material;
    let plain = Iridescence::default();
    let thickness = |x: f32, plain: f32| if x.is_finite() { x.max(0.0) } else { plain };
    Material {
        clearcoat: Clearcoat {
            strength: share(clearcoat.strength),
            roughness: share(clearcoat.roughness),
            normal_scale: if clearcoat.normal_scale.is_finite() { clearcoat.normal_scale } else { 1.0 },
        },
        sheen: Sheen { color: sheen.color.map(share), roughness: share(sheen.roughness) },
        anisotropy: Anisotropy {
            strength: share(anisotropy.strength),
            rotation: if anisotropy.rotation.is_finite() { anisotropy.rotation } else { 0.0 },
        },
        iridescence: Iridescence {
            strength: share(iridescence.strength),
            ior: if iridescence.ior >= 1.0 && iridescence.ior.is_finite() {
                iridescence.ior
            } else {
                plain.ior
            },
            least_thickness: thickness(iridescence.least_thickness, plain.least_thickness),
            thickness: thickness(iridescence.thickness, plain.thickness),
        },
        ..material
    }
}
