//! Vertices at the same place become one.

use crate::Piece;
use glam::Vec3;
use std::collections::HashMap;

/// Makes vertices of equal position one, keeps the first of them, and drops triangles that are left without three
/// different corners. A vertex is locked if one of those that it stands for was; their quadrics are added.
///
/// Positions are compared as bits, except that both zeros are equal.
#[must_use]
pub fn weld(piece: &Piece) -> Piece {
    let mut welded = Piece { origin: piece.origin, ..Piece::default() };
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::with_capacity(piece.positions.len());
    let number_of = piece.positions.iter().enumerate().map(|(i, position)| {
        // Adding zero makes a negative zero positive.
        let bits = (*position + Vec3::ZERO).to_array().map(f32::to_bits);
        let number = *numbers.entry(bits).or_insert(welded.positions.len() as u32);
        let is_new = number as usize == welded.positions.len();
        if is_new {
            welded.positions.push(*position);
        }
        if let Some(&locked) = piece.locked.get(i) {
            welded.locked.resize(welded.positions.len(), false);
            welded.locked[number as usize] |= locked;
        }
        if let Some(&quadric) = piece.quadrics.get(i) {
            welded.quadrics.resize(welded.positions.len(), crate::StoredQuadric::default());
            welded.quadrics[number as usize] += quadric;
        }
        number
    });
    let number_of: Vec<u32> = number_of.collect();
    for (triangle, &geometry) in piece.triangles.iter().zip(&piece.geometries) {
        let [a, b, c] = triangle.map(|v| number_of[v as usize]);
        if a != b && b != c && c != a {
            welded.triangles.push([a, b, c]);
            welded.geometries.push(geometry);
        }
    }
    welded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_become_one() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, -Vec3::ZERO, Vec3::Y, Vec3::Z];
        let piece = Piece {
            positions,
            triangles: vec![[0, 1, 2], [3, 4, 5], [0, 3, 1]],
            geometries: vec![7, 8, 9],
            ..Piece::default()
        };
        let welded = weld(&piece);
        assert_eq!(welded.positions, [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]);
        assert_eq!(welded.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(welded.geometries, [7, 8]);
    }
}
