//! A bay of the plant: a steel frame of some levels, with its parts. Bays know nothing of each other, so that one of
//! them is all that is in memory.

use super::materials::{Kind, any_of};
use super::shapes::{Frame, Shape, block};
use super::{equipment, fittings, pipe, structure};
use crate::scene::random::Random;
use glam::DVec3;

/// Length and width of a bay, in meters.
pub const SIZE: f64 = 12.0;
/// From bay to bay, with the aisle between them.
pub const PITCH: f64 = 14.0;
/// Height of a level.
pub const LEVEL: f64 = 4.6;
/// Highest bays.
const MAX_LEVELS: usize = 3;

/// A shape and the number of its material.
pub struct Part {
    pub material: usize,
    pub shape: Shape,
}

/// What is made for a bay, and the random numbers that decide it.
pub struct Bay {
    pub random: Random,
    pub parts: Vec<Part>,
}

impl Bay {
    /// The bay of a column and a row.
    pub fn new(seed: u64, column: u64, row: u64) -> Bay {
        let mut bay = Bay { random: Random::new(&[seed, column, row]), parts: Vec::new() };
        let corner = DVec3::new(column as f64, 0.0, row as f64) * PITCH;
        let slab = any_of(Kind::Slab, &mut bay.random);
        bay.put(slab, block(corner - DVec3::new(0.4, 0.0, 0.4), DVec3::new(SIZE + 0.8, 0.2, SIZE + 0.8)));
        let beam = any_of(Kind::Beam, &mut bay.random);
        let levels = 1 + bay.random.below(MAX_LEVELS);
        for level in 0..levels {
            let corner = corner + DVec3::Y * (0.2 + LEVEL * level as f64);
            structure::frame(&mut bay, corner, beam);
            bay.fill(corner);
        }
        structure::railing(&mut bay, corner + DVec3::Y * (0.2 + LEVEL * levels as f64));
        bay
    }

    /// Takes a part.
    pub fn put(&mut self, material: usize, shape: Shape) {
        self.parts.push(Part { material, shape });
    }

    /// Triangles of all parts.
    pub fn triangles(&self) -> u64 {
        self.parts.iter().map(|part| part.shape.triangles.len() as u64).sum()
    }

    /// Puts equipment on the floor of a level, pipes and trays above it.
    fn fill(&mut self, corner: DVec3) {
        for [x, z] in [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]] {
            let place = corner + DVec3::new(x, 0.0, z) * SIZE;
            match self.random.below(7) {
                0 => equipment::vessel(self, place),
                1 => equipment::tank(self, place),
                2 => equipment::tube_bundle(self, place),
                3 | 4 => equipment::pumps(self, place),
                5 => equipment::cabinets(self, place),
                _ => {}
            }
        }
        structure::trays(self, corner);
        for _ in 0..10 + self.random.below(12) {
            pipe::wander(self, corner + DVec3::Y * 0.8, DVec3::new(SIZE, LEVEL - 1.3, SIZE));
        }
        for _ in 0..1 + self.random.below(2) {
            pipe::rack(self, corner);
        }
    }

    /// A short pipe with a closed flange, as vessels have them.
    pub fn nozzle(&mut self, frame: Frame, radius: f64, length: f64) {
        let material = any_of(Kind::Flange, &mut self.random);
        self.put(material, super::shapes::tube(frame, radius, length, 16));
        fittings::blind_flange(self, frame.moved(length), radius);
    }
}
