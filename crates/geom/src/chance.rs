//! Chance that belongs to numbers: the same ones always give the same, so that what is decided by it does not depend on when
//! it is decided.

/// A number from 0 to 1, less than 1, that belongs to these words in this order (finalizer of SplitMix64, Steele, Lea, Flood
/// 2014).
#[inline]
pub fn chance<const N: usize>(words: [[f32; 2]; N]) -> f32 {
    let pair = |[a, b]: [f32; 2]| u64::from(a.to_bits()) << 32 | u64::from(b.to_bits());
    let hash = words.into_iter().map(pair).fold(0u64, |hash, word| {
        let z = (hash ^ word).wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    });
    (hash >> 40) as f32 / (1u32 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chances_are_even_and_belong_to_their_numbers() {
        let of = |i: u32| chance([[i as f32, 0.5]]);
        let mut counts = [0; 16];
        (0..16_000).for_each(|i| counts[(of(i) * 16.0) as usize] += 1);
        assert!(counts.iter().all(|count| (850..1150).contains(count)), "{counts:?}");
        assert_eq!(of(7), of(7));
        assert_ne!(chance([[1.0, 2.0]]), chance([[2.0, 1.0]]));
    }
}
