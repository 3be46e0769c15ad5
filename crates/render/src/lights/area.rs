//! Emissive triangles: one is picked by its power, then a point on it uniformly by area.
//!
//! The density of a point is then its emission over the total, whichever triangle it lies on. So when a ray
//! finds a light by chance, its weight for multiple importance sampling needs no search for the triangle.

use crate::{
    color::luminance,
    material::{Materials, ShadingMaterial},
    offset::{SurfacePoint, shadow_ray},
    sampling::{cosine_hemisphere, uniform_triangle},
    world::Emitter,
};
use glam::Vec3;
use raystrips_geom::Ray;
use std::f32::consts::PI;

/// Every emissive triangle.
pub(crate) struct AreaLights<'a> {
    emitters: &'a [Emitter],
    materials: &'a Materials,
    /// Power (up to a factor) of the emitters up to and including each.
    cumulative_power: Vec<f64>,
}

/// A point of a light as seen from the point to be lit.
pub(crate) struct AreaSample {
    /// The segment that must be free.
    pub shadow_ray: Ray,
    /// Unit direction to the light.
    pub wi: Vec3,
    /// Radiance that arrives if it is.
    pub radiance: Vec3,
    /// Density over solid angle.
    pub pdf: f32,
}

impl<'a> AreaLights<'a> {
    pub fn new(emitters: &'a [Emitter], materials: &'a Materials) -> AreaLights<'a> {
        let power = |e: &Emitter| area(&e.corners) * f64::from(power_per_area(materials.of(e.geometry)));
        let finite = |power: f64| if power.is_finite() { power } else { 0.0 };
        let cumulative_power = emitters
            .iter()
            .scan(0.0, |sum, emitter| {
                *sum += finite(power(emitter));
                Some(*sum)
            })
            .collect();
        AreaLights { emitters, materials, cumulative_power }
    }

    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// Power of all emitters over π, in luminance.
    pub fn total_power(&self) -> f64 {
        self.cumulative_power.last().copied().unwrap_or(0.0)
    }

    /// Picks an emitter by its power. What `u` says beyond the choice comes back as a new number in [0, 1), so
    /// that well distributed samples stay so across the triangles of a lamp.
    fn pick(&self, u: f32) -> Option<(&Emitter, f32)> {
        let target = f64::from(u) * self.total_power();
        let index = self.cumulative_power.partition_point(|&sum| sum <= target);
        let emitter = self.emitters.get(index)?;
        let before = if index == 0 { 0.0 } else { self.cumulative_power[index - 1] };
        let rest = (target - before) / (self.cumulative_power[index] - before);
        Some((emitter, (rest as f32).min(1.0f32.next_down())))
    }

    /// A sample of the light that reaches `from` on the side of `n`. `None` where the point sampled sends no
    /// light there.
    pub fn sample(&self, from: &SurfacePoint, n: Vec3, u: [f32; 2]) -> Option<AreaSample> {
        let (emitter, u0) = self.pick(u[0])?;
        let material = self.materials.of(emitter.geometry);
        let [b1, b2] = uniform_triangle([u0, u[1]]);
        let light = SurfacePoint::on_triangle(&emitter.corners, b1, b2)?;

        let to_light = light.p - from.p;
        let distance = to_light.length();
        let wi = to_light / distance;
        let front = light.ng.dot(wi) < 0.0;
        let light_n = if front { light.ng } else { -light.ng };
        let radiance = material.emitted(front);
        let pdf = self.pdf(material, distance, light_n.dot(wi));
        let is_lit = n.dot(wi) > 0.0 && radiance != Vec3::ZERO && pdf.is_finite();
        is_lit.then(|| AreaSample {
            shadow_ray: shadow_ray(from.origin(n), light.origin(light_n)),
            wi,
            radiance,
            pdf,
        })
    }

    /// A ray that leaves an even point of a light in a direction by its cosine, and the power of all lights if they were as
    /// this one.
    pub fn emit(&self, place: [f32; 2], side: f32, direction: [f32; 2]) -> Option<(Ray, Vec3)> {
        let (emitter, u0) = self.pick(place[0])?;
        let material = self.materials.of(emitter.geometry);
        let [b1, b2] = uniform_triangle([u0, place[1]]);
        let light = SurfacePoint::on_triangle(&emitter.corners, b1, b2)?;
        let n = if material.double_sided && side >= 0.5 { -light.ng } else { light.ng };
        let (dir, cosine) = cosine_hemisphere(n, direction);
        let power =
            material.emission * ((f64::from(PI) * self.total_power()) as f32 / luminance(material.emission));
        (cosine > 0.0 && power.is_finite()).then(|| (light.spawn(n, dir), power))
    }

    /// Density over solid angle with which [`AreaLights::sample`] finds a point of a light with this material
    /// at `distance`, where the cosine between the light's normal and the direction is `light_cosine`, of any
    /// sign.
    pub fn pdf(&self, material: &ShadingMaterial, distance: f32, light_cosine: f32) -> f32 {
        if self.total_power() == 0.0 {
            return 0.0;
        }
        let pdf_area = f64::from(power_per_area(material)) / self.total_power();
        let distance = f64::from(distance);
        (pdf_area * distance * distance / f64::from(light_cosine.abs())) as f32
    }
}

/// Luminous exitance up to a factor.
fn power_per_area(material: &ShadingMaterial) -> f32 {
    let sides = if material.double_sided { 2.0 } else { 1.0 };
    luminance(material.emission) * sides
}

fn area(corners: &[Vec3; 3]) -> f64 {
    let [p0, p1, p2] = corners.map(|corner| corner.as_dvec3());
    0.5 * (p1 - p0).cross(p2 - p0).length()
}
