//! The small mesh of a solid: marching cubes, then vertices are moved within the surface until triangles are alike.

use super::solid::Solid;
use crate::scene::march::{Cells, Field, march};
use crate::scene::refine::BaseMesh;
use crate::scene::sink::Kept;
use anyhow::Result;
use glam::{DVec3, Vec3};

/// Grid points along the side of a block that is looked at as a whole.
const BLOCK: usize = 4;
/// How much faster than the distance a solid may change.
const STEEPNESS: f64 = 1.8;
/// Rounds of moving vertices to the middle of their neighbors and back to the surface.
const ROUNDS: u32 = 3;
/// Step for slopes, in cells.
const SLOPE_STEP: f64 = 0.1;

/// The surface of `solid` within a box, from cells of the length `size`.
pub fn polygonize(solid: &impl Solid, [low, high]: [DVec3; 2], size: f64) -> Result<BaseMesh> {
    let counts = ((high - low) / size).to_array().map(|x| x.ceil() as usize);
    let mut sampled = Sampled { solid, low, size, counts: counts.map(|n| n + 1), blocks: Vec::new() };
    let mut mesh = Kept::default();
    march(&mut sampled, Cells { counts, size }, &mut mesh)?;
    mesh.triangles = largest_piece(mesh.positions.len(), &mesh.triangles);
    let mut positions: Vec<DVec3> =
        mesh.positions.iter().map(|&p| Vec3::from_array(p).as_dvec3() + low).collect();
    for _ in 0..ROUNDS {
        positions = even(&positions, &mesh.triangles);
        positions.iter_mut().for_each(|p| *p = on_surface(solid, *p, size));
    }
    Ok(BaseMesh::new(positions, mesh.triangles))
}

/// The solid at grid points. Blocks far from the surface have one value for all of their points.
struct Sampled<'a, S> {
    solid: &'a S,
    low: DVec3,
    size: f64,
    /// Grid points along each axis.
    counts: [usize; 3],
    /// The solid in the middles of the blocks of a layer.
    blocks: Vec<f64>,
}

impl<S: Solid> Sampled<'_, S> {
    fn blocks_along(&self, axis: usize) -> usize {
        self.counts[axis].div_ceil(BLOCK)
    }

    fn distance(&self, place: [f64; 3]) -> f64 {
        self.solid.distance(self.low + DVec3::from_array(place) * self.size)
    }

    fn sample_blocks(&mut self, z: usize) {
        let middle = |i: usize| (i * BLOCK) as f64 + (BLOCK - 1) as f64 / 2.0;
        let columns = self.blocks_along(0);
        self.blocks = (0..columns * self.blocks_along(1))
            .map(|i| self.distance([middle(i % columns), middle(i / columns), middle(z / BLOCK)]))
            .collect();
    }
}

impl<S: Solid> Field for Sampled<'_, S> {
    fn layer(&mut self, z: usize, out: &mut Vec<f64>) {
        if z.is_multiple_of(BLOCK) {
            self.sample_blocks(z);
        }
        let reach = STEEPNESS * self.size * BLOCK as f64 * 0.5 * 3f64.sqrt();
        let [columns, rows, _] = self.counts;
        out.clear();
        for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            let block = self.blocks[y / BLOCK * self.blocks_along(0) + x / BLOCK];
            let near = block.abs() < reach;
            out.push(if near { self.distance([x, y, z].map(|i| i as f64)) } else { block });
        }
    }
}

/// The triangles that hang together with the most others: coarse cells leave crumbs of what is thin.
fn largest_piece(vertices: usize, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    // Leads to the first vertex of the piece.
    let mut before: Vec<u32> = (0..vertices as u32).collect();
    let root = |before: &[u32], mut v: u32| {
        while before[v as usize] != v {
            v = before[v as usize];
        }
        v
    };
    for triangle in triangles {
        let roots = triangle.map(|v| root(&before, v));
        let first = roots[0].min(roots[1]).min(roots[2]);
        roots.iter().chain(triangle).for_each(|&v| before[v as usize] = first);
    }
    let mut sizes = vec![0; vertices];
    let pieces: Vec<u32> = triangles.iter().map(|t| root(&before, t[0])).collect();
    pieces.iter().for_each(|&piece| sizes[piece as usize] += 1);
    let largest = (0..vertices as u32).max_by_key(|&v| sizes[v as usize]).unwrap_or(0);
    triangles.iter().zip(pieces).filter(|(_, piece)| *piece == largest).map(|(t, _)| *t).collect()
}

/// Every vertex in the middle of its neighbors.
fn even(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); positions.len()];
    for &[a, b, c] in triangles {
        // On a closed surface each neighbor comes twice, once in each direction.
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let sum = &mut sums[from as usize];
            *sum = (sum.0 + positions[to as usize], sum.1 + 1.0);
        }
    }
    let middles = sums.iter().zip(positions);
    middles.map(|(&(sum, count), &p)| if count > 0.0 { sum / count } else { p }).collect()
}

/// The point moved along the slope to where the solid is 0, by a cell at most.
fn on_surface(solid: &impl Solid, p: DVec3, size: f64) -> DVec3 {
    let step = size * SLOPE_STEP;
    let here = solid.distance(p);
    let slope = DVec3::AXES.map(|axis| (solid.distance(p + axis * step) - here) / step);
    let slope = DVec3::from_array(slope);
    let square = slope.length_squared();
    if square < 0.01 { p } else { p - (slope * (here / square)).clamp_length_max(size) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::solid::ball;

    struct Ball;

    impl Solid for Ball {
        fn distance(&self, p: DVec3) -> f64 {
            ball(p, DVec3::ONE, 0.8)
        }
    }

    #[test]
    fn crumbs_are_left_out() {
        let triangles = [[5, 6, 7], [0, 1, 2], [3, 4, 1], [4, 3, 0]];
        assert_eq!(largest_piece(8, &triangles), triangles[1..]);
    }

    #[test]
    fn vertices_are_on_the_surface() {
        let mesh = polygonize(&Ball, [DVec3::ZERO, DVec3::splat(2.0)], 0.07).unwrap();
        assert!(mesh.positions.iter().all(|&p| Ball.distance(p).abs() < 1e-3));
        assert_eq!(mesh.triangles.len() * 3, mesh.edges.len() * 2);
        let [shortest, longest] =
            mesh.edge_lengths.iter().fold([9.0, 0.0f64], |[s, l], &e| [e.min(s), l.max(e)]);
        assert!(shortest > 0.01 && longest < 0.14, "{shortest} {longest}");
        assert!(mesh.normals.iter().zip(&mesh.positions).all(|(n, p)| n.dot(*p - DVec3::ONE) > 0.75));
    }
}
