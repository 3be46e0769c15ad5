//! Morton keys: the bits of three coordinates interleaved, so that what is close in space is mostly close in order
//! (Morton 1966).

/// Bits of a coordinate.
pub const AXIS_BITS: u32 = 21;

/// The key of 63 bits: bit 0 of x is its bit 0, that of y its bit 1, that of z its bit 2, and so on. Coordinates
/// have [`AXIS_BITS`] bits; higher ones are ignored.
#[inline]
pub fn encode([x, y, z]: [u32; 3]) -> u64 {
    spread(x) | spread(y) << 1 | spread(z) << 2
}

/// Moves bit i to bit 3 i.
#[inline]
fn spread(x: u32) -> u64 {
    let mut x = u64::from(x) & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_bit_goes_to_its_place(x in 0u32..1 << 21, y in 0u32..1 << 21, z in 0u32..1 << 21) {
            let bit = |value: u32, i: u32, axis: u32| u64::from(value >> i & 1) << (3 * i + axis);
            let slow = (0..AXIS_BITS).map(|i| bit(x, i, 0) | bit(y, i, 1) | bit(z, i, 2)).sum::<u64>();
            prop_assert_eq!(encode([x, y, z]), slow);
        }
    }
}
