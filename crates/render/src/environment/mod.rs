//! Light from outside of the scene as a picture of all directions, such as a photographed sky.
//!
//! Rays see the picture by bilinear interpolation. Its light is also found by sampling: a [`table`] of cells, each of one
//! density over solid angle, which is the mean brightness of what rays see there. So wherever rays see light, samples may
//! fall too; both the samples and the rays that find a direction by chance use the density of the same table, and whatever
//! it is, the two together are unbiased (multiple importance sampling). The table can therefore be coarser than the
//! picture.

mod file;
mod table;

pub use file::{EnvironmentError, EnvironmentFile, MAX_ENVIRONMENT_PIXELS};

use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, TAU};
use std::fmt;
use table::Table;

/// Values above are none that light has, and sums of squares of them would not be finite.
const BRIGHTEST: f32 = 1e18;

/// A picture of all directions, by their angle around and from +y: its rows are from straight up to straight down, and its
/// middle is in the direction of -z, with +x to the right of it.
#[derive(Clone)]
pub struct Environment {
    width: usize,
    height: usize,
    /// Row by row from the left.
    texels: Vec<[f32; 3]>,
    table: Table,
    /// Turns by which the picture is turned about +y.
    turns: f32,
    strength: f32,
    repaired: u64,
    /// Tells pictures apart.
    fingerprint: u64,
}

/// A direction that light comes from.
pub(crate) struct EnvironmentSample {
    /// Unit vector.
    pub wi: Vec3,
    /// Density over solid angle.
    pub pdf: f32,
}

impl Environment {
    /// Of linear RGB values row by row. Values that are negative, not finite or beyond all light become 0.
    ///
    /// # Panics
    /// Where there are not `width` times `height` texels, or none.
    pub fn new(width: usize, height: usize, mut texels: Vec<[f32; 3]>) -> Environment {
        assert!(width > 0 && texels.len() == width * height, "a picture has a value for each pixel");
        let mut repaired = 0;
        let mut fingerprint = (width as u64) << 32 | height as u64;
        for value in texels.as_flattened_mut() {
            if !(0.0..=BRIGHTEST).contains(value) {
                *value = 0.0;
                repaired += 1;
            }
            // FNV, with a turn so that high bits matter.
            let mixed = (fingerprint ^ u64::from(value.to_bits())).wrapping_mul(0x100_0000_01b3);
            fingerprint = mixed.rotate_left(29);
        }
        let table = Table::new(width, height, &texels);
        Environment { width, height, texels, table, turns: 0.0, strength: 1.0, repaired, fingerprint }
    }

    /// Turned by so many degrees about +y, counter-clockwise as seen from above.
    pub fn turned(mut self, degrees: f32) -> Environment {
        self.turns = (degrees / 360.0).rem_euclid(1.0);
        self
    }

    /// So many times as bright.
    pub fn scaled(mut self, strength: f32) -> Environment {
        self.strength = strength;
        self
    }

    /// Values that were not those of light and were taken as 0.
    pub fn repaired(&self) -> u64 {
        self.repaired
    }

    /// Bytes that an environment of this size takes.
    pub fn bytes_of(width: usize, height: usize) -> u64 {
        (width as u64 * height as u64) * size_of::<[f32; 3]>() as u64 + Table::bytes_of(width, height)
    }

    /// Radiance that arrives along `dir`, which points to the sky.
    pub(crate) fn radiance(&self, dir: Vec3) -> Vec3 {
        self.radiance_at(self.place(dir))
    }

