//! Textures of the scenes, made of formulas. All are magnified in the pictures: Mitsuba has no coarser levels of textures.

use super::picture::png_bytes;
use crate::output::write_whole;
use anyhow::Result;
use glam::DVec3;
use std::f64::consts::TAU;
use std::path::Path;

/// Texels along a side.
const EXTENT: u32 = 64;

/// A square image of which each texel is told by its place: 0 to 1, to the right and up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Texture {
    /// Two colors by turns, four squares along each side.
    Checker,
    /// Wavy bands of several colors.
    Bands,
    /// Green with paler veins.
    Leaf,
    /// White where a leaf is, with soft borders.
    LeafShape,
    /// Normals of a surface with waves both ways.
    Waves,
}

impl Texture {
    /// Name of the file.
    pub fn file(self) -> &'static str {
        match self {
            Texture::Checker => "checker.png",
            Texture::Bands => "bands.png",
            Texture::Leaf => "leaf.png",
            Texture::LeafShape => "leaf_shape.png",
            Texture::Waves => "waves.png",
        }
    }

    fn texel(self, u: f64, v: f64) -> DVec3 {
        match self {
            Texture::Checker => {
                let is_odd = ((u * 4.0) as u32 + (v * 4.0) as u32) % 2 == 1;
                if is_odd { DVec3::new(0.85, 0.8, 0.7) } else { DVec3::new(0.35, 0.3, 0.4) }
            }
            Texture::Bands => {
                let height = v * 5.0 + 0.3 * libm::sin(TAU * 3.0 * u);
                let [r, g, b] = [0.0, 0.33, 0.67].map(|shift| 0.55 + 0.3 * libm::sin(TAU * (height + shift)));
                DVec3::new(r, g, b)
            }
            Texture::Leaf => {
                let vein = (libm::fabs(u - 0.5) * 4.0 + v * 8.0).fract() < 0.15 || libm::fabs(u - 0.5) < 0.03;
                if vein { DVec3::new(0.75, 0.85, 0.5) } else { DVec3::new(0.3, 0.65, 0.25) }
            }
            Texture::LeafShape => {
                let half_width = 0.4 * libm::sin(TAU / 2.0 * v) * (1.2 - 0.4 * v);
                DVec3::splat(((half_width - libm::fabs(u - 0.5)) * 20.0 + 0.5).clamp(0.0, 1.0))
            }
            Texture::Waves => {
                let slope = |x: f64| 0.35 * libm::cos(TAU * 3.0 * x);
                let normal = DVec3::new(slope(u), slope(v), 1.0).normalize();
                normal * 0.5 + 0.5
            }
        }
    }

    /// Writes the PNG.
    pub fn write(self, folder: &Path) -> Result<()> {
        let place = |texel: u32| (f64::from(texel) + 0.5) / f64::from(EXTENT);
        let texels = (0..EXTENT).flat_map(|y| (0..EXTENT).map(move |x| (place(x), 1.0 - place(y))));
        let bytes = texels.flat_map(|(u, v)| self.texel(u, v).to_array().map(|x| (x * 255.0).round() as u8));
        let png = png_bytes([EXTENT, EXTENT], &bytes.collect::<Vec<u8>>())?;
        write_whole(&folder.join(self.file()), &png)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_have_an_inside_and_an_outside() {
        let shape = |u, v| Texture::LeafShape.texel(u, v).x;
        assert_eq!([shape(0.5, 0.5), shape(0.02, 0.5), shape(0.5, 0.0)], [1.0, 0.0, 0.5]);
    }

    #[test]
    fn normals_are_unit_vectors() {
        for i in 0..64 {
            let normal = Texture::Waves.texel(f64::from(i) / 64.0, 0.3) * 2.0 - 1.0;
            assert!((normal.length() - 1.0).abs() < 1e-9 && normal.z > 0.8);
        }
    }
}
