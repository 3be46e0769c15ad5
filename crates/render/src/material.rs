//! Materials made ready for shading: one lookup by geometry, every number in its range, and then what textures and colors of
//! vertices say of a place.

use crate::layers::Layers;
use crate::texture::{Lookup, Textures};
use crate::world::World;
use glam::{Vec2, Vec3, Vec4};
use raystrips_geom::Attributes;
use raystrips_geom::scene::{AlphaMode, Material, MaterialTextures, SceneDesc};
use raystrips_tracer::OpenError;

/// What shading asks of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShadingMaterial {
    /// Share of light that a dielectric reflects diffusely or lets through, or a metal reflects; each channel 0 to 1.
    pub albedo: Vec3,
    /// Opacity, 0 to 1.
    pub alpha: f32,
    /// Radiance that leaves an emitting side.
    pub emission: Vec3,
    /// Emits from the back too.
    pub double_sided: bool,
    /// Emits its base color and nothing else.
    unlit: bool,
    /// Its light is sampled.
    pub is_lamp: bool,
    /// Nothing but diffuse reflection.
    pub is_matte: bool,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Width of the distribution of microfacets.
    pub alpha_ggx: f32,
    /// How much of what a dielectric's boundary reflects is reflected.
    pub specular: f32,
    /// What its reflectance straight on is multiplied by.
    pub specular_color: Vec3,
    /// Share of light below the boundary that is transmitted and not diffused.
    pub transmission: f32,
    /// Index of refraction, at least 1.
    pub ior: f32,
    /// Light that is transmitted goes straight on.
    thin: bool,
    /// Share of light that is absorbed, for each unit of length at the beginning.
    pub absorption: Vec3,
    /// Number of what is behind the surface where that absorbs light; 0: nothing.
    pub medium: u8,
    /// What most materials do not have.
    pub layers: Option<Layers>,
}

impl ShadingMaterial {
    pub fn new(material: &Material) -> ShadingMaterial {
        let share = |x: f32| if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.0 };
        let radiance = |c: f32| if c.is_finite() { c.max(0.0) } else { 0.0 };
        let ior = if material.ior.is_finite() { material.ior.max(1.0) } else { 1.0 };
        let [metallic, specular, transmission] =
            [material.metallic, material.specular, material.transmission].map(share);
        let roughness = share(material.roughness);
        let layers = Layers::new(material);
        let is_iridescent = layers.is_some_and(|layers| layers.iridescence > 0.0);
        let mut ready = ShadingMaterial {
            albedo: Vec3::from(material.base_color.map(|c| c.clamp(0.0, 1.0))),
            alpha: material.alpha.clamp(0.0, 1.0),
            emission: Vec3::from(material.emission.map(radiance)),
            double_sided: material.double_sided,
            unlit: material.unlit,
            is_lamp: material.is_lamp(),
            is_matte: metallic == 0.0
                && transmission == 0.0
                && (specular == 0.0 || (ior == 1.0 && !is_iridescent))
                && !layers.is_some_and(|layers| layers.reflect()),
            metallic,
            alpha_ggx: roughness * roughness,
            specular,
            specular_color: Vec3::from(material.specular_color.map(radiance)),
            transmission,
            ior,
            thin: material.thin,
            absorption: Vec3::from(material.absorption.map(radiance)),
            medium: 0,
            layers,
        };
        ready.shine_if_unlit();
        ready
    }

    /// What shows its color whatever light there is does as if it shone by itself, and scatters nothing.
    fn shine_if_unlit(&mut self) {
        if self.unlit {
            self.emission = std::mem::replace(&mut self.albedo, Vec3::ZERO);
            (self.is_matte, self.layers) = (true, None);
        }
    }

    /// What of light below a dielectric's boundary is reflected diffusely.
    pub fn diffuse(&self) -> Vec3 {
        self.albedo * ((1.0 - self.metallic) * (1.0 - self.transmission))
    }

    /// What of light below a dielectric's boundary goes through.
    pub fn transmitted(&self) -> Vec3 {
        self.albedo * ((1.0 - self.metallic) * self.transmission)
    }

    /// Light goes through and is refracted.
    pub fn is_solid(&self) -> bool {
        self.transmission > 0.0 && !self.thin
    }

    /// Light goes through as if the surface were a thin sheet of the material.
    pub fn is_sheet(&self) -> bool {
        self.transmission > 0.0 && self.thin
    }

    /// Radiance emitted from the front, or from the back.
    pub fn emitted(&self, front: bool) -> Vec3 {
        if front || self.double_sided { self.emission } else { Vec3::ZERO }
    }
}

