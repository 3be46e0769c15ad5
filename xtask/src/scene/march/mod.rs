//! Marching cubes (Lorensen, Cline 1987) layer by layer: two layers of values and the vertices on their edges are
//! all that is held.

mod cube;

use super::sink::MeshSink;
use anyhow::Result;
use cube::{CaseTable, case_table, edge_corners};

/// A vertex stays so far from the ends of its edge, in edges, so that no triangle is without area.
const MARGIN: f64 = 1.0 / 64.0;
/// The place of an edge that the surface does not cross.
const NONE: u32 = u32::MAX;

/// A function that is sampled on a grid.
pub trait Field {
    /// All values of the layer `z`, rows along x.
    fn layer(&mut self, z: usize, out: &mut Vec<f64>);
}

/// A box of cubes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// How many there are along each axis.
    pub counts: [usize; 3],
    /// Length of one. The box begins at the origin.
    pub size: f64,
}

/// Puts the surface where `field` is 0 into `sink`. Fronts look to where the field is positive. Open at the border
/// of the box, closed elsewhere.
pub fn march(field: &mut impl Field, cells: Cells, sink: &mut impl MeshSink) -> Result<()> {
    let [columns, rows, layers] = cells.counts;
    let grid = Grid { columns: columns + 1, rows: rows + 1, scale: cells.size, table: case_table() };
    let [mut below, mut above] = [Layer::default(), Layer::default()];
    let mut upright = Vec::new();
    for z in 0..=layers {
        field.layer(z, &mut above.values);
        grid.flat_edges(z, &mut above, sink)?;
        if z > 0 {
            grid.upright_edges(z - 1, &below, &above, &mut upright, sink)?;
            grid.cells(&below, &above, &upright, sink)?;
        }
        std::mem::swap(&mut below, &mut above);
    }
    Ok(())
}

/// A layer of grid points.
#[derive(Default)]
struct Layer {
    values: Vec<f64>,
    /// The vertex on the edge from each point along x, and along y.
    edges: [Vec<u32>; 2],
}

struct Grid {
    /// Points along x.
    columns: usize,
    /// Points along y.
    rows: usize,
    /// Length of a cell.
    scale: f64,
    table: CaseTable,
}

impl Grid {
    /// Makes the vertices on the edges within a layer.
    fn flat_edges(&self, z: usize, layer: &mut Layer, sink: &mut impl MeshSink) -> Result<()> {
        let values = &layer.values;
        for (axis, edges) in layer.edges.iter_mut().enumerate() {
            edges.clear();
            let [step, side] = [[1, self.columns], [self.columns, self.rows]][axis];
            for at in 0..values.len() {
                let position = self.point(at, z);
                let end = (position[axis] + 1 < side).then(|| values[at + step]);
                edges.push(self.crossing(position, axis, values[at], end, sink)?);
            }
        }
        Ok(())
    }

    /// Makes the vertices on the edges between two layers.
    fn upright_edges(
        &self,
        z: usize,
        below: &Layer,
        above: &Layer,
        edges: &mut Vec<u32>,
        sink: &mut impl MeshSink,
    ) -> Result<()> {
        edges.clear();
        for (at, (&from, &to)) in below.values.iter().zip(&above.values).enumerate() {
            edges.push(self.crossing(self.point(at, z), 2, from, Some(to), sink)?);
        }
        Ok(())
    }

    fn point(&self, at: usize, z: usize) -> [usize; 3] {
        [at % self.columns, at / self.columns, z]
    }

    /// The vertex on the edge from `position`, if it is crossed and does not lead out of the grid.
    fn crossing(
        &self,
        position: [usize; 3],
        axis: usize,
        from: f64,
        to: Option<f64>,
        sink: &mut impl MeshSink,
    ) -> Result<u32> {
        let Some(to) = to.filter(|&to| is_inside(from) != is_inside(to)) else { return Ok(NONE) };
        let mut place = position.map(|x| x as f64);
        place[axis] += (from / (from - to)).clamp(MARGIN, 1.0 - MARGIN);
        sink.vertex(place.map(|x| (x * self.scale) as f32))
    }

    fn cells(&self, below: &Layer, above: &Layer, upright: &[u32], sink: &mut impl MeshSink) -> Result<()> {
        let columns = self.columns;
        let offsets = [0, 1, columns, columns + 1];
        for at in (0..self.rows - 1).flat_map(|y| (0..columns - 1).map(move |x| y * columns + x)) {
            let bit = |corner: usize| {
                let layer = if corner < 4 { below } else { above };
                u8::from(is_inside(layer.values[at + offsets[corner % 4]])) << corner
            };
            let inside = (0..8).map(bit).fold(0, |mask, bit| mask | bit);
            let vertex = |edge: u8| {
                let begin = usize::from(edge_corners(edge)[0]);
                let edges = match usize::from(edge / 4) {
                    2 => upright,
                    axis => &(if begin < 4 { below } else { above }).edges[axis],
                };
                edges[at + offsets[begin % 4]]
            };
            self.table[usize::from(inside)].iter().try_for_each(|t| sink.triangle(t.map(vertex)))?;
        }
        Ok(())
    }
}

fn is_inside(value: f64) -> bool {
    value < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::isosurface::Noisy;
    use crate::scene::sink::Kept;
    use std::collections::HashMap;

    const CELLS: Cells = Cells { counts: [24; 3], size: 1.0 / 24.0 };

    /// Border edges and how often the others are used, told apart by direction.
    #[test]
    fn closed_but_at_the_border() {
        for seed in 0..4 {
            let mut mesh = Kept::default();
            march(&mut Noisy::new(24, 2.5, seed), CELLS, &mut mesh).unwrap();
            let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
            for [a, b, c] in &mesh.triangles {
                [[*a, *b], [*b, *c], [*c, *a]]
                    .into_iter()
                    .for_each(|edge| *uses.entry(edge).or_default() += 1);
            }
            let on_border = |v: u32, side: usize| {
                let x = mesh.positions[v as usize][side / 2];
                x == (side % 2) as f32
            };
            assert!(mesh.triangles.len() > 1000);
            for (&[a, b], &count) in &uses {
                let border = (0..6).any(|side| on_border(a, side) && on_border(b, side));
                let twin = uses.get(&[b, a]).copied().unwrap_or(0);
                assert_eq!((count, twin), (1, u32::from(!border)), "{a} {b}");
            }
        }
    }

    #[test]
    fn no_triangle_is_without_area() {
        let mut mesh = Kept::default();
        march(&mut Noisy::new(24, 2.5, 1), CELLS, &mut mesh).unwrap();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| glam::Vec3::from_array(mesh.positions[v as usize]));
            assert!((b - a).cross(c - a).length() > 0.0);
        }
    }
}
