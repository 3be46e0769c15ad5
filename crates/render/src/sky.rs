//! Light from outside of the scene.
//!
//! A sky of a color or three is found by rays that leave the scene alone: diffuse surfaces sample directions by the cosine,
//! which for skies as smooth as these is as good as sampling the sky itself and saves its shadow rays. An environment may
//! have a sun in it, so it is sampled too.

use crate::environment::Environment;
use glam::Vec3;
use raystrips_geom::scene::{Light, LightKind, SceneDesc, Sky};

/// Sky of scenes that have no light at all: dark below, so that shapes show.
const DEFAULT_SKY: Sky =
    Sky::Gradient { zenith: [0.75, 0.88, 1.1], horizon: [0.5, 0.55, 0.6], ground: [0.08, 0.07, 0.06] };

/// Sun of scenes that have no light at all: from above, the left and the front.
fn default_sun() -> Light {
    let direction = Vec3::new(0.5, -0.8, -0.55).normalize().to_array();
    Light { name: String::new(), intensity: [1.7, 1.6, 1.45], kind: LightKind::Directional { direction } }
}

/// The lights without a surface and the sky to render with: the scene's own; or, where nothing at all shines
/// in the scene and `or_default`, a sun and a sky.
pub(crate) fn lighting(description: &SceneDesc, or_default: bool) -> (Vec<Light>, Sky) {
    if or_default && !description.has_light() {
        return (vec![default_sun()], DEFAULT_SKY);
    }
    (description.lights.clone(), description.sky.unwrap_or(Sky::Constant([0.0; 3])))
}

/// What is seen by rays that leave the scene.
#[derive(Clone, Copy)]
pub(crate) enum SkyLight<'a> {
    Smooth(Sky),
    Environment(&'a Environment),
}

impl SkyLight<'_> {
    /// Radiance that arrives along the unit vector `dir`, which points to the sky.
    pub fn radiance(&self, dir: Vec3) -> Vec3 {
        match self {
            SkyLight::Smooth(sky) => radiance(sky, dir),
            SkyLight::Environment(environment) => environment.radiance(dir),
        }
    }
}

/// Radiance that arrives along the unit vector `dir`, which points to the sky.
fn radiance(sky: &Sky, dir: Vec3) -> Vec3 {
    match *sky {
        Sky::Constant(radiance) => radiance.into(),
        Sky::Gradient { zenith, horizon, ground } => {
            let end = if dir.y > 0.0 { zenith } else { ground };
            Vec3::from(horizon).lerp(end.into(), dir.y.abs().min(1.0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_passes_through_its_three_colors() {
        let sky = Sky::Gradient { zenith: [1.0; 3], horizon: [2.0; 3], ground: [3.0; 3] };
        for (dir, expected) in [(Vec3::Y, 1.0), (Vec3::X, 2.0), (Vec3::NEG_Y, 3.0)] {
            assert_eq!(radiance(&sky, dir), Vec3::splat(expected));
        }
        let up = Vec3::new(0.0, 0.5, 0.75f32.sqrt());
        assert_eq!(radiance(&sky, up), Vec3::splat(1.5));
    }

    #[test]
    fn default_is_used_only_in_the_dark() {
        let mut scene = SceneDesc::default();
        assert_eq!(lighting(&scene, true), (vec![default_sun()], DEFAULT_SKY));
        assert_eq!(lighting(&scene, false), (vec![], Sky::Constant([0.0; 3])));
        scene.sky = Some(Sky::Constant([0.5; 3]));
        assert_eq!(lighting(&scene, true), (vec![], Sky::Constant([0.5; 3])));
    }
}
