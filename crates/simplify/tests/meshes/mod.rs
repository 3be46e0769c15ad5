//! Meshes to be simplified.

use glam::Vec3;
use raystrips_simplify::{Piece, Simplified, StoredQuadric};
use std::collections::{BTreeMap, BTreeSet};

pub fn piece(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Piece {
    Piece { positions, geometries: vec![0; triangles.len()], triangles, ..Piece::default() }
}

/// The unit square in `n` x `n` cells, at the heights that `z` says.
pub fn grid(n: u32, z: impl Fn(f32, f32) -> f32) -> Piece {
    let at = |i: u32| i as f32 / n as f32;
    let positions = (0..=n).flat_map(|y| (0..=n).map(move |x| (at(x), at(y))));
    let positions = positions.map(|(x, y)| Vec3::new(x, y, z(x, y))).collect();
    let cell = |x: u32, y: u32| {
        let [a, b] = [y * (n + 1) + x, (y + 1) * (n + 1) + x];
        [[a, a + 1, b + 1], [a, b + 1, b]]
    };
    piece(positions, (0..n).flat_map(|y| (0..n).flat_map(move |x| cell(x, y))).collect())
}

pub fn bumpy_grid(n: u32) -> Piece {
    grid(n, |x, y| 0.1 * (x * 9.0).sin() * (y * 7.0).cos())
}

/// The unit sphere, of a cube with `n` x `n` cells a side.
pub fn sphere(n: u32) -> Piece {
    let mut sides = Piece::default();
    for side in 0..6 {
        let square = grid(n, |_, _| 0.0);
        let first = sides.positions.len() as u32;
        sides.positions.extend(square.positions.iter().map(|p| on_sphere(*p, side, n)));
        sides.triangles.extend(square.triangles.iter().map(|t| t.map(|v| first + v)));
    }
    sides.geometries = vec![0; sides.triangles.len()];
    raystrips_simplify::weld(&sides)
}

/// Whole numbers are turned, so that corners of two sides are the same bits.
fn on_sphere(p: Vec3, side: usize, n: u32) -> Vec3 {
    let n = n as f32;
    let (x, y) = ((p.x * n).round() * 2.0 - n, (p.y * n).round() * 2.0 - n);
    let cube = [
        Vec3::new(x, y, n),
        Vec3::new(y, x, -n),
        Vec3::new(n, x, y),
        Vec3::new(-n, y, x),
        Vec3::new(y, n, x),
        Vec3::new(x, -n, y),
    ];
    cube[side].normalize()
}

/// Numbers from 0 to 1.
pub fn random(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    }
}

fn random_point(random: &mut impl FnMut() -> f32) -> Vec3 {
    Vec3::new(random(), random(), random())
}

/// Triangles that share nothing.
pub fn soup(n: u32, seed: u64) -> Piece {
    let mut random = random(seed);
    let mut positions = Vec::new();
    for _ in 0..n {
        let center = random_point(&mut random);
        positions.extend((0..3).map(|_| center + 0.1 * random_point(&mut random)));
    }
    piece(positions, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Small closed parts.
pub fn tetrahedra(n: u32) -> Piece {
    let mut random = random(7);
    let mut positions = Vec::new();
    for _ in 0..n {
        let center = random_point(&mut random);
        let size = 0.01 + 0.01 * random();
        positions.extend([Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|corner| center + size * corner));
    }
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    piece(positions, (0..n).flat_map(|i| faces.map(|face| face.map(|v| 4 * i + v))).collect())
}

/// Leaves around one edge, all joined by it.
pub fn fan(n: u32) -> Piece {
    let mut positions = vec![Vec3::ZERO, Vec3::Z];
    positions.extend((0..n).map(|i| {
        let angle = i as f32 / n as f32 * std::f32::consts::TAU;
        Vec3::new(angle.cos(), angle.sin(), 0.5)
    }));
    piece(positions, (0..n).map(|i| [0, 1, i + 2]).collect())
}

/// A cone without a bottom: all triangles meet at the top.
pub fn cone(n: u32) -> Piece {
    let Piece { mut positions, triangles, .. } = fan(n);
    positions[1] = 2.0 * Vec3::Z;
    piece(positions, triangles.into_iter().map(|[_, top, i]| [top, i, 2 + (i - 1) % n]).collect())
}

/// Triangles that cross each other, between random points.
pub fn tangle(triangle_count: u32, vertex_count: u32) -> Piece {
    let mut random = random(3);
    let positions = (0..vertex_count).map(|_| random_point(&mut random)).collect();
    let mut vertex = || (random() * vertex_count as f32) as u32 % vertex_count;
    piece(positions, (0..triangle_count).map(|_| [vertex(), vertex(), vertex()]).collect())
}

/// Every triangle `n` times.
pub fn repeated(of: &Piece, n: usize) -> Piece {
    piece(of.positions.clone(), of.triangles.iter().flat_map(|&t| vec![t; n]).collect())
}

/// Every triangle with corners of its own.
pub fn unwelded(of: &Piece) -> Piece {
    let positions: Vec<Vec3> = of.triangles.iter().flatten().map(|&v| of.positions[v as usize]).collect();
    let triangles = (0..of.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    piece(positions, triangles)
}

/// Triangles of one geometry.
pub fn only(of: &Piece, geometry: u32) -> Piece {
    let triangles = of.triangles.iter().zip(&of.geometries).filter(|(_, g)| **g == geometry).map(|(t, _)| *t);
    piece(of.positions.clone(), triangles.collect())
}

/// Parts become one again; vertices are told by where they came from.
pub fn join(parts: &[Simplified]) -> Piece {
    let mut joined = Piece::default();
    let mut numbers = BTreeMap::new();
    for part in parts {
        let mut number = |(i, source): (usize, &u32)| {
            let next = joined.positions.len() as u32;
            let number = *numbers.entry(*source).or_insert(next);
            if number == next {
                joined.positions.push(part.piece.positions[i]);
                joined.quadrics.push(StoredQuadric::default());
            }
            joined.quadrics[number as usize] += part.piece.quadrics[i];
            number
        };
        let number: Vec<u32> = part.sources.iter().enumerate().map(&mut number).collect();
        joined.triangles.extend(part.piece.triangles.iter().map(|t| t.map(|v| number[v as usize])));
    }
    joined.geometries = vec![0; joined.triangles.len()];
    joined
}

/// Triangles without those that are there again with the same order of corners.
pub fn distinct(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let turned = |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
    let distinct: BTreeSet<[u32; 3]> = triangles.iter().filter_map(turned).collect();
    distinct.into_iter().collect()
}

/// Edges of exactly one triangle.
pub fn open_edges(triangles: &[[u32; 3]]) -> usize {
    let mut counts = BTreeMap::new();
    for [a, b, c] in triangles {
        for (u, v) in [(a, b), (b, c), (c, a)] {
            *counts.entry((u.min(v), u.max(v))).or_insert(0) += 1;
        }
    }
    counts.values().filter(|&&count| count == 1).count()
}
