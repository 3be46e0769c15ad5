//! Space-filling curves in any dimension.

/// The order of the cells of a grid: what is near in space is mostly near in order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// The bits of the coordinates by turns (Morton 1966): fast, with jumps.
    #[default]
    Z,
    /// Neighbors in order are neighbors in space (Hilbert 1891; by the rule of Skilling 2004).
    Hilbert,
}

impl Curve {
    /// The place of a cell, whose coordinates have `bits` bits: a number of `N * bits` bits, at most 64.
    pub fn place<const N: usize>(self, mut cell: [u32; N], bits: u32) -> u64 {
        debug_assert!(N as u32 * bits <= 64 && cell.iter().all(|&x| u64::from(x) < 1 << bits));
        if self == Curve::Hilbert {
            to_hilbert(&mut cell, bits);
        }
        interleave(cell, bits)
    }
}

/// The highest bit of each coordinate, then the next of each, and so on.
fn interleave<const N: usize>(cell: [u32; N], bits: u32) -> u64 {
    let mut place = 0;
    for bit in (0..bits).rev() {
        for x in cell {
            place = place << 1 | u64::from(x >> bit & 1);
        }
    }
    place
}

/// Makes coordinates into those of the cell that has the Hilbert place of the given one as its Z place (Skilling 2004,
/// "Programming the Hilbert curve").
fn to_hilbert<const N: usize>(cell: &mut [u32; N], bits: u32) {
    let highest = 1 << (bits - 1);
    let mut bit = highest;
    while bit > 1 {
        let below = bit - 1;
        for i in 0..N {
            if cell[i] & bit != 0 {
                cell[0] ^= below;
            } else {
                let swapped = (cell[0] ^ cell[i]) & below;
                cell[0] ^= swapped;
                cell[i] ^= swapped;
            }
        }
        bit >>= 1;
    }
    // Gray code.
    for i in 1..N {
        cell[i] ^= cell[i - 1];
    }
    let mut turned = 0;
    let mut bit = highest;
    while bit > 1 {
        if cell[N - 1] & bit != 0 {
            turned ^= bit - 1;
        }
        bit >>= 1;
    }
    cell.iter_mut().for_each(|x| *x ^= turned);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells of a grid by their place on the curve.
    fn along<const N: usize>(curve: Curve, bits: u32) -> Vec<[u32; N]> {
        let mut cells = vec![None; 1 << (N as u32 * bits)];
        for number in 0..cells.len() {
            let cell: [u32; N] =
                std::array::from_fn(|axis| (number >> (axis as u32 * bits)) as u32 & ((1 << bits) - 1));
            let place = curve.place(cell, bits) as usize;
            assert!(cells[place].replace(cell).is_none(), "two cells at one place");
        }
        cells.into_iter().flatten().collect()
    }

    fn steps<const N: usize>(cells: &[[u32; N]]) -> Vec<u32> {
        let distance = |a: &[u32; N], b: &[u32; N]| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).sum();
        cells.windows(2).map(|pair| distance(&pair[0], &pair[1])).collect()
    }

    #[test]
    fn hilbert_goes_from_neighbor_to_neighbor() {
        assert!(steps(&along::<2>(Curve::Hilbert, 5)).iter().all(|&step| step == 1));
        assert!(steps(&along::<3>(Curve::Hilbert, 4)).iter().all(|&step| step == 1));
        assert!(steps(&along::<5>(Curve::Hilbert, 2)).iter().all(|&step| step == 1));
        assert!(steps(&along::<6>(Curve::Hilbert, 2)).iter().all(|&step| step == 1));
    }

    #[test]
    fn z_visits_every_cell_of_a_block_before_the_next() {
        let cells = along::<3>(Curve::Z, 3);
        for block in cells.chunks(8) {
            assert!(block.iter().all(|cell| cell.map(|x| x / 2) == block[0].map(|x| x / 2)));
        }
        assert_eq!(Curve::Z.place([1, 0, 0], 1), 4);
    }
}