    fn radiance_at(&self, [u, v]: [f32; 2]) -> Vec3 {
        let x = u * self.width as f32 - 0.5;
        let y = (v * self.height as f32 - 0.5).clamp(0.0, (self.height - 1) as f32);
        let (left, top) = (x.floor(), y.floor());
        let column = |x: f32| (x as i64).rem_euclid(self.width as i64) as usize;
        let columns = [column(left), column(left + 1.0)];
        let rows = [top as usize, (top as usize + 1).min(self.height - 1)];
        let row = |y: usize| {
            let [a, b] = columns.map(|x| Vec3::from(self.texels[y * self.width + x]));
            a + (b - a) * (x - left)
        };
        let [above, below] = rows.map(row);
        (above + (below - above) * (y - top)) * self.strength
    }

    /// A direction for the random numbers `u`, more often where there is more light. `None` where there is none at all.
    pub(crate) fn sample(&self, u: [f32; 2]) -> Option<EnvironmentSample> {
        let found = self.table.sample(u)?;
        let (sin, cos) = libm::sincosf(TAU * (found.u - 0.5 - self.turns));
        let wi = Vec3::new(found.sine * sin, found.cosine, -found.sine * cos);
        Some(EnvironmentSample { wi, pdf: found.pdf })
    }

    /// Radiance that arrives along `dir`, and the density over solid angle with which [`Environment::sample`] finds it.
    pub(crate) fn radiance_and_pdf(&self, dir: Vec3) -> (Vec3, f32) {
        let place = self.place(dir);
        (self.radiance_at(place), self.table.pdf(place))
    }

    /// Luminance that comes from all directions, as an integral over solid angle.
    pub(crate) fn total_luminance(&self) -> f64 {
        self.table.total() * f64::from(self.strength)
    }

    /// Where a direction is in the picture, 0 to 1 from the left and from above.
    fn place(&self, dir: Vec3) -> [f32; 2] {
        let around = libm::atan2f(dir.x, -dir.z) / TAU + 0.5 + self.turns;
        let from_above = libm::atan2f((dir.x * dir.x + dir.z * dir.z).sqrt(), dir.y) * FRAC_1_PI;
        [around - around.floor(), from_above]
    }
}

impl PartialEq for Environment {
    fn eq(&self, other: &Environment) -> bool {
        let of = |e: &Environment| (e.width, e.height, e.fingerprint, e.turns, e.strength);
        of(self) == of(other)
    }
}

impl fmt::Debug for Environment {
    /// What tells it from others, and no pixels.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Environment")
            .field("width", &self.width)
            .field("height", &self.height)
            .field("fingerprint", &self.fingerprint)
            .field("turns", &self.turns)
            .field("strength", &self.strength)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::PathSampler;
    use std::f64::consts::PI;

    /// A sky with a small sun, of a size that cells do not divide.
    fn sky() -> Environment {
        let (width, height) = (61, 30);
        let texel = |i: usize| {
            let (x, y) = (i % width, i / width);
            let sun = if (40..42).contains(&x) && y == 7 { 4e3 } else { 0.0 };
            let ground = if y > 15 { 0.0 } else { 1.0 / (y + 1) as f32 };
            [sun + ground, sun + 0.5 * ground, sun + 2.0 * ground]
        };
        Environment::new(width, height, (0..width * height).map(texel).collect())
    }

