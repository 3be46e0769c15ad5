//! Materials made ready for shading: one lookup by geometry, every number in its range.
//!
//! All surfaces reflect diffusely (Lambert) by their base color: metals and glass too. This is the one
//! place that decides so; glossy and transmissive lobes are to come here.

use glam::Vec3;
use raystrips_geom::scene::{Material, SceneDesc};

/// What shading asks of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShadingMaterial {
    /// Share of light reflected, each channel 0 to 1.
    pub albedo: Vec3,
    /// Opacity, 0 to 1.
    pub alpha: f32,
    /// Radiance that leaves an emitting side.
    pub emission: Vec3,
    /// Emits from the back too.
    pub double_sided: bool,
}

impl ShadingMaterial {
    fn new(material: &Material) -> ShadingMaterial {
        let radiance = |c: f32| if c.is_finite() { c.max(0.0) } else { 0.0 };
        ShadingMaterial {
            albedo: Vec3::from(material.base_color.map(|c| c.clamp(0.0, 1.0))),
            alpha: material.alpha.clamp(0.0, 1.0),
            emission: Vec3::from(material.emission.map(radiance)),
            double_sided: material.double_sided,
        }
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
