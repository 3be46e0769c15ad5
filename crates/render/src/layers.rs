//! What lies over a surface or changes its boundary, made ready for shading: every number in its range.

use glam::{Vec2, Vec3};
use raystrips_geom::scene::Material;

/// Layers of a material that has any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layers {
    /// How much clear coat there is, 0 to 1.
    pub clearcoat: f32,
    /// Perceptual roughness of the clear coat.
    pub clearcoat_roughness: f32,
    /// Normal of the clear coat; zero where it is that of the surface.
    pub clearcoat_normal: Vec3,
    /// Color of the sheen, each channel 0 to 1.
    pub sheen: Vec3,
    /// Perceptual roughness of the sheen.
    pub sheen_roughness: f32,
    /// How much rougher facets are along the grain, 0 to 1.
    pub anisotropy: f32,
    /// From the axis to the right of texture coordinates to the grain: cosine and sine.
    pub rotation: Vec2,
    /// The direction on the surface in which facets are rougher; zero where nobody knows.
    pub grain: Vec3,
    /// How much of a thin film there is on the boundary, 0 to 1.
    pub iridescence: f32,
    /// Index of refraction of the film, at least 1.
    pub film_ior: f32,
    /// Thickness of the film in nanometers: where its texture is 0, and where it is 1 or not there.
    pub film_thickness: [f32; 2],
}

impl Layers {
    /// Of a material; `None` if it has none.
    pub fn new(material: &Material) -> Option<Layers> {
        let share = |x: f32| if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.0 };
        // Beyond that colors have long gone over into each other, and phases into what floats cannot tell.
        let thickness = |x: f32| if x.is_finite() { x.clamp(0.0, 1e5) } else { 0.0 };
        let Material { clearcoat, sheen, anisotropy, iridescence, .. } = material;
        let rotation = if anisotropy.rotation.is_finite() { anisotropy.rotation } else { 0.0 };
        let (sin, cos) = libm::sincosf(rotation);
        let layers = Layers {
            clearcoat: share(clearcoat.strength),
            clearcoat_roughness: share(clearcoat.roughness),
            clearcoat_normal: Vec3::ZERO,
            sheen: Vec3::from(sheen.color.map(share)),
            sheen_roughness: share(sheen.roughness),
            anisotropy: share(anisotropy.strength),
            rotation: Vec2::new(cos, sin),
            grain: Vec3::ZERO,
            iridescence: share(iridescence.strength),
            film_ior: if iridescence.ior.is_finite() { iridescence.ior.clamp(1.0, 10.0) } else { 1.0 },
            film_thickness: [iridescence.least_thickness, iridescence.thickness].map(thickness),
        };
        let is_there = layers.clearcoat > 0.0
            || layers.sheen != Vec3::ZERO
            || layers.anisotropy > 0.0
            || layers.iridescence > 0.0;
        is_there.then_some(layers)
    }

    /// They reflect by themselves, whatever is below.
    pub fn reflect(&self) -> bool {
        self.clearcoat > 0.0 || self.sheen != Vec3::ZERO
    }

    /// Sets the grain to `direction`, turned as the material says. Axes are those along which texture coordinates go to the
    /// right and upwards.
    pub fn set_grain(&mut self, direction: Vec2, axes: [Vec3; 2]) {
        let Vec2 { x, y } = self.rotation.rotate(direction);
        self.grain = axes[0].normalize_or_zero() * x + axes[1].normalize_or_zero() * y;
    }
}
