//! Quadric error (Garland and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics", section 5).
//!
//! A quadric is the sum of squared distances to planes, weighted by area, as a function of the point. Unlike the
//! paper, where the matrix is singular the best point is not one of a few candidates, and unlike Lindstrom (2000,
//! "Out-of-Core Simplification of Large Polygonal Models", section 4.2) small singular values are not dropped: a small
//! multiple of the squared distance to a known point is added, which damps the same directions smoothly and costs a
//! tenth of a decomposition.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use std::ops::{Add, AddAssign};

/// A quadric to keep with its vertex, to which it is relative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StoredQuadric {
    /// The matrix, the vector, the constant and the weight.
    numbers: [f32; 11],
    /// Not 0 if the vertex was locked: planes that hold the border along edges between such vertices are not added yet,
    /// since what looked like a border may have been where another piece goes on.
    held: u32,
}

impl StoredQuadric {
    /// Area that it stands for.
    pub fn weight(&self) -> f32 {
        self.numbers[10]
    }

    /// Takes the quadric for one of several places where the vertex is going to be, whose quadrics are going to be added
    /// up, and leaves what all of them need.
    #[must_use]
    pub fn take(&mut self) -> StoredQuadric {
        let rest = StoredQuadric { held: self.held, ..StoredQuadric::default() };
        std::mem::replace(self, rest)
    }

    pub(crate) fn is_held(&self) -> bool {
        self.held != 0
    }

    pub(crate) fn hold(self, held: bool) -> StoredQuadric {
        StoredQuadric { held: held.into(), ..self }
    }
}

impl AddAssign for StoredQuadric {
    /// Adds the quadric of a vertex at the same place.
    fn add_assign(&mut self, other: StoredQuadric) {
        self.numbers.iter_mut().zip(other.numbers).for_each(|(a, b)| *a += b);
        self.held = self.held.max(other.held);
    }
}

/// A sum of weighted squared distances to planes: `p A p + 2 b p + c`. Points are relative to an origin that all
/// quadrics of a piece share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quadric {
    /// The matrix: xx, yy, zz, xy, xz, yz.
    a: [f64; 6],
    b: DVec3,
    c: f64,
    /// Area of the planes that stand for surface, in squared scene units; those that hold borders are not counted.
    weight: f64,
}

impl Quadric {
    /// The plane through `point` with the unit normal `normal`, standing for `area` of the surface.
    pub fn of_plane(point: DVec3, normal: DVec3, area: f64) -> Quadric {
        Quadric { weight: area, ..Quadric::of_border(point, normal, area) }
    }

    /// The plane of a triangle, standing for a third of its area: the share of a corner. Nothing if it has no area.
    pub fn of_corner([a, b, c]: [DVec3; 3]) -> Quadric {
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        if length > 0.0 { Quadric::of_plane(a, normal / length, length / 6.0) } else { Quadric::default() }
    }

    /// Like [`Quadric::of_plane`], for a plane that holds a border in place but is no surface.
    pub fn of_border(point: DVec3, normal: DVec3, weight: f64) -> Quadric {
        let n = normal;
        let d = -n.dot(point);
        let w = n * weight;
        Quadric {
            a: [w.x * n.x, w.y * n.y, w.z * n.z, w.x * n.y, w.x * n.z, w.y * n.z],
            b: w * d,
            c: weight * d * d,
            weight: 0.0,
        }
    }

    /// Area that it stands for.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Sum of area times squared distance at `p`; never negative.
    pub fn error(&self, p: DVec3) -> f64 {
        (p.dot(self.apply(p) + 2.0 * self.b) + self.c).max(0.0)
    }

    /// The same function of points relative to another origin, which is at `origin` relative to the one so far.
    #[must_use]
    pub fn moved(&self, origin: DVec3) -> Quadric {
        let b = self.b + self.apply(origin);
        Quadric { b, c: origin.dot(b + self.b) + self.c, ..*self }
    }

    /// The quadric as stored with a vertex at `p`: relative to that, so that an `f32` is enough.
    pub fn stored_at(&self, p: DVec3) -> StoredQuadric {
        let Quadric { a: [xx, yy, zz, xy, xz, yz], b, c, weight } = self.moved(p);
        let numbers = [xx, yy, zz, xy, xz, yz, b.x, b.y, b.z, c, weight].map(|x| x as f32);
        StoredQuadric { numbers, held: 0 }
    }