/// A place on a triangle.
pub(crate) struct Place<'a> {
    pub world: &'a dyn World,
    pub attributes: Attributes,
    /// Of the corners.
    pub tex_coords: [[Vec2; 2]; 3],
    /// From the first corner to the others.
    pub edges: [Vec3; 2],
    /// Of what is looked at, in scene units.
    pub width: f32,
}

impl Place<'_> {
    /// What a step in an image to the right and one upwards is on the surface, each along one alone, where the triangle has
    /// these edges in the image; nothing where it has no extent there.
    fn axes(&self, [a, b]: [Vec2; 2]) -> Option<[Vec3; 2]> {
        let determinant = a.perp_dot(b);
        if !(determinant.abs() > 0.0 && determinant.is_finite()) {
            return None;
        }
        let [e1, e2] = self.edges;
        let right = (e1 * b.y - e2 * a.y) / determinant;
        let down = (e2 * a.x - e1 * b.x) / determinant;
        Some([right, -down])
    }

    /// The same from corner to corner, where tangents are known.
    fn smooth_axes(&self, edges: [Vec2; 2]) -> Option<[Vec3; 2]> {
        let [own_right, own_up] = self.axes(edges)?;
        let Some(right) = self.attributes.tangent.try_normalize() else { return Some([own_right, own_up]) };
        let up = self.attributes.normal.cross(right);
        Some([right, if up.dot(own_up) < 0.0 { -up } else { up }])
    }
}

/// What materials are at a place.
pub(crate) struct Found {
    pub material: ShadingMaterial,
    /// Opacity.
    pub alpha: f32,
    pub slopes: Option<Slopes>,
    /// Of a clear coat.
    pub coat_slopes: Option<Slopes>,
}

/// How a normal texture turns normals.
#[derive(Clone, Copy)]
pub(crate) struct Slopes {
    /// Along the surface, to the right of the image and upwards.
    axes: [Vec3; 2],
    /// The normal as the texture has it.
    local: Vec3,
}

impl Slopes {
    /// The normal instead of a smooth one.
    pub fn turned(&self, smooth: Vec3) -> Vec3 {
        let along = |axis: Vec3| axis.reject_from_normalized(smooth).normalize_or_zero();
        let [right, up] = self.axes.map(along);
        (right * self.local.x + up * self.local.y + smooth * self.local.z).try_normalize().unwrap_or(smooth)
    }
}

/// What of a material differs from place to place.
#[derive(Clone, Copy)]
struct Varying {
    textures: MaterialTextures,
    alpha_mode: AlphaMode,
    normal_scale: f32,
    coat_normal_scale: f32,
    roughness: f32,
}

impl Varying {
    /// Opacity of a place that textures and colors say to be as opaque as `coverage`.
    fn alpha(&self, material: &ShadingMaterial, coverage: f32) -> f32 {
        match self.alpha_mode {
            AlphaMode::Uniform => material.alpha,
            AlphaMode::Blend => coverage,
            AlphaMode::Mask(cutoff) => f32::from(u8::from(coverage >= cutoff)),
        }
    }
}

/// The material of each geometry.
pub(crate) struct Materials {
    by_geometry: Vec<(ShadingMaterial, Varying)>,
    /// What solids absorb, by number of medium; nothing in the first.
    absorption: Vec<Vec3>,
    fallback: (ShadingMaterial, Varying),
    textures: Textures,
    are_see_through: bool,
}

/// Media that paths can tell, with none.
const MOST_MEDIA: usize = 256;

