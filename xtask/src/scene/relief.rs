//! What surfaces are displaced by: roughness at every scale down to that of the triangles, and joints of masonry.

use super::noise::Noise;
use glam::{DMat3, DVec3};

/// Shortest waves, in edges of triangles; shorter ones would be missed by the triangles.
const SHORTEST: f64 = 3.0;
/// Most octaves.
const MAX_OCTAVES: u32 = 12;
/// Each octave is turned by this, so that their lattices do not line up.
const TURN: DMat3 = DMat3::from_cols_array(&[0.36, -0.8, 0.48, 0.48, 0.6, 0.64, -0.8, 0.0, 0.6]);

/// A height above a surface, for every point of space.
#[derive(Clone, Copy, Debug)]
pub struct Relief {
    noise: Noise,
    /// Length of the longest waves.
    wavelength: f64,
    /// Height of the longest waves.
    amplitude: f64,
    /// Height of an octave, in heights of the one before with waves of twice the length.
    gain: f64,
    /// How much longer waves are along the strokes of a tool than across.
    stroke: f64,
    joints: Option<Joints>,
}

/// Grooves between blocks in courses, the upper ones half a block further. They are seen on upright surfaces along
/// the x or the z axis.
#[derive(Clone, Copy, Debug)]
pub struct Joints {
    /// Length and height of a block.
    pub block: [f64; 2],
    /// Width of the groove; half as deep.
    pub width: f64,
}

impl Relief {
    /// None at all.
    pub const NONE: Relief =
        Relief { noise: Noise::NONE, wavelength: 0.0, amplitude: 0.0, gain: 0.0, stroke: 1.0, joints: None };

    /// Weathered stone.
    pub fn stone(seed: u64, wavelength: f64, amplitude: f64) -> Relief {
        Relief { noise: Noise::new(seed), wavelength, amplitude, gain: 0.55, stroke: 1.0, joints: None }
    }

    /// Stone with the strokes of a chisel.
    pub fn chiseled(seed: u64, wavelength: f64, amplitude: f64) -> Relief {
        Relief { stroke: 3.0, ..Relief::stone(seed, wavelength, amplitude) }
    }

    /// The same with joints.
    pub fn with_joints(self, joints: Joints) -> Relief {
        Relief { joints: Some(joints), ..self }
    }

    /// The height at a point of a surface whose triangles have edges of the length `edge`.
    pub fn height(&self, position: DVec3, edge: f64) -> f64 {
        self.roughness(position, edge) - self.joints.map_or(0.0, |joints| joints.depth(position, edge))
    }

    fn roughness(&self, position: DVec3, edge: f64) -> f64 {
        let mut height = 0.0;
        let [mut wavelength, mut amplitude] = [self.wavelength, self.amplitude];
        let mut place = position;
        let stroke = DVec3::new(1.0, 1.0 / self.stroke, 1.0);
        for _ in 0..MAX_OCTAVES {
            if wavelength < SHORTEST * edge {
                break;
            }
            height += amplitude * self.noise.at(place * stroke / wavelength);
            wavelength *= 0.5;
            amplitude *= self.gain;
            place = TURN * place + DVec3::splat(0.731 * self.wavelength);
        }
        height
    }
}

impl Joints {
    fn depth(&self, position: DVec3, edge: f64) -> f64 {
        let [length, height] = self.block;
        // Joints that are narrower than triangles would be seen here and there only.
        let width = self.width.max(edge * 1.5);
        let course = (position.y / height).floor();
        // On a wall across x or z, one of the two is constant.
        let along = (position.x + position.z) / length + 0.5 * (course - 2.0 * (course * 0.5).floor());
        let distance = ((along - along.round()).abs() * length)
            .min((position.y - (position.y / height).round() * height).abs());
        let inside = (1.0 - distance / width).max(0.0);
        self.width * 0.5 * inside * inside * (3.0 - 2.0 * inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finer_triangles_get_finer_waves() {
        let relief = Relief::stone(1, 1.0, 0.1);
        let p = DVec3::new(0.3, 0.2, 0.6);
        let heights = [1.0, 0.3, 0.1, 0.01].map(|edge| relief.height(p, edge));
        assert_eq!(heights[0], 0.0);
        assert!(heights.windows(2).all(|pair| pair[0] != pair[1] && (pair[0] - pair[1]).abs() < 0.1));
    }

    #[test]
    fn joints_run_between_blocks() {
        let joints = Joints { block: [1.0, 0.5], width: 0.02 };
        let relief = Relief::NONE.with_joints(joints);
        assert_eq!(relief.height(DVec3::new(0.3, 0.25, 0.0), 0.001), 0.0);
        assert_eq!(relief.height(DVec3::new(0.3, 1.0, 0.0), 0.001), -0.01);
        assert_eq!(relief.height(DVec3::new(2.0, 0.25, 1.0), 0.001), -0.01);
        assert_eq!(relief.height(DVec3::new(2.5, 0.75, 1.0), 0.001), -0.01);
    }

    #[test]
    fn turns_keep_lengths() {
        assert!((TURN * TURN.transpose() - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-12));
    }
}
