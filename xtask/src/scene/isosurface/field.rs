//! The function whose zeros are the surface: a gyroid (Schoen 1970) with four octaves of value noise added, over
//! the unit cube.
//!
//! It is computed for a whole layer of the grid at a time: sines and noise lattices are products of functions of one
//! coordinate, so that a grid point costs a few multiplications.

use crate::scene::march::Field;
use crate::scene::random::unit_of;
use std::f64::consts::TAU;

/// Octaves of noise.
const OCTAVES: u32 = 4;
/// Lattice cells of the first octave for each period of the gyroid; later ones have twice as many each.
const CELLS_PER_PERIOD: f64 = 1.7;
/// Amplitude of the first octave; later ones have half as much each. The gyroid goes from -1.5 to 1.5.
const AMPLITUDE: f64 = 2.4;

/// The function, sampled at `cells` + 1 points along each axis.
pub struct Noisy {
    /// Points along an axis.
    side: usize,
    sines: Vec<[f64; 2]>,
    octaves: Vec<Octave>,
}

impl Noisy {
    /// With so many periods of the gyroid along the cube.
    pub fn new(cells: usize, periods: f64, seed: u64) -> Noisy {
        let at = |i: usize| i as f64 / cells as f64;
        // Away from the symmetries of the gyroid at its origin.
        let phase = 0.137;
        let sines =
            (0..=cells).map(|i| TAU * (at(i) * periods + phase)).map(|a| [libm::sin(a), libm::cos(a)]);
        let octave = |number: u32| Octave {
            seed: [seed, u64::from(number)],
            amplitude: AMPLITUDE / f64::from(1 << number),
            places: (0..=cells)
                .map(|i| Place::new(at(i) * periods * CELLS_PER_PERIOD * f64::from(1 << number) + 0.37))
                .collect(),
        };
        Noisy { side: cells + 1, sines: sines.collect(), octaves: (0..OCTAVES).map(octave).collect() }
    }
}

impl Field for Noisy {
    fn layer(&mut self, z: usize, out: &mut Vec<f64>) {
        out.clear();
        let [sin_z, cos_z] = self.sines[z];
        for &[sin_y, cos_y] in &self.sines {
            out.extend(self.sines.iter().map(|[sin_x, cos_x]| sin_x * cos_y + sin_y * cos_z + sin_z * cos_x));
        }
        self.octaves.iter().for_each(|octave| octave.add(z, self.side, out));
    }
}

/// Smooth random values: one at each point of a lattice, and between them the quintic fade of Perlin 2002.
struct Octave {
    seed: [u64; 2],
    amplitude: f64,
    /// Where each grid coordinate is in the lattice.
    places: Vec<Place>,
}

/// A coordinate in a lattice.
#[derive(Clone, Copy)]
struct Place {
    cell: usize,
    fade: f64,
}

impl Place {
    fn new(x: f64) -> Place {
        let cell = libm::floor(x);
        let t = x - cell;
        Place { cell: cell as usize, fade: t * t * t * (t * (t * 6.0 - 15.0) + 10.0) }
    }

    fn mix(self, values: impl Fn(usize) -> f64) -> f64 {
        let (a, b) = (values(self.cell), values(self.cell + 1));
        a + (b - a) * self.fade
    }
}

impl Octave {
    fn add(&self, z: usize, side: usize, out: &mut [f64]) {
        let lattice_side = self.places[side - 1].cell + 2;
        let plane: Vec<f64> = (0..lattice_side * lattice_side)
            .map(|i| self.places[z].mix(|k| self.lattice_value(i % lattice_side, i / lattice_side, k)))
            .collect();
        let mut line = vec![0.0; lattice_side];
        for (row, y) in out.chunks_exact_mut(side).zip(&self.places) {
            for (i, value) in line.iter_mut().enumerate() {
                *value = y.mix(|j| plane[j * lattice_side + i]);
            }
            row.iter_mut().zip(&self.places).for_each(|(value, x)| *value += x.mix(|i| line[i]));
        }
    }

    fn lattice_value(&self, i: usize, j: usize, k: usize) -> f64 {
        let [seed, octave] = self.seed;
        (unit_of(&[seed, octave, i as u64, j as u64, k as u64]) - 0.5) * self.amplitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbors_are_alike() {
        let mut field = Noisy::new(64, 1.0, 3);
        let [mut below, mut above] = [Vec::new(), Vec::new()];
        field.layer(20, &mut below);
        field.layer(21, &mut above);
        assert_eq!(below.len(), 65 * 65);
        let step = below.iter().zip(&above).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(step > 0.0 && step < 0.7, "{step}");
    }
}