impl Materials {
    pub fn new(description: &SceneDesc) -> Materials {
        let ready = |material: &Material| {
            let &Material { textures, alpha_mode, normal_scale, roughness, .. } = material;
            let coat_normal_scale = material.clearcoat.normal_scale;
            let varying = Varying { textures, alpha_mode, normal_scale, coat_normal_scale, roughness };
            (ShadingMaterial::new(material), varying)
        };
        let fallback = ready(&Material::default());
        let mut absorption = vec![Vec3::ZERO];
        let mut by_material: Vec<_> = description.materials.iter().map(ready).collect();
        for (material, _) in &mut by_material {
            // More than can be numbered absorb what goes from end to end alone.
            if material.is_solid() && material.absorption != Vec3::ZERO && absorption.len() < MOST_MEDIA {
                material.medium = absorption.len() as u8;
                absorption.push(material.absorption);
            }
        }
        let of = |index: u32| description.materials.get(index as usize);
        let geometries = description.geometries.iter();
        // Of strands the tracer decides which rays they stop.
        let surfaces = description.geometries.iter().filter(|geometry| geometry.has_triangles);
        let mut surfaces = surfaces.filter_map(|geometry| of(geometry.material));
        Materials {
            by_geometry: geometries
                .map(|g| by_material.get(g.material as usize).copied().unwrap_or(fallback))
                .collect(),
            absorption,
            fallback,
            textures: Textures::new(description),
            are_see_through: surfaces.any(Material::is_see_through),
        }
    }

    /// True if rays may pass some surfaces.
    pub fn are_see_through(&self) -> bool {
        self.are_see_through
    }

    /// Share of light that a medium absorbs, for each unit of length at the beginning.
    pub fn absorption(&self, medium: u8) -> Vec3 {
        self.absorption.get(usize::from(medium)).copied().unwrap_or_default()
    }

    /// The material of a geometry; a matte light gray where the description has none.
    pub fn of(&self, geometry: u32) -> &ShadingMaterial {
        &self.get(geometry).0
    }

    /// Opacity of a geometry where nothing is known of places.
    pub fn alpha_of(&self, geometry: u32) -> f32 {
        let (material, varying) = self.get(geometry);
        varying.alpha(material, material.alpha)
    }

    fn get(&self, geometry: u32) -> &(ShadingMaterial, Varying) {
        self.by_geometry.get(geometry as usize).unwrap_or(&self.fallback)
    }

    /// What the material of a geometry is at a place.
    ///
    /// # Errors
    /// If a texture cannot be read.
    pub fn at(&self, geometry: u32, place: &Place) -> Result<Found, OpenError> {
        let (material, varying) = self.get(geometry);
        let (mut material, textures) = (*material, &varying.textures);
        let &MaterialTextures { base_color, metallic, roughness, glossiness, .. } = textures;
        let look = |texture: Option<u32>| self.look(texture, place);
        let color = look(base_color)? * place.attributes.color;
        let coverage = material.alpha * self.coverage(varying, place, color.w)?;
        let alpha = varying.alpha(&material, coverage);
        if material.unlit {
            // Its color is its emission.
            material.emission *= color.truncate();
            return Ok(Found { material, alpha, slopes: None, coat_slopes: None });
        }
        material.albedo *= color.truncate();
        let metal_and_rough = look(metallic)?;
        let rough = if roughness == metallic { metal_and_rough } else { look(roughness)? };
        material.metallic *= metal_and_rough.z;
        if roughness.or(glossiness).is_some() {
            let rough = varying.roughness * rough.y;
            let roughness = (1.0 - (1.0 - rough) * look(glossiness)?.w).clamp(0.0, 1.0);
            material.alpha_ggx = roughness * roughness;
        }
        material.emission *= look(textures.emission)?.truncate();
        material.transmission *= look(textures.transmission)?.x;
        material.specular *= look(textures.specular)?.w;
        material.specular_color *= look(textures.specular_color)?.truncate();
        if let Some(layers) = &mut material.layers {
            self.vary(layers, textures, place)?;
        }
        let slopes = self.slopes(textures.normal, varying.normal_scale, place)?;
        let coat_slopes = self.slopes(textures.clearcoat_normal, varying.coat_normal_scale, place)?;
        Ok(Found { material, alpha, slopes, coat_slopes })
    }

