//! What a scene is besides its triangles: plain data with public fields, as read from model files and as kept
//! in a pack.
//!
//! Lengths are in scene units, angles in radians, colors linear RGB with the primaries of sRGB.

use crate::texture::{Image, Texture};
use serde::{Deserialize, Serialize};

/// Everything of a scene but its triangles, which name their geometry by its place in [`SceneDesc::geometries`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneDesc {
    /// One entry for each part with a material of its own; a triangle's geometry id is an index into this.
    pub geometries: Vec<Geometry>,
    /// Materials, named by index.
    pub materials: Vec<Material>,
    /// Lights without a surface; emissive triangles are lights by their material.
    pub lights: Vec<Light>,
    /// Cameras of the file, the first one being the default.
    pub cameras: Vec<Camera>,
    /// What rays see that leave the scene. `None`: not stated.
    pub sky: Option<Sky>,
    /// Images, named by index.
    pub images: Vec<Image>,
    /// Textures, named by index.
    pub textures: Vec<Texture>,
}

/// A part of the scene that shares a material.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Name in the file, for reports; may be empty.
    pub name: String,
    /// Index into [`SceneDesc::materials`].
    pub material: u32,
    /// Some of it, or all, are triangles.
    pub has_triangles: bool,
}

/// A surface: the metallic-roughness model of glTF 2.0, with transmission, absorption and layers. Where there is a texture,
/// numbers are multiplied by what it says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the file, for reports and overrides; may be empty.
    pub name: String,
    /// Albedo of a dielectric, reflectance at normal incidence of a metal.
    pub base_color: [f32; 3],
    /// Opacity, 0 to 1.
    pub alpha: f32,
    /// How opacity is meant.
    pub alpha_mode: AlphaMode,
    /// Emitted radiance; leaves the front face only, unless `double_sided`.
    pub emission: [f32; 3],
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
    /// Share of light that is transmitted and not diffused, 0 to 1.
    pub transmission: f32,
    /// Index of refraction.
    pub ior: f32,
    /// How much of what the boundary of a dielectric reflects is reflected, 0 to 1.
    pub specular: f32,
    /// What the reflectance of that boundary straight on is multiplied by; may be above 1.
    pub specular_color: [f32; 3],
    /// Share of light that is absorbed by what is transmitting, for each unit of length at the beginning.
    pub absorption: [f32; 3],
    /// Transmits as a thin sheet: what goes through is not refracted.
    pub thin: bool,
    /// Emits from both faces. Reflection always happens on both.
    pub double_sided: bool,
    /// Shows its base color whatever light there is, and nothing else.
    pub unlit: bool,
    /// A clear coat above everything else.
    pub clearcoat: Clearcoat,
    /// Fibers below it.
    pub sheen: Sheen,
    /// Facets that are rougher along one direction.
    pub anisotropy: Anisotropy,
    /// A thin film on the boundary.
    pub iridescence: Iridescence,
    /// What differs from place to place.
    pub textures: MaterialTextures,
    /// What slopes of the normal texture are multiplied by.
    pub normal_scale: f32,
}

/// A clear coat, after KHR_materials_clearcoat. Slopes of the surface below are not its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clearcoat {
    /// How much of it there is, 0 to 1.
    pub strength: f32,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
    /// What slopes of its normal texture are multiplied by.
    pub normal_scale: f32,
}

impl Default for Clearcoat {
    /// None.
    fn default() -> Clearcoat {
        Clearcoat { strength: 0.0, roughness: 0.0, normal_scale: 1.0 }
    }
}

/// The shine of fibers at grazing angles, after KHR_materials_sheen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sheen {
    /// Color; black where there is none.
    pub color: [f32; 3],
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
}

/// Facets that are rougher along one direction of the surface, after KHR_materials_anisotropy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anisotropy {
    /// 0 for none to 1 for as rough along that direction as can be.
    pub strength: f32,
    /// Angle from the direction in which texture coordinates go to the right to that in which facets are rougher,
    /// counter-clockwise.
    pub rotation: f32,
}

/// A thin film on a boundary, after KHR_materials_iridescence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Iridescence {
    /// How much of it there is, 0 to 1.
    pub strength: f32,
    /// Index of refraction of the film.
    pub ior: f32,
    /// Thickness in nanometers where the texture of thickness is 0.
    pub least_thickness: f32,
    /// Thickness in nanometers where that is 1, or where there is none.
    pub thickness: f32,
}

impl Default for Iridescence {
    /// None, and the numbers that glTF has for what is not said.
    fn default() -> Iridescence {
        Iridescence { strength: 0.0, ior: 1.3, least_thickness: 100.0, thickness: 400.0 }
    }
}

/// How opacity is meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum AlphaMode {
    /// The surface is as opaque as [`Material::alpha`] says; textures and colors of vertices do not matter.
    #[default]
    Uniform,
    /// Places are as opaque as the number, texture and color say.
    Blend,
    /// Places are opaque where that is at least this, and else not there.
    Mask(f32),
}

