//! The few shapes of which parts are made: surfaces of revolution, pieces of a torus, and extruded profiles.
//!
//! A part shares its vertices with no other, as in exports of CAD programs.

use glam::DVec3;
use std::f64::consts::TAU;

/// A mesh of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

/// A place and three directions at right angles.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub origin: DVec3,
    pub axis: DVec3,
    side: DVec3,
    third: DVec3,
}

impl Frame {
    /// At `origin`, with `axis` of unit length; the other directions are horizontal and upright where that can be.
    pub fn new(origin: DVec3, axis: DVec3) -> Frame {
        let side = if axis.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
        let side = side.reject_from_normalized(axis).normalize();
        Frame { origin, axis, side, third: axis.cross(side) }
    }

    /// The same, so far along the axis.
    pub fn moved(self, along: f64) -> Frame {
        Frame { origin: self.origin + self.axis * along, ..self }
    }

    /// A point at a distance and an angle from the axis.
    pub fn around(&self, radius: f64, angle: f64, along: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(angle);
        self.origin + (self.side * cos + self.third * sin) * radius + self.axis * along
    }

    fn point(&self, [side, third]: [f64; 2], along: f64) -> DVec3 {
        self.origin + self.side * side + self.third * third + self.axis * along
    }
}

/// Turns a profile of (radius, place along the axis) about the axis. A radius of 0 at an end closes it.
pub fn lathe(frame: Frame, profile: &[[f64; 2]], sides: u32) -> Shape {
    let mut shape = Shape::default();
    let mut before = None;
    for &[radius, along] in profile {
        let count = if radius == 0.0 { 1 } else { sides };
        let begin = shape.positions.len() as u32;
        for i in 0..count {
            shape.vertex(frame.around(radius, TAU * f64::from(i) / f64::from(sides), along));
        }
        let ring = Ring { begin, count };
        before.into_iter().for_each(|before| shape.join(before, ring, sides));
        before = Some(ring);
    }
    shape
}

/// An open cylinder from the origin of the frame.
pub fn tube(frame: Frame, radius: f64, length: f64, sides: u32) -> Shape {
    lathe(frame, &[[radius, 0.0], [radius, length]], sides)
}

/// A closed cylinder from the origin of the frame.
pub fn disc(frame: Frame, radius: f64, length: f64, sides: u32) -> Shape {
    lathe(frame, &[[0.0, 0.0], [radius, 0.0], [radius, length], [0.0, length]], sides)
}

/// A closed ring about the axis with a rectangular section.
pub fn collar(frame: Frame, radii: [f64; 2], length: f64, sides: u32) -> Shape {
    let [inner, outer] = radii;
    let mut shape = lathe(frame, &[[inner, 0.0], [outer, 0.0], [outer, length], [inner, length]], sides);
    shape.join(Ring { begin: 3 * sides, count: sides }, Ring { begin: 0, count: sides }, sides);
    shape
}

/// A bend of a tube.
pub struct Bend {
    /// The middle of the circle along which it is bent.
    pub center: DVec3,
    /// Unit vector from there to where the bend begins.
    pub begin: DVec3,
    /// Unit vector along which it begins.
    pub toward: DVec3,
    /// Radius of the circle, and of the tube.
    pub radii: [f64; 2],
    /// How far it is bent.
    pub angle: f64,
}

/// A piece of a torus, open at its ends.
pub fn bend(bend: &Bend, segments: u32, sides: u32) -> Shape {
    let mut shape = Shape::default();
    let upright = bend.begin.cross(bend.toward);
    let [large, small] = bend.radii;
    for i in 0..=segments {
        let (sin, cos) = libm::sincos(bend.angle * f64::from(i) / f64::from(segments));
        let radial = bend.begin * cos + bend.toward * sin;
        for j in 0..sides {
            let (sin, cos) = libm::sincos(TAU * f64::from(j) / f64::from(sides));
            shape.vertex(bend.center + radial * (large + small * cos) - upright * (small * sin));
        }
    }
    for begin in (0..segments).map(|i| i * sides) {
        shape.join(Ring { begin, count: sides }, Ring { begin: begin + sides, count: sides }, sides);
    }
    shape
}

/// The outline of a beam, and how its ends are closed.
pub struct Profile {
    /// Counterclockwise, seen against the axis.
    pub points: Vec<[f64; 2]>,
    /// Triangles of an end.
    pub ends: &'static [[u32; 3]],
}

impl Profile {
    /// A rectangle about the axis.
    pub fn rectangle(width: f64, height: f64) -> Profile {
        let [x, y] = [width / 2.0, height / 2.0];
        Profile { points: vec![[-x, -y], [x, -y], [x, y], [-x, y]], ends: &[[0, 1, 2], [0, 2, 3]] }
    }

