//! Light from outside of the scene.
//!
//! The sky is found by rays that leave the scene alone: diffuse surfaces sample directions by the cosine, which
//! for skies as smooth as these is as good as sampling the sky itself and saves its shadow rays.

use glam::Vec3;
use raystrips_geom::scene::{SceneDesc, Sky};

/// Soft light from above for scenes that have no light at all.
pub(crate) const DEFAULT_SKY: Sky =
    Sky::Gradient { zenith: [0.65, 0.8, 1.05], horizon: [1.0, 1.0, 1.0], ground: [0.25, 0.22, 0.2] };

/// The sky to render with: the scene's, or `default` where the scene has no light, or a black one.
pub(crate) fn effective_sky(description: &SceneDesc, default: Option<Sky>) -> Sky {
    let default = default.filter(|_| !description.has_light());
    description.sky.or(default).unwrap_or(Sky::Constant([0.0; 3]))
}

/// Radiance that arrives along the unit vector `dir`, which points to the sky.
pub(crate) fn radiance(sky: &Sky, dir: Vec3) -> Vec3 {
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
        assert_eq!(effective_sky(&scene, Some(DEFAULT_SKY)), DEFAULT_SKY);
        assert_eq!(effective_sky(&scene, None), Sky::Constant([0.0; 3]));
        scene.sky = Some(Sky::Constant([0.5; 3]));
        assert_eq!(effective_sky(&scene, Some(DEFAULT_SKY)), Sky::Constant([0.5; 3]));
    }
}