/// The textures of a [`Material`]: indices into [`SceneDesc::textures`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaterialTextures {
    /// Base color; and opacity, in its fourth channel.
    pub base_color: Option<u32>,
    /// More opacity, in red.
    pub opacity: Option<u32>,
    /// In blue.
    pub metallic: Option<u32>,
    /// In green.
    pub roughness: Option<u32>,
    /// What one minus the roughness is multiplied by, in the fourth channel.
    pub glossiness: Option<u32>,
    /// Emission.
    pub emission: Option<u32>,
    /// Slopes of the surface: x to the right of the image, y upwards, z out of the surface, each 0 to 1 for -1 to 1.
    pub normal: Option<u32>,
    /// In red.
    pub transmission: Option<u32>,
    /// In the fourth channel.
    pub specular: Option<u32>,
    /// Color of the boundary's reflection.
    pub specular_color: Option<u32>,
    /// How much clear coat there is, in red.
    pub clearcoat: Option<u32>,
    /// In green.
    pub clearcoat_roughness: Option<u32>,
    /// Slopes of the clear coat, as those of the surface are.
    pub clearcoat_normal: Option<u32>,
    /// Color of the sheen.
    pub sheen_color: Option<u32>,
    /// In the fourth channel.
    pub sheen_roughness: Option<u32>,
    /// The direction in which facets are rougher: to the right of the image in red, upwards in green, each 0 to 1 for -1 to
    /// 1; and how much they are, in blue.
    pub anisotropy: Option<u32>,
    /// How much iridescence there is, in red.
    pub iridescence: Option<u32>,
    /// How thick the film is between its two numbers, in green.
    pub iridescence_thickness: Option<u32>,
}

impl MaterialTextures {
    /// Stands for a texture that a file names and that cannot be had, until [`Material::drop_textures`].
    pub const LOST: u32 = u32::MAX;

    /// All that there are.
    pub fn all(&self) -> impl Iterator<Item = u32> {
        let mut copy = *self;
        copy.slots().map(|slot| *slot).into_iter().flatten()
    }

    /// The places of all that there can be.
    fn slots(&mut self) -> [&mut Option<u32>; 18] {
        let MaterialTextures {
            base_color,
            opacity,
            metallic,
            roughness,
            glossiness,
            emission,
            normal,
            transmission,
            specular,
            specular_color,
            clearcoat,
            clearcoat_roughness,
            clearcoat_normal,
            sheen_color,
            sheen_roughness,
            anisotropy,
            iridescence,
            iridescence_thickness,
        } = self;
        [
            base_color,
            opacity,
            metallic,
            roughness,
            glossiness,
            emission,
            normal,
            transmission,
            specular,
            specular_color,
            clearcoat,
            clearcoat_roughness,
            clearcoat_normal,
            sheen_color,
            sheen_roughness,
            anisotropy,
            iridescence,
            iridescence_thickness,
        ]
    }
}

impl Default for Material {
    /// A matte light gray.
    fn default() -> Material {
        Material {
            name: String::new(),
            base_color: [0.8; 3],
            alpha: 1.0,
            alpha_mode: AlphaMode::Uniform,
            emission: [0.0; 3],
            metallic: 0.0,
            roughness: 1.0,
            transmission: 0.0,
            ior: 1.5,
            specular: 0.0,
            specular_color: [1.0; 3],
            absorption: [0.0; 3],
            thin: false,
            double_sided: false,
            unlit: false,
            clearcoat: Clearcoat::default(),
            sheen: Sheen::default(),
            anisotropy: Anisotropy::default(),
            iridescence: Iridescence::default(),
            textures: MaterialTextures::default(),
            normal_scale: 1.0,
        }
    }
}

impl Material {
    /// True where the surface shines.
    pub fn is_emissive(&self) -> bool {
        self.unlit || self.emission.iter().any(|&c| c > 0.0)
    }

    /// True where each of its triangles is a light of one color, which can be sampled.
    pub fn is_lamp(&self) -> bool {
        self.is_emissive() && self.textures.emission.is_none() && !self.unlit && !self.is_see_through()
    }

    /// Takes textures away that cannot be had, and with them what they confine to some places, which would be everywhere.
    pub fn drop_textures(&mut self, is_lost: impl Fn(u32) -> bool) {
        let had = self.textures;
        for slot in self.textures.slots() {
            *slot = slot.filter(|&texture| !is_lost(texture));
        }
        let has = self.textures;
        let confined = [
            (had.metallic, has.metallic, &mut self.metallic),
            (had.transmission, has.transmission, &mut self.transmission),
            (had.clearcoat, has.clearcoat, &mut self.clearcoat.strength),
            (had.anisotropy, has.anisotropy, &mut self.anisotropy.strength),
            (had.iridescence, has.iridescence, &mut self.iridescence.strength),
        ];
        confined.into_iter().filter(|(had, has, _)| had != has).for_each(|(_, _, factor)| *factor = 0.0);
        if had.emission != has.emission {
            self.emission = [0.0; 3];
        }
        if had.sheen_color != has.sheen_color {
            self.sheen.color = [0.0; 3];
        }
        if had.specular_color != has.specular_color {
            self.specular_color = [1.0; 3];
        }
        if had.glossiness != has.glossiness {
            self.roughness = 1.0;
        }
    }

