//! Vertices in one cell of a grid become one (Rossignac, Borrel 1993), which stands for the surface around all of them
//! by the sum of their quadrics (Lindstrom 2000, "Out-of-Core Simplification of Large Polygonal Models").
//!
//! Where a surface was made of patches whose borders are near each other but not the same, it is whole afterwards. Unlike
//! in the papers the vertex is in the middle of the cell, so that pieces agree on it without knowing each other; it finds
//! its place when edges are collapsed.

use crate::{Piece, Quadric, StoredQuadric};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Makes vertices in the same cell of a grid with this step one, for a piece that has not been simplified before.
/// Triangles that are left without three different corners are dropped.
#[must_use]
pub fn merge_in_cells(piece: Piece, step: f64) -> Piece {
    let quadrics = quadrics_of_triangles(&piece);
    let mut merged = Piece { origin: piece.origin, ..Piece::default() };
    let mut numbers: HashMap<[i64; 3], u32> = HashMap::with_capacity(piece.positions.len());
    let number_of: Vec<u32> = piece
        .positions
        .iter()
        .zip(&quadrics)
        .map(|(position, quadric)| {
            let cell = (position.as_dvec3() / step).round();
            let number = *numbers.entry(cell.to_array().map(|x| x as i64)).or_insert_with(|| {
                merged.positions.push((cell * step).as_vec3() + Vec3::ZERO);
                merged.quadrics.push(StoredQuadric::default().hold(true));
                merged.positions.len() as u32 - 1
            });
            let middle = merged.positions[number as usize].as_dvec3();
            merged.quadrics[number as usize] += quadric.stored_at(middle - piece.origin);
            number
        })
        .collect();
    for (triangle, &geometry) in piece.triangles.iter().zip(&piece.geometries) {
        let [a, b, c] = triangle.map(|v| number_of[v as usize]);
        if a != b && b != c && c != a {
            merged.triangles.push([a, b, c]);
            merged.geometries.push(geometry);
        }
    }
    merged
}

/// For each vertex the planes of its triangles.
fn quadrics_of_triangles(piece: &Piece) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); piece.positions.len()];
    for triangle in &piece.triangles {
        let corners: [DVec3; 3] = triangle.map(|v| piece.positions[v as usize].as_dvec3() - piece.origin);
        let plane = Quadric::of_corner(corners);
        triangle.iter().for_each(|&v| quadrics[v as usize] += plane);
    }
    quadrics
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Target, simplify};

    #[test]
    fn patches_with_gaps_become_a_surface() {
        // A bent sheet of squares that do not quite touch.
        let mut piece = Piece { origin: DVec3::splat(3.0), ..Piece::default() };
        let side = 40;
        for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
            let first = piece.positions.len() as u32;
            let corner = |dx: f32, dy: f32| {
                let (x, y) = (x as f32 + dx, y as f32 + dy);
                Vec3::new(x, y, 0.01 * x * x)
            };
            let near = |at: f32| 1e-3 + at * (1.0 - 2e-3);
            let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
            piece.positions.extend(square.map(|(x, y)| corner(near(x), near(y))));
            piece.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        piece.geometries = vec![0; piece.triangles.len()];
        let merged = merge_in_cells(piece.clone(), 0.05);
        assert_eq!(merged.positions.len(), ((side + 1) * (side + 1)) as usize);
        assert_eq!(merged.triangles.len(), piece.triangles.len());
        let simplified = simplify(merged, Target::triangles(100)).piece;
        let distances = crate::measure(
            (&piece.positions, &piece.triangles),
            (&simplified.positions, &simplified.triangles),
            20_000,
        );
        assert!(distances.max < 0.3 && distances.mean < 0.03, "{distances:?}");
    }
}