    /// An I of the given height, width and thickness.
    pub fn i_beam(height: f64, width: f64, thickness: f64) -> Profile {
        let [x, y, t] = [height / 2.0, width / 2.0, thickness / 2.0];
        let inner = x - thickness;
        let points = vec![
            [-x, -y],
            [-inner, -y],
            [-inner, -t],
            [inner, -t],
            [inner, -y],
            [x, -y],
            [x, y],
            [inner, y],
            [inner, t],
            [-inner, t],
            [-inner, y],
            [-x, y],
        ];
        let ends = &[
            [0, 1, 2],
            [0, 2, 9],
            [0, 9, 11],
            [9, 10, 11],
            [2, 3, 8],
            [2, 8, 9],
            [4, 5, 3],
            [5, 6, 3],
            [3, 6, 8],
            [8, 6, 7],
        ];
        Profile { points, ends }
    }

    /// A U, open to the first direction of the frame.
    pub fn channel(height: f64, width: f64, thickness: f64) -> Profile {
        let [x, y, t] = [height, width / 2.0, thickness];
        let points =
            vec![[0.0, -y], [x, -y], [x, t - y], [t, t - y], [t, y - t], [x, y - t], [x, y], [0.0, y]];
        Profile { points, ends: &[[0, 1, 3], [1, 2, 3], [0, 3, 4], [0, 4, 7], [4, 5, 7], [5, 6, 7]] }
    }
}

/// Pulls a profile along the axis; closed.
pub fn extrude(frame: Frame, profile: &Profile, length: f64) -> Shape {
    let mut shape = Shape::default();
    for along in [0.0, length] {
        profile.points.iter().for_each(|&point| shape.vertex(frame.point(point, along)));
    }
    let count = profile.points.len() as u32;
    shape.join(Ring { begin: 0, count }, Ring { begin: count, count }, count);
    shape.triangles.extend(profile.ends.iter().map(|&[a, b, c]| [a, c, b]));
    shape.triangles.extend(profile.ends.iter().map(|end| end.map(|i| i + count)));
    shape
}

/// A box along the coordinate axes.
pub fn block(min: DVec3, size: DVec3) -> Shape {
    let middle = min + size * DVec3::new(0.5, 0.0, 0.5);
    // Of an upright frame the first direction is x, the second -z.
    extrude(Frame::new(middle, DVec3::Y), &Profile::rectangle(size.x, size.z), size.y)
}

/// Vertices around the axis.
#[derive(Clone, Copy)]
struct Ring {
    begin: u32,
    count: u32,
}

impl Ring {
    fn vertex(self, i: u32) -> u32 {
        self.begin + i % self.count
    }
}

impl Shape {
    fn vertex(&mut self, point: DVec3) {
        self.positions.push(point.as_vec3().to_array());
    }

    /// Triangles between two rings, fronts outside.
    fn join(&mut self, from: Ring, to: Ring, sides: u32) {
        for i in 0..sides {
            let [a, b] = [i, i + 1].map(|i| from.vertex(i));
            let [d, c] = [i, i + 1].map(|i| to.vertex(i));
            if from.count > 1 {
                self.triangles.push([a, b, c]);
            }
            if to.count > 1 {
                self.triangles.push([a, c, d]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Six times the volume; asks that every edge has one triangle on each side.
    fn volume(shape: &Shape) -> f64 {
        let mut uses: HashMap<[u32; 2], i32> = HashMap::new();
        for [a, b, c] in &shape.triangles {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                *uses.entry([*from.min(to), *from.max(to)]).or_default() += if from < to { 1 } else { -1 };
            }
        }
        assert!(uses.values().all(|&count| count == 0), "open");
        let corner = |v: u32| glam::Vec3::from_array(shape.positions[v as usize]).as_dvec3();
        shape.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c)))).sum::<f64>() / 6.0
    }

    fn near(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 0.01
    }

    #[test]
    fn closed_shapes_have_their_volume() {
        let frame = Frame::new(DVec3::new(1.0, 2.0, 3.0), DVec3::Z);
        assert!(near(volume(&disc(frame, 1.0, 2.0, 100)), TAU));
        assert!(near(volume(&collar(frame, [1.0, 2.0], 1.0, 100)), TAU * 1.5));
        assert!(near(volume(&block(DVec3::ONE, DVec3::new(1.0, 2.0, 3.0))), 6.0));
        assert!(near(volume(&extrude(frame, &Profile::i_beam(3.0, 2.0, 0.5), 2.0)), 6.0));
        assert!(near(volume(&extrude(frame, &Profile::channel(2.0, 2.0, 0.5), 2.0)), 5.0));
    }

    #[test]
    fn blocks_are_where_they_should_be() {
        let [min, size] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)];
        let shape = block(min, size);
        let points = || shape.positions.iter().map(|p| glam::Vec3::from_array(*p).as_dvec3());
        assert_eq!(points().reduce(DVec3::min), Some(min));
        assert_eq!(points().reduce(DVec3::max), Some(min + size));
    }

    #[test]
    fn a_full_bend_looks_out() {
        let ring =
            Bend { center: DVec3::ZERO, begin: DVec3::X, toward: DVec3::Z, radii: [2.0, 0.5], angle: TAU };
        let shape = bend(&ring, 16, 8);
        for triangle in &shape.triangles {
            let [a, b, c] = triangle.map(|v| glam::Vec3::from_array(shape.positions[v as usize]).as_dvec3());
            let core = DVec3::new(a.x, 0.0, a.z).normalize() * 2.0;
            assert!((b - a).cross(c - a).dot(a - core) > 0.0);
        }
    }
}