    /// True if rays may pass its surface, or some places of it.
    pub fn is_see_through(&self) -> bool {
        self.alpha < 1.0 || self.alpha_mode != AlphaMode::Uniform
    }
}

/// A light without a surface, after KHR_lights_punctual.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name in the file; may be empty.
    pub name: String,
    /// Color times intensity: W/sr for point and spot lights, W/m² for directional ones.
    pub intensity: [f32; 3],
    /// Shape of the light.
    pub kind: LightKind,
}

/// Shapes of [`Light`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// Shines from a point into all directions.
    Point {
        /// Where it is.
        position: [f64; 3],
    },
    /// Shines from a point into a cone.
    Spot {
        /// Where it is.
        position: [f64; 3],
        /// Unit vector along which it shines.
        direction: [f32; 3],
        /// Half angle of the cone of full intensity.
        inner_angle: f32,
        /// Half angle at which the light ends.
        outer_angle: f32,
    },
    /// Shines from infinitely far away.
    Directional {
        /// Unit vector along which it shines.
        direction: [f32; 3],
    },
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name in the file; may be empty.
    pub name: String,
    /// Where it is.
    pub position: [f64; 3],
    /// Unit vector along which it looks.
    pub forward: [f32; 3],
    /// Unit vector that is up in the picture; at right angles to `forward`.
    pub up: [f32; 3],
    /// How it projects.
    pub projection: Projection,
    /// Width over height that the file asks for.
    pub aspect: Option<f32>,
}

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Projection {
    /// Angle of the whole picture's height.
    Perspective {
        /// Vertical field of view.
        vertical_fov: f32,
    },
    /// Height of what the picture shows.
    Orthographic {
        /// In scene units.
        height: f32,
    },
}

/// Light from everywhere outside of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Sky {
    /// The same radiance from every direction.
    Constant([f32; 3]),
    /// From `zenith` straight up (+y) over `horizon` to `ground` straight down, linear in the sine of the
    /// elevation.
    Gradient {
        /// Radiance from above.
        zenith: [f32; 3],
        /// Radiance from the side.
        horizon: [f32; 3],
        /// Radiance from below.
        ground: [f32; 3],
    },
}

impl SceneDesc {
    /// Opacity of a geometry, 0 to 1; 1 where its material is not known.
    pub fn opacity(&self, geometry: u32) -> f32 {
        let material = self.geometries.get(geometry as usize).map(|g| g.material as usize);
        let alpha = material.and_then(|material| self.materials.get(material)).map_or(1.0, |m| m.alpha);
        if alpha.is_finite() { alpha.clamp(0.0, 1.0) } else { 1.0 }
    }

    /// True where something shines: a sky, a light, or a lamp that a geometry is. What only glows in places, as textures
    /// say, lights nothing to speak of.
    pub fn has_light(&self) -> bool {
        self.sky.is_some()
            || !self.lights.is_empty()
            || self
                .geometries
                .iter()
                .any(|g| self.materials.get(g.material as usize).is_some_and(Material::is_lamp))
    }

    /// Moves cameras and lights by `offset`.
    pub fn translate(&mut self, offset: [f64; 3]) {
        let shift = |p: &mut [f64; 3]| p.iter_mut().zip(offset).for_each(|(x, o)| *x += o);
        self.cameras.iter_mut().for_each(|camera| shift(&mut camera.position));
        for light in &mut self.lights {
            match &mut light.kind {
                LightKind::Point { position } | LightKind::Spot { position, .. } => shift(position),
                LightKind::Directional { .. } => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_lost_texture_confines_is_nowhere() {
        let textures = MaterialTextures {
            base_color: Some(0),
            metallic: Some(1),
            roughness: Some(1),
            emission: Some(2),
            normal: Some(1),
            clearcoat: Some(2),
            ..MaterialTextures::default()
        };
        let clearcoat = Clearcoat { strength: 1.0, ..Clearcoat::default() };
        let mut material =
            Material { metallic: 1.0, emission: [1.0; 3], clearcoat, textures, ..Material::default() };
        material.drop_textures(|texture| texture == 1);
        assert_eq!(material.textures.all().collect::<Vec<_>>(), [0, 2, 2]);
        assert_eq!((material.metallic, material.emission, material.clearcoat), (0.0, [1.0; 3], clearcoat));
        material.drop_textures(|texture| texture == 2);
        assert_eq!((material.emission, material.clearcoat.strength), ([0.0; 3], 0.0));
        assert_eq!(material.base_color, Material::default().base_color);
    }
}
