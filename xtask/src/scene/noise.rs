//! Gradient noise (Perlin 2002): smooth, without direction, about as large as its lattice.

use super::random::scramble;
use glam::DVec3;

/// Middles of the edges of a cube, four of them twice so that there are sixteen.
const GRADIENTS: [[f64; 3]; 16] = [
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [-1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [-1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [-1.0, 0.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, -1.0, 1.0],
    [0.0, 1.0, -1.0],
    [0.0, -1.0, -1.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [0.0, -1.0, 1.0],
    [0.0, -1.0, -1.0],
];

/// Odd numbers without a pattern, one for each axis.
const PRIMES: [u64; 3] = [0x9E37_79B1_85EB_CA87, 0xC2B2_AE3D_27D4_EB4F, 0x1656_67B1_9E37_79F9];

/// A field of noise.
#[derive(Clone, Copy, Debug)]
pub struct Noise(u64);

impl Noise {
    /// Any field, where none is needed.
    pub const NONE: Noise = Noise(0);

    /// The field of that number.
    pub fn new(seed: u64) -> Noise {
        Noise(scramble(seed))
    }

    /// The value at a point: -1 to 1, 0 at the lattice, seldom beyond ±0.7.
    pub fn at(&self, p: DVec3) -> f64 {
        let cell = p.floor();
        let low = p - cell;
        let high = low - DVec3::ONE;
        let fade = low * low * low * (low * (low * 6.0 - 15.0) + 10.0);
        let hashes = |axis: usize| {
            let begin = (cell[axis] as i64 as u64).wrapping_mul(PRIMES[axis]);
            [begin, begin.wrapping_add(PRIMES[axis])]
        };
        let [[x0, x1], [y0, y1], [z0, z1]] = [0, 1, 2].map(hashes);
        let along_x = |y: u64, z: u64, dy: f64, dz: f64| {
            let row = self.0 ^ y ^ z.rotate_left(17);
            mix(gradient(row ^ x0, [low.x, dy, dz]), gradient(row ^ x1, [high.x, dy, dz]), fade.x)
        };
        let below = mix(along_x(y0, z0, low.y, low.z), along_x(y1, z0, high.y, low.z), fade.y);
        let above = mix(along_x(y0, z1, low.y, high.z), along_x(y1, z1, high.y, high.z), fade.y);
        mix(below, above, fade.z)
    }
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}

/// How far `offset` goes along the gradient that belongs to a hash.
fn gradient(hash: u64, [x, y, z]: [f64; 3]) -> f64 {
    let hash = (hash ^ hash >> 31).wrapping_mul(PRIMES[0]);
    let [a, b, c] = GRADIENTS[(hash >> 60) as usize];
    a * x + b * y + c * z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_and_centered() {
        let noise = Noise::new(3);
        let point = |i: u32| DVec3::new(0.137, -0.071, 0.0913) * f64::from(i) - DVec3::splat(40.0);
        let values: Vec<f64> = (0..20_000).map(|i| noise.at(point(i))).collect();
        let mean = values.iter().sum::<f64>() / 2e4;
        let square = values.iter().map(|x| x * x).sum::<f64>() / 2e4;
        assert!(mean.abs() < 0.02 && (0.04..0.12).contains(&square), "{mean} {square}");
        assert!(values.iter().all(|x| x.abs() <= 1.0));
        let jump = (0..5000).map(|i| (noise.at(point(i)) - noise.at(point(i) + DVec3::splat(1e-6))).abs());
        assert!(jump.fold(0.0, f64::max) < 1e-5);
        assert_eq!(noise.at(DVec3::new(-3.0, 2.0, 7.0)), 0.0);
    }

    #[test]
    fn seeds_differ() {
        let p = DVec3::new(0.3, 0.4, 0.45);
        assert_ne!(Noise::new(1).at(p), Noise::new(2).at(p));
    }
}