    fn directions(count: u32) -> impl Iterator<Item = Vec3> {
        (0..count).map(|i| {
            let [u, v] = PathSampler::new([9, 9], i, 0).get_2d(0);
            let y = 1.0 - 2.0 * v;
            let (sin, cos) = libm::sincosf(TAU * u);
            Vec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin)
        })
    }

    #[test]
    fn picture_is_where_it_is_said_to_be() {
        // Four columns: +z, -x, -z, +x are between them or in their middle.
        let mut texels = vec![[0.0; 3]; 8 * 4];
        texels[8 + 4] = [1.0, 0.0, 0.0];
        texels[8 + 5] = [0.0, 1.0, 0.0];
        let map = Environment::new(8, 4, texels);
        let seen = |map: &Environment, degrees: f32, up: f32| {
            let (sin, cos) = libm::sincosf(degrees.to_radians());
            map.radiance(Vec3::new(sin, up, -cos))
        };
        let up = libm::tanf(22.5f32.to_radians());
        // The middle of a texel is half of 45 degrees to the right of -z.
        assert!(seen(&map, 22.5, up).abs_diff_eq(Vec3::X, 1e-5));
        assert!(seen(&map, 67.5, up).abs_diff_eq(Vec3::Y, 1e-5));
        assert!(seen(&map, 45.0, up).abs_diff_eq(Vec3::new(0.5, 0.5, 0.0), 1e-5));
        assert_eq!(seen(&map, -90.0, up), Vec3::ZERO);
        assert_eq!(seen(&map, 22.5, -1.0), Vec3::ZERO);
        // From -z to -x is counter-clockwise as seen from above.
        let turned = map.turned(90.0).scaled(3.0);
        assert!(seen(&turned, 22.5 - 90.0, up).abs_diff_eq(Vec3::X * 3.0, 1e-4));
    }

    #[test]
    fn samples_have_the_density_that_is_told() {
        for map in [sky(), sky().turned(123.4), Environment::new(3000, 3, vec![[1.0; 3]; 9000])] {
            let mut off = 0;
            for i in 0..4096 {
                let sample = map.sample(PathSampler::new([1, 2], i, 3).get_2d(5)).unwrap();
                assert!((sample.wi.length() - 1.0).abs() < 1e-6);
                // At the border of a cell rounding decides.
                off += i32::from((map.radiance_and_pdf(sample.wi).1 / sample.pdf - 1.0).abs() > 1e-6);
            }
            assert!(off < 40, "{off}");
        }
    }

    #[test]
    fn density_integrates_to_one_and_samples_to_the_light() {
        let map = sky().scaled(0.5);
        let count = 1 << 18;
        let mut integral = 0.0;
        for dir in directions(count) {
            integral += 4.0 * PI / f64::from(count) * f64::from(map.radiance_and_pdf(dir).1);
        }
        assert!((integral - 1.0).abs() < 0.01, "{integral}");
        // The same light by even directions and by the table.
        let even: Vec3 = directions(count).map(|dir| map.radiance(dir)).sum::<Vec3>() / count as f32;
        let sampled: Vec3 = (0..4096)
            .map(|i| map.sample(PathSampler::new([0, 0], i, 0).get_2d(0)).unwrap())
            .map(|sample| map.radiance(sample.wi) / sample.pdf)
            .sum::<Vec3>()
            / 4096.0;
        let even = even * (4.0 * PI) as f32;
        assert!((sampled / even - 1.0).abs().max_element() < 0.01, "{sampled} instead of {even}");
        let total = map.total_luminance() as f32 / crate::color::luminance(even);
        assert!((total - 1.0).abs() < 0.02, "{total}");
    }

    #[test]
    fn what_is_no_light_is_dark_and_counted() {
        let texels = vec![[f32::NAN, -1.0, 2.0], [f32::INFINITY, 0.0, 1e30]];
        let map = Environment::new(2, 1, texels);
        assert_eq!(map.repaired(), 4);
        assert!(map.radiance(Vec3::NEG_X).abs_diff_eq(Vec3::Z * 2.0, 1e-6));
        let dark = Environment::new(2, 2, vec![[0.0; 3]; 4]);
        assert!(dark.sample([0.5; 2]).is_none());
        assert_eq!((dark.radiance_and_pdf(Vec3::X).1, dark.total_luminance()), (0.0, 0.0));
    }

    #[test]
    fn debug_tells_pictures_apart() {
        let text = |map: &Environment| format!("{map:?}");
        let (a, b) = (sky(), sky().turned(10.0));
        assert_eq!(text(&a), text(&sky()));
        assert!(a == sky() && a != b && text(&a) != text(&b));
        let mut texels = a.texels.clone();
        texels[77][1] += 1.0;
        assert!(text(&Environment::new(61, 30, texels)) != text(&a));
    }
}
