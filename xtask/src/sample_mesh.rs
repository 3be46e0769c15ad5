//! A small mesh for tests and for tables that are given no models.

use glam::Vec3;
use std::fmt::Write;

/// Quadrilaterals around the ring and around its tube.
const SIDES: [usize; 2] = [96, 40];

/// An OBJ file of a bumpy ring of 7,680 triangles.
pub fn obj() -> String {
    let (positions, triangles) = ring(SIDES);
    let mut text = String::new();
    for Vec3 { x, y, z } in positions {
        writeln!(text, "v {x} {y} {z}").expect("strings take all that is written");
    }
    for [a, b, c] in triangles.iter().map(|triangle| triangle.map(|v| v + 1)) {
        writeln!(text, "f {a} {b} {c}").expect("strings take all that is written");
    }
    text
}

/// Positions and triangles of a bumpy ring of so many quadrilaterals around it and around its tube.
pub fn ring(sides: [usize; 2]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let places = || (0..sides[0]).flat_map(|i| (0..sides[1]).map(move |j| (i, j)));
    let vertex = |i: usize, j: usize| ((i % sides[0]) * sides[1] + j % sides[1]) as u32;
    let triangles = places().flat_map(|(i, j)| {
        let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    (places().map(|(i, j)| point(i, j, sides)).collect(), triangles.collect())
}

/// Vertex *j* around the tube at place *i* around the ring.
fn point(i: usize, j: usize, sides: [usize; 2]) -> Vec3 {
    let turn = |k: usize, of: usize| std::f32::consts::TAU * k as f32 / of as f32;
    let (around, across) = (turn(i, sides[0]), turn(j, sides[1]));
    let tube = 0.4 + 0.05 * (7.0 * around).sin() * (5.0 * across).cos();
    let ring = 1.0 + tube * across.cos();
    Vec3::new(ring * around.cos(), tube * across.sin(), ring * around.sin())
}
