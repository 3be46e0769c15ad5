//! Sorting by keys of 60 bits: the highest digit once, which cuts the work into parts for all threads, then each part by
//! digits from the lowest up.

use rayon::prelude::*;

/// Bits of keys.
pub const KEY_BITS: u32 = 60;
/// Bits of the digit that is first.
const FIRST_BITS: u32 = 12;
/// Bits of the others.
const DIGIT_BITS: u32 = 12;
/// Parts up to this many are sorted by comparing: digits would take longer than that.
const FEW: usize = 2048;

/// A key, and the place of what has it.
pub type Keyed = (u64, u32);

/// Sorts by key; those with equal keys stay in order.
pub fn radix_sort(items: &mut [Keyed]) {
    let shift = KEY_BITS - FIRST_BITS;
    let mut sorted = vec![(0, 0); items.len()];
    let ends = distribute(items, &mut sorted, shift, FIRST_BITS);
    let (mut parts, mut rest) = (Vec::with_capacity(ends.len()), (&mut sorted[..], &mut items[..]));
    let mut begin = 0;
    for end in ends {
        let (part, spare);
        (part, rest.0) = rest.0.split_at_mut(end - begin);
        (spare, rest.1) = rest.1.split_at_mut(end - begin);
        parts.push((part, spare));
        begin = end;
    }
    parts.into_par_iter().for_each(|(part, spare)| {
        if part.len() <= FEW {
            part.sort_by_key(|&(key, _)| key);
            spare.copy_from_slice(part);
        } else {
            // An even number of passes ends where it began.
            for digit in 0..shift / DIGIT_BITS / 2 {
                distribute(part, spare, 2 * digit * DIGIT_BITS, DIGIT_BITS);
                distribute(spare, part, (2 * digit + 1) * DIGIT_BITS, DIGIT_BITS);
            }
            spare.copy_from_slice(part);
        }
    });
}

const _: () = assert!((KEY_BITS - FIRST_BITS).is_multiple_of(2 * DIGIT_BITS));

/// Copies items to where those before are that have a lower digit. Tells where the items of each digit end.
fn distribute(from: &[Keyed], to: &mut [Keyed], shift: u32, bits: u32) -> Vec<usize> {
    let digit = |key: u64| (key >> shift) as usize & ((1 << bits) - 1);
    let mut places = vec![0; 1 << bits];
    from.iter().for_each(|&(key, _)| places[digit(key)] += 1);
    let mut begin = 0;
    for place in &mut places {
        (*place, begin) = (begin, begin + *place);
    }
    for &item in from {
        let place = &mut places[digit(item.0)];
        to[*place] = item;
        *place += 1;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers without a pattern (SplitMix64).
    fn noise(i: u64) -> u64 {
        let mut x = i.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        (x ^ x >> 27) >> 4
    }

    #[test]
    fn sorts_and_keeps_the_order_of_equals() {
        for count in [0, 1, 2, 1000, 300_000] {
            for spread in [60, 40, 3, 0] {
                let key = |i: u32| noise(i.into()) >> (KEY_BITS - spread);
                let mut items: Vec<Keyed> = (0..count).map(|i| (key(i), i)).collect();
                let mut expected = items.clone();
                expected.sort();
                radix_sort(&mut items);
                assert_eq!(items, expected, "{count} of {spread} bits");
            }
        }
    }
}
