//! Materials made ready for shading: one lookup by geometry, every number in its range.

use glam::Vec3;
use raystrips_geom::scene::{Material, SceneDesc};

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
    /// Nothing but diffuse reflection.
    pub is_matte: bool,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Width of the distribution of microfacets.
    pub alpha_ggx: f32,
    /// How much of what a dielectric's boundary reflects is reflected.
    pub specular: f32,
    /// Share of light below the boundary that is transmitted and not diffused.
    pub transmission: f32,
    /// Index of refraction, at least 1.
    pub ior: f32,
    /// Light that is transmitted goes straight on.
    thin: bool,
    /// Share of light that is absorbed, for each unit of length at the beginning.
    absorption: Vec3,
}

impl ShadingMaterial {
    pub fn new(material: &Material) -> ShadingMaterial {
        let share = |x: f32| if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.0 };
        let radiance = |c: f32| if c.is_finite() { c.max(0.0) } else { 0.0 };
        let ior = if material.ior.is_finite() { material.ior.max(1.0) } else { 1.0 };
        let [metallic, specular, transmission] =
            [material.metallic, material.specular, material.transmission].map(share);
        let roughness = share(material.roughness);
        ShadingMaterial {
            albedo: Vec3::from(material.base_color.map(|c| c.clamp(0.0, 1.0))),
            alpha: material.alpha.clamp(0.0, 1.0),
            emission: Vec3::from(material.emission.map(radiance)),
            double_sided: material.double_sided,
            is_matte: metallic == 0.0 && transmission == 0.0 && (specular == 0.0 || ior == 1.0),
            metallic,
            alpha_ggx: roughness * roughness,
            specular,
            transmission,
            ior,
            thin: material.thin,
            absorption: Vec3::from(material.absorption.map(radiance)),
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

    /// What is left of light after a way through the material (Beer and Lambert).
    pub fn transmittance(&self, distance: f32) -> Vec3 {
        (self.absorption * -distance).to_array().map(libm::expf).into()
    }

    /// Radiance emitted from the front, or from the back.
    pub fn emitted(&self, front: bool) -> Vec3 {
        if front || self.double_sided { self.emission } else { Vec3::ZERO }
    }
}

/// The material of each geometry.
pub(crate) struct Materials {
    by_geometry: Vec<ShadingMaterial>,
    fallback: ShadingMaterial,
}

impl Materials {
    pub fn new(description: &SceneDesc) -> Materials {
        let fallback = ShadingMaterial::new(&Material::default());
        let of =
            |index: u32| description.materials.get(index as usize).map_or(fallback, ShadingMaterial::new);
        Materials { by_geometry: description.geometries.iter().map(|g| of(g.material)).collect(), fallback }
    }

    /// The material of a geometry; a matte light gray where the description has none.
    pub fn of(&self, geometry: u32) -> &ShadingMaterial {
        self.by_geometry.get(geometry as usize).unwrap_or(&self.fallback)
    }
}