    /// The quadric that was stored with a vertex at `p`.
    pub fn from_stored(stored: StoredQuadric, p: DVec3) -> Quadric {
        let [xx, yy, zz, xy, xz, yz, x, y, z, c, weight] = stored.numbers.map(f64::from);
        Quadric { a: [xx, yy, zz, xy, xz, yz], b: DVec3::new(x, y, z), c, weight }.moved(-p)
    }

    /// The point where the error is least, if `pull` times the squared distance to `anchor` is added to it. `None` if
    /// there is neither a plane nor a pull in some direction.
    pub fn optimal(&self, anchor: DVec3, pull: f64) -> Option<DVec3> {
        let [xx, yy, zz, xy, xz, yz] = self.a;
        let (xx, yy, zz) = (xx + pull, yy + pull, zz + pull);
        // Adjugate of the symmetric matrix.
        let (ix, iy, iz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
        let determinant = xx * ix + xy * iy + xz * iz;
        let scale = xx + yy + zz;
        // Beyond this nothing of the determinant is right; false also where it is not a number.
        let solvable = determinant > 1e-13 * scale * scale * scale;
        if !solvable {
            return None;
        }
        // From the anchor on, so that rounding is relative to the step and not to the place.
        let g = -(self.apply(anchor) + self.b);
        let (jy, jz, kz) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
        let step = DVec3::new(
            ix * g.x + iy * g.y + iz * g.z,
            iy * g.x + jy * g.y + jz * g.z,
            iz * g.x + jz * g.y + kz * g.z,
        );
        Some(anchor + step / determinant)
    }

    fn apply(&self, p: DVec3) -> DVec3 {
        let [xx, yy, zz, xy, xz, yz] = self.a;
        DVec3::new(
            xx * p.x + xy * p.y + xz * p.z,
            xy * p.x + yy * p.y + yz * p.z,
            xz * p.x + yz * p.y + zz * p.z,
        )
    }
}

impl Add for Quadric {
    type Output = Quadric;

    fn add(mut self, other: Quadric) -> Quadric {
        self += other;
        self
    }
}

impl AddAssign for Quadric {
    fn add_assign(&mut self, other: Quadric) {
        for (a, b) in self.a.iter_mut().zip(other.a) {
            *a += b;
        }
        self.b += other.b;
        self.c += other.c;
        self.weight += other.weight;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner_at(p: DVec3) -> Quadric {
        let planes = [DVec3::X, DVec3::Y, DVec3::new(0.6, 0.0, 0.8)];
        planes.into_iter().map(|n| Quadric::of_plane(p, n, 2.0)).fold(Quadric::default(), Add::add)
    }

    #[test]
    fn three_planes_meet_in_the_optimum() {
        let p = DVec3::new(3.0, -1.0, 2.0);
        let quadric = corner_at(p);
        assert!(quadric.optimal(DVec3::ZERO, 0.0).expect("three planes").distance(p) < 1e-12);
        assert!(quadric.error(p) < 1e-12);
        assert!((quadric.error(p + DVec3::Y) - 2.0).abs() < 1e-12);
        assert_eq!(quadric.weight(), 6.0);
    }

    #[test]
    fn without_enough_planes_the_anchor_decides() {
        let plane = Quadric::of_plane(DVec3::Z, DVec3::Z, 1.0);
        assert_eq!(plane.optimal(DVec3::ONE, 0.0), None);
        let p = plane.optimal(DVec3::new(5.0, 6.0, 0.0), 1e-5).expect("it is pulled");
        assert!(p.distance(DVec3::new(5.0, 6.0, 1.0)) < 1e-4);
        assert_eq!(Quadric::default().optimal(DVec3::ONE, 0.0), None);
    }

    #[test]
    fn a_moved_quadric_is_the_same_function() {
        let quadric = corner_at(DVec3::new(1.0, 2.0, 3.0));
        let origin = DVec3::new(-4.0, 0.5, 7.0);
        let p = DVec3::new(0.3, 0.2, -0.1);
        assert!((quadric.moved(origin).error(p - origin) - quadric.error(p)).abs() < 1e-9);
    }

    #[test]
    fn what_is_stored_comes_back() {
        let p = DVec3::new(1000.0, -2000.0, 3000.0);
        let quadric = corner_at(p);
        let again = Quadric::from_stored(quadric.stored_at(p + DVec3::X), p + DVec3::X);
        for at in [p, p + DVec3::new(0.5, 0.25, 2.0)] {
            assert!((again.error(at) - quadric.error(at)).abs() < 1e-5);
        }
        assert_eq!(again.weight(), 6.0);
    }
}
