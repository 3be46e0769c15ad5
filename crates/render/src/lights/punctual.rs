//! Lights without a surface, after KHR_lights_punctual.
//!
//! One light is picked with a probability proportional to the light it would bring if nothing stood between:
//! the noise that is left is that of shadows alone. Looking at all lights for each point costs little beside
//! tracing a ray, as files hold few of them.

use crate::{
    color::luminance,
    offset::{SurfacePoint, shadow_ray},
};
use glam::{DVec3, Vec3};
use raystrips_geom::{
    Ray,
    scene::{Light, LightKind},
};

/// Every punctual light.
pub(crate) struct PunctualLights<'a> {
    lights: &'a [Light],
}

impl<'a> PunctualLights<'a> {
    pub fn new(lights: &'a [Light]) -> PunctualLights<'a> {
        PunctualLights { lights }
    }

    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// The segment that must be free for light to reach `from` on the side of `n`, and an estimate of the
    /// irradiance of all lights on a surface with normal `shading_n` if it is. `None` where no light reaches that side.
    pub fn sample(&self, from: &SurfacePoint, n: Vec3, shading_n: Vec3, u: f32) -> Option<(Ray, Vec3)> {
        let weight = |light: &Light| luminance(irradiance(light, from.p, shading_n));
        let total: f32 = self.lights.iter().map(weight).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut rest = u * total;
        // Rounding may leave a rest behind the last light: then the last that shines here is meant.
        let mut picked = None;
        for light in self.lights {
            let weight = weight(light);
            if weight > 0.0 {
                picked = Some((light, weight));
                rest -= weight;
            }
            if rest < 0.0 {
                break;
            }
        }
        let (light, weight) = picked?;
        let ray = ray_to(light, from, n);
        let reaches = n.dot(ray.dir) > 0.0;
        reaches.then(|| (ray, irradiance(light, from.p, shading_n) * (total / weight)))
    }
}

/// Irradiance of a surface at `p` with normal `n` without occlusion.
fn irradiance(light: &Light, p: Vec3, n: Vec3) -> Vec3 {
    let intensity = Vec3::from(light.intensity).max(Vec3::ZERO);
    match &light.kind {
        LightKind::Point { position } => intensity * point_geometry(*position, p, n).0,
        LightKind::Spot { position, direction, inner_angle, outer_angle } => {
            let (factor, wi) = point_geometry(*position, p, n);
            let cosine = -wi.dot(Vec3::from(*direction).normalize_or_zero());
            intensity * (factor * spot_falloff(cosine, *inner_angle, *outer_angle))
        }
        LightKind::Directional { direction } => {
            intensity * n.dot(-Vec3::from(*direction).normalize_or_zero()).max(0.0)
        }
    }
}

/// Cosine over squared distance, zero from behind, and the unit direction to the light.
fn point_geometry(position: [f64; 3], p: Vec3, n: Vec3) -> (f32, Vec3) {
    let to_light = DVec3::from(position) - p.as_dvec3();
    let distance = to_light.length();
    if distance == 0.0 {
        return (0.0, Vec3::ZERO);
    }
    let wi = to_light / distance;
    let factor = n.as_dvec3().dot(wi).max(0.0) / (distance * distance);
    (factor as f32, wi.as_vec3())
}

/// Share of the full intensity at the angle of the given cosine from the axis: the falloff that glTF recommends.
pub(crate) fn spot_falloff(cosine: f32, inner_angle: f32, outer_angle: f32) -> f32 {
    let (inner, outer) = (libm::cosf(inner_angle), libm::cosf(outer_angle));
    let linear = ((cosine - outer) / (inner - outer).max(1e-3)).clamp(0.0, 1.0);
    linear * linear
}

fn ray_to(light: &Light, from: &SurfacePoint, n: Vec3) -> Ray {
    match &light.kind {
        LightKind::Point { position } | LightKind::Spot { position, .. } => {
            shadow_ray(from.origin(n), DVec3::from(*position).as_vec3())
        }
        LightKind::Directional { direction } => from.spawn(n, -Vec3::from(*direction)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floor() -> SurfacePoint {
        SurfacePoint { p: Vec3::ZERO, ng: Vec3::Y, error: 1e-6 }
    }

    fn point(height: f64, intensity: f32) -> Light {
        let kind = LightKind::Point { position: [0.0, height, 0.0] };
        Light { name: String::new(), intensity: [intensity; 3], kind }
    }

    #[test]
    fn every_pick_estimates_the_same_sum() {
        let lights = [point(2.0, 8.0), point(-1.0, 100.0), point(1.0, 3.0), point(3.0, 9.0)];
        for u in [0.0, 0.3, 0.5, 0.9, 1.0 - f32::EPSILON / 2.0] {
            let (_, sum) = PunctualLights::new(&lights).sample(&floor(), Vec3::Y, Vec3::Y, u).unwrap();
            assert!((sum.x - 6.0).abs() < 1e-5, "{sum}");
        }
        let (_, below) =
            PunctualLights::new(&lights).sample(&floor(), Vec3::NEG_Y, Vec3::NEG_Y, 0.5).unwrap();
        assert_eq!(below.x, 100.0);
        assert!(PunctualLights::new(&lights[..1]).sample(&floor(), Vec3::NEG_Y, Vec3::NEG_Y, 0.5).is_none());
    }

    #[test]
    fn spots_fade_between_their_cones() {
        let falloff = |angle: f32| spot_falloff(angle.cos(), 0.2, 0.4);
        assert_eq!((falloff(0.1), falloff(0.5)), (1.0, 0.0));
        assert!(falloff(0.3) > 0.0 && falloff(0.3) < 1.0);
    }
}
