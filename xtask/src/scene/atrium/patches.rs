//! Patches of surface of which architecture is made, each a grid of quadrilaterals.

use crate::scene::refine::BaseMesh;
use glam::DVec3;
use std::f64::consts::TAU;

/// Depth of a flute, in radii.
const FLUTE: f64 = 0.09;

/// Steps along any profile, however coarse it becomes.
const MIN_ROWS: usize = 2;

/// How fine small meshes are.
#[derive(Clone, Copy, Debug)]
pub struct Detail {
    /// Length of their edges.
    pub edge: f64,
}

impl Detail {
    /// Steps along a length.
    pub fn steps(self, length: f64, [least, most]: [usize; 2]) -> usize {
        ((length / self.edge).ceil() as usize).clamp(least, most)
    }
}

/// What is around the axis of a turned piece, as the distance to it at an angle, for a radius of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Section {
    Round,
    Square,
    /// With so many flutes.
    Fluted(u32),
}

impl Section {
    /// A point at the share `around` of the way around.
    fn point(self, around: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(TAU * around);
        let round = DVec3::new(sin, 0.0, cos);
        match self {
            Section::Round => round,
            Section::Square => {
                // Steps of the same length on each of the four sides.
                let side = (around * 4.0 + 0.5).floor();
                let along = (around * 4.0 - side) * 2.0;
                match side as u32 % 4 {
                    0 => DVec3::new(along, 0.0, 1.0),
                    1 => DVec3::new(1.0, 0.0, -along),
                    2 => DVec3::new(-along, 0.0, -1.0),
                    _ => DVec3::new(-1.0, 0.0, along),
                }
            }
            Section::Fluted(flutes) => {
                // Hollows that meet in sharp edges.
                let wave = libm::sin(TAU * around * f64::from(flutes) / 2.0).abs();
                round * (1.0 - FLUTE * wave)
            }
        }
    }
}

/// Patches to be joined to a mesh.
#[derive(Default)]
pub struct Patches {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Patches {
    /// Adds a grid of so many cells. Fronts look to the cross product of the two directions.
    pub fn grid(&mut self, [columns, rows]: [usize; 2], at: impl Fn(f64, f64) -> DVec3) {
        let first = self.positions.len() as u32;
        let place = |i: usize, of: usize| i as f64 / of as f64;
        for (j, i) in (0..=rows).flat_map(|j| (0..=columns).map(move |i| (j, i))) {
            self.positions.push(at(place(i, columns), place(j, rows)));
        }
        let vertex = |i: usize, j: usize| first + (j * (columns + 1) + i) as u32;
        for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            // Diagonals alternate, so that no direction is preferred.
            let halves = if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            self.triangles.extend(halves);
        }
    }

    /// Adds a parallelogram from a corner along two directions.
    pub fn flat(&mut self, detail: Detail, corner: DVec3, [u, v]: [DVec3; 2]) {
        let cells = [u, v].map(|side| detail.steps(side.length(), [1, 48]));
        self.grid(cells, |i, j| corner + u * i + v * j);
    }

    /// Adds a box along the axes.
    pub fn block(&mut self, detail: Detail, low: DVec3, size: DVec3) {
        let high = low + size;
        let [x, y, z] = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
        for sides in [[y, x], [z, y], [x, z]] {
            self.flat(detail, low, sides);
            self.flat(detail, high, [-sides[1], -sides[0]]);
        }
    }

    /// Adds a piece turned about the y axis; `profile` goes from the ground up, by radius and height.
    pub fn turned(&mut self, detail: Detail, profile: &[[f64; 2]], section: Section, center: DVec3) {
        let widest = profile.iter().map(|p| p[0]).fold(0.0, f64::max);
        // Squares have their corners at every second of eight steps.
        let [least, most, unit] = match section {
            Section::Round => [5, 96, 1],
            Section::Square => [8, 96, 8],
            Section::Fluted(flutes) => [6, 6 * flutes as usize, 1],
        };
        let sides = detail.steps(TAU * widest, [least, most]).next_multiple_of(unit);
        let line = Line::new(profile);
        let rings = detail.steps(line.length, [MIN_ROWS, 128]);
        self.grid([sides, rings], |around, along| {
            let [radius, height] = line.at(along);
            let around = if around == 1.0 { 0.0 } else { around };
            center + section.point(around) * radius + DVec3::Y * height
        });
    }

    /// Adds a profile that is drawn along a way; `frame` tells where a point of the profile is at a share of the way.
    pub fn drawn(
        &mut self,
        detail: Detail,
        profile: &[[f64; 2]],
        length: f64,
        frame: impl Fn([f64; 2], f64) -> DVec3,
    ) {
        let line = Line::new(profile);
        let cells = [detail.steps(length, [8, 256]), detail.steps(line.length, [MIN_ROWS, 48])];
        self.grid(cells, |along, across| frame(line.at(across), along));
    }

    /// All patches as one mesh.
    pub fn mesh(&self) -> BaseMesh {
        BaseMesh::welded(&self.positions, &self.triangles)
    }
}

/// A line through points, by length.
struct Line<'a> {
    points: &'a [[f64; 2]],
    length: f64,
}

impl Line<'_> {
    fn new(points: &[[f64; 2]]) -> Line<'_> {
        Line { points, length: points.windows(2).map(distance).sum() }
    }

    fn at(&self, share: f64) -> [f64; 2] {
        let mut left = share * self.length;
        for pair in self.points.windows(2) {
            let length = distance(pair);
            if left <= length {
                let t = if length > 0.0 { left / length } else { 0.0 };
                return [0, 1].map(|axis| pair[0][axis] + (pair[1][axis] - pair[0][axis]) * t);
            }
            left -= length;
        }
        self.points[self.points.len() - 1]
    }
}

fn distance(pair: &[[f64; 2]]) -> f64 {
    let [dx, dy] = [0, 1].map(|axis| pair[1][axis] - pair[0][axis]);
    (dx * dx + dy * dy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DETAIL: Detail = Detail { edge: 0.2 };

    /// Six times the volume of a closed mesh, positive if fronts look out.
    fn volume(mesh: &BaseMesh) -> f64 {
        assert_eq!(mesh.triangles.len() * 3, mesh.edges.len() * 2, "open");
        let corners = mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize]));
        corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn blocks_are_closed_and_look_out() {
        let mut patches = Patches::default();
        patches.block(DETAIL, DVec3::ONE, DVec3::new(1.0, 2.0, 3.0));
        assert!((volume(&patches.mesh()) - 6.0).abs() < 1e-9);
    }

    #[test]
    fn turned_pieces_are_closed_and_look_out() {
        let profile = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]];
        for (section, expected) in [(Section::Round, TAU), (Section::Square, 8.0), (Section::Fluted(20), 5.7)]
        {
            let mut patches = Patches::default();
            patches.turned(Detail { edge: 0.02 }, &profile, section, DVec3::X);
            let volume = volume(&patches.mesh());
            assert!((volume / expected - 1.0).abs() < 0.05, "{section:?}: {volume}");
        }
    }

    #[test]
    fn lines_go_by_length() {
        let line = Line::new(&[[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]]);
        assert_eq!([line.at(0.0), line.at(0.5), line.at(1.0)], [[0.0, 0.0], [2.0, 0.0], [3.0, 1.0]]);
    }
}