    /// Opacity of a place as textures and colors have it. `color` is what they say of it at the width that is looked at.
    fn coverage(&self, varying: &Varying, place: &Place, color: f32) -> Result<f32, OpenError> {
        let MaterialTextures { base_color, opacity, .. } = varying.textures;
        if place.width == 0.0 || !matches!(varying.alpha_mode, AlphaMode::Mask(_)) {
            return Ok(color * self.look(opacity, place)?.x);
        }
        // A mean would be above the cutoff, or below it, for all of a leaf that is far away: every ray looks closely.
        let closely = Place { width: 0.0, ..*place };
        let color = self.look(base_color, &closely)?.w * place.attributes.color.w;
        Ok(color * self.look(opacity, &closely)?.x)
    }

    /// Makes layers those of a place.
    fn vary(&self, layers: &mut Layers, textures: &MaterialTextures, place: &Place) -> Result<(), OpenError> {
        let look = |texture: Option<u32>| self.look(texture, place);
        layers.clearcoat *= look(textures.clearcoat)?.x;
        layers.clearcoat_roughness *= look(textures.clearcoat_roughness)?.y;
        layers.sheen *= look(textures.sheen_color)?.truncate();
        layers.sheen_roughness *= look(textures.sheen_roughness)?.w;
        layers.iridescence *= look(textures.iridescence)?.x;
        let [least, most] = layers.film_thickness;
        layers.film_thickness[1] = least + (most - least) * look(textures.iridescence_thickness)?.y;
        if layers.anisotropy > 0.0 {
            let found = match textures.anisotropy {
                Some(_) => look(textures.anisotropy)?.truncate(),
                None => Vec3::new(1.0, 0.5, 1.0),
            };
            layers.anisotropy *= found.z;
            let edges = match textures.anisotropy.or(textures.normal) {
                Some(texture) => self.image_edges(texture, place),
                None => edges(place.tex_coords.map(|corner| corner[0])),
            };
            if let Some(axes) = place.smooth_axes(edges) {
                layers.set_grain((found.truncate() * 2.0 - 1.0).normalize_or_zero(), axes);
            }
        }
        Ok(())
    }

    fn look(&self, texture: Option<u32>, place: &Place) -> Result<Vec4, OpenError> {
        let Some(texture) = texture else { return Ok(Vec4::ONE) };
        let uv = place.attributes.tex_coords[self.textures.tex_coord(texture)];
        let [a, b] = self.image_edges(texture, place);
        let extent = self.textures.extent(texture);
        let texels = (a * extent).perp_dot(b * extent).abs();
        let area = place.edges[0].cross(place.edges[1]).length();
        // Texels along a length of 1.
        let density = if area > 0.0 { (texels / area).sqrt() } else { 0.0 };
        let lookup = Lookup { place: self.textures.place(texture, uv), width: place.width * density };
        self.textures.sample(place.world, texture, &lookup)
    }

    /// The edges of the triangle in the image of a texture.
    fn image_edges(&self, texture: u32, place: &Place) -> [Vec2; 2] {
        let set = self.textures.tex_coord(texture);
        edges(place.tex_coords.map(|corner| self.textures.place(texture, corner[set])))
    }

    /// What a normal texture does; nothing where the triangle has no extent in the image.
    fn slopes(&self, texture: Option<u32>, scale: f32, place: &Place) -> Result<Option<Slopes>, OpenError> {
        let Some(texture) = texture else { return Ok(None) };
        let Some(axes) = place.smooth_axes(self.image_edges(texture, place)) else { return Ok(None) };
        let local = self.look(Some(texture), place)?.truncate() * 2.0 - 1.0;
        Ok(Some(Slopes { axes, local: local * Vec3::new(scale, scale, 1.0) }))
    }
}

/// From the first corner to the others.
fn edges([a, b, c]: [Vec2; 3]) -> [Vec2; 2] {
    [b - a, c - a]
}
