//! A stateless sampler: (pixel, sample, dimension, seed) -> value, so that the order of rays changes nothing.
//!
//! Every pair of dimensions holds the first two Sobol dimensions, a (0,2)-sequence: any aligned power of two of
//! samples is stratified over all elementary intervals at once. Pairs are decorrelated from each other, and
//! pixels too, by shuffling the sample index and scrambling the digits with hash-based Owen scrambling:
//! Burley, "Practical Hash-based Owen Scrambling" (JCGT 2020), with the constants improved by Vegdahl (2021).
//! Burley pads sets of four dimensions; sets of two keep every pair a perfect net, which is what shading uses.
//!
//! Two shortcuts: both Sobol generator matrices are applied without tables, and the digits are kept in reverse
//! (least significant first) until the end, since scrambling wants them so.

/// The value of one dimension, in [0, 1).
///
/// Dimensions `2 k` and `2 k + 1` are well distributed as a pair; other pairs are independent of each other.
pub fn sample(pixel: [u32; 2], sample_index: u32, dimension: u32, seed: u64) -> f32 {
    PathSampler::new(pixel, sample_index, seed).get_2d(dimension / 2)[(dimension % 2) as usize]
}

/// The random numbers of one camera path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathSampler {
    /// Hash of pixel and seed.
    key: u64,
    sample_index: u32,
}

impl PathSampler {
    pub fn new(pixel: [u32; 2], sample_index: u32, seed: u64) -> PathSampler {
        let pixel = u64::from(pixel[1]) << 32 | u64::from(pixel[0]);
        PathSampler { key: mix(mix(seed) ^ pixel), sample_index }
    }

    /// Branch number `branch` of so many into which the path divides: they are as well distributed as so many times the
    /// samples.
    pub fn branch(&self, branch: u32, count: u32) -> PathSampler {
        PathSampler { sample_index: self.sample_index * count + branch, ..*self }
    }

    /// Which sample of its pixel the path is.
    pub fn sample_index(&self) -> u32 {
        self.sample_index
    }

    /// A point of the unit square; `pair` numbers the pairs of dimensions.
    pub fn get_2d(&self, pair: u32) -> [f32; 2] {
        let shuffle = mix(self.key.wrapping_add(u64::from(pair).wrapping_mul(GAMMA)));
        let scramble = mix(shuffle);
        let index = owen_scramble_reversed(self.sample_index.reverse_bits(), shuffle as u32).reverse_bits();
        [
            unit_interval(owen_scramble_reversed(index, scramble as u32)),
            unit_interval(owen_scramble_reversed(sobol_1_reversed(index), (scramble >> 32) as u32)),
        ]
    }
}

/// The digits of the second Sobol dimension, least significant first. (Of the first they are `index` itself.)
///
/// Column *k* of its matrix is the polynomial (1 + z)^k over GF(2), so digit *j* is the sum of the bits *k* of
/// the index for which *j*'s ones are among *k*'s (Lucas): a sum over supersets, one step a bit of *j*.
fn sobol_1_reversed(index: u32) -> u32 {
    const STEPS: [(u32, u32); 5] =
        [(1, 0x5555_5555), (2, 0x3333_3333), (4, 0x0f0f_0f0f), (8, 0x00ff_00ff), (16, 0x0000_ffff)];
    STEPS.iter().fold(index, |x, (shift, mask)| x ^ (x >> shift & mask))
}

/// Owen scrambling of digits in reverse: whether a bit flips depends on all bits below it (Laine-Karras hash).
fn owen_scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Reversed digits to a value in [0, 1): as many as f32 holds without rounding up to 1.
fn unit_interval(reversed: u32) -> f32 {
    (reversed.reverse_bits() >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// Odd, near 2^64 over the golden ratio: steps between the states of SplitMix64 (Steele et al. 2014).
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// The output that SplitMix64 makes of a state: a bijection of good avalanche.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(GAMMA);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition: xor of direction numbers v_k, v_{k+1} = v_k ^ (v_k >> 1).
    fn sobol_1_by_definition(index: u32) -> u32 {
        let mut v = 1u32 << 31;
        let mut x = 0;
        for k in 0..32 {
            x ^= if index >> k & 1 == 1 { v } else { 0 };
            v ^= v >> 1;
        }
        x
    }

    #[test]
    fn sobol_matches_its_direction_numbers() {
        for index in (0..5000).chain((0..32).map(|b| 1 << b)).chain([u32::MAX, 0xdead_beef]) {
            assert_eq!(sobol_1_reversed(index).reverse_bits(), sobol_1_by_definition(index));
        }
    }

    #[test]
    fn every_pair_is_a_net() {
        // A (0, m, 2)-net has one point in each elementary interval of area 2^-m.
        for (pixel, pair, m) in [([0, 0], 0, 4), ([7, 3], 5, 4), ([1, 2], 1, 6), ([100, 900], 33, 8)] {
            let count = 1u32 << m;
            let points: Vec<[f32; 2]> =
                (0..count).map(|i| PathSampler::new(pixel, i, 42).get_2d(pair)).collect();
            for columns in (0..=m).map(|k| 1u32 << k) {
                let rows = count / columns;
                let mut cells: Vec<u32> = points
                    .iter()
                    .map(|p| (p[1] * rows as f32) as u32 * columns + (p[0] * columns as f32) as u32)
                    .collect();
                cells.sort_unstable();
                assert!(cells.into_iter().eq(0..count), "{columns} columns of {count} points");
            }
        }
    }

    #[test]
    fn values_are_uniform_for_each_dimension_and_pixel() {
        for dimension in 0..20 {
            let over_samples: f64 = (0..1024).map(|i| f64::from(sample([3, 5], i, dimension, 1))).sum();
            assert!((over_samples / 1024.0 - 0.5).abs() < 1e-3);
            let over_pixels: f64 =
                (0..10_000).map(|i| f64::from(sample([i % 100, i / 100], 0, dimension, 1))).sum();
            assert!((over_pixels / 1e4 - 0.5).abs() < 0.015, "dimension {dimension}");
        }
    }

    #[test]
    fn pixels_pairs_and_seeds_are_uncorrelated() {
        let correlation = |a: &dyn Fn(u32) -> f32, b: &dyn Fn(u32) -> f32| {
            let sum: f64 = (0..4096).map(|i| f64::from(a(i) - 0.5) * f64::from(b(i) - 0.5)).sum();
            12.0 * sum / 4096.0
        };
        let base = |i| sample([10, 10], i, 4, 0);
        let others: [&dyn Fn(u32) -> f32; 6] = [
            &|i| sample([11, 10], i, 4, 0),
            &|i| sample([10, 11], i, 4, 0),
            &|i| sample([10, 10], i, 5, 0),
            &|i| sample([10, 10], i, 6, 0),
            &|i| sample([10, 10], i, 4, 1),
            &|i| sample([10, 10], i + 4096, 4, 0),
        ];
        for (k, other) in others.iter().enumerate() {
            assert!(correlation(&base, other).abs() < 0.05, "{k}: {}", correlation(&base, other));
        }
        let neighbor = |i: u32| sample([i % 64 + 1, i / 64], 0, 4, 0);
        assert!(correlation(&|i| sample([i % 64, i / 64], 0, 4, 0), &neighbor).abs() < 0.05);
    }
}
