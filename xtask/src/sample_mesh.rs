//! A small mesh for tests and for tables that are given no models.

use glam::Vec3;
use std::fmt::Write;

/// Quadrilaterals around the ring and around its tube.
const SIDES: [usize; 2] = [96, 40];

/// An OBJ file of a bumpy ring of 7,680 triangles.
pub fn obj() -> String {
    let mut text = String::new();
    for (i, j) in places() {
        let Vec3 { x, y, z } = point(i, j, SIDES);
        writeln!(text, "v {x} {y} {z}").expect("strings take all that is written");
    }
    let vertex = |i: usize, j: usize| (i % SIDES[0]) * SIDES[1] + j % SIDES[1] + 1;
    for (i, j) in places() {
        let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").expect("strings take all that is written");
    }
    text
}

fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..SIDES[0]).flat_map(|i| (0..SIDES[1]).map(move |j| (i, j)))
}

/// Vertex *j* of the *i*th round of a tube of so many rounds and vertices around it.
pub fn point(i: usize, j: usize, sides: [usize; 2]) -> Vec3 {
    let turn = |k: usize, of: usize| std::f32::consts::TAU * k as f32 / of as f32;
    let (around, across) = (turn(i, sides[0]), turn(j, sides[1]));
    let tube = 0.4 + 0.05 * (7.0 * around).sin() * (5.0 * across).cos();
    let ring = 1.0 + tube * across.cos();
    Vec3::new(ring * around.cos(), tube * across.sin(), ring * around.sin())
}
