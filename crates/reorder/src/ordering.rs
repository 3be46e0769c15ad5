//! In which order rays are traced: along a curve through where they begin, where they go, and where they probably hit
//! (Moon, Byun, Kim, Claudio, Kim, Ban, Nam, Yoon 2010, "Cache-oblivious ray reordering", section 4).

use glam::{Vec2, Vec3};
use raystrips_geom::curve::Curve;
use raystrips_geom::{Aabb, Ray};

/// What a ray is placed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ordering {
    /// As they come.
    None,
    /// Origin: three dimensions.
    Origin,
    /// Origin and direction: five.
    OriginDir,
    /// Approximate hit point: three.
    Hph,
    /// Approximate hit point and direction: five.
    HphDir,
    /// Approximate hit point and origin: six.
    HphOrigin,
}

impl Ordering {
    /// All of them.
    pub const ALL: [Ordering; 6] = [
        Ordering::None,
        Ordering::Origin,
        Ordering::OriginDir,
        Ordering::Hph,
        Ordering::HphDir,
        Ordering::HphOrigin,
    ];

    /// True for those that need approximate hit points.
    pub fn needs_hit_points(self) -> bool {
        matches!(self, Ordering::Hph | Ordering::HphDir | Ordering::HphOrigin)
    }
}

/// Bits of a coordinate, by the number of dimensions: 60 bits in all (section 4.3).
const BITS_3: u32 = 20;
const BITS_5: u32 = 12;
const BITS_6: u32 = 10;

/// Gives rays their places.
#[derive(Clone, Copy, Debug)]
pub struct Keys {
    ordering: Ordering,
    curve: Curve,
    min: Vec3,
    /// One over the extent of the scene, 0 where it is flat.
    scale: Vec3,
}

impl Keys {
    /// Keys for rays in a scene with these bounds.
    pub fn new(ordering: Ordering, curve: Curve, bounds: &Aabb) -> Keys {
        let extent = bounds.max - bounds.min;
        let scale = Vec3::select(extent.cmpgt(Vec3::ZERO), extent.recip(), Vec3::ZERO);
        Keys { ordering, curve, min: bounds.min, scale }
    }

    /// The place of a ray; `hit_point` is where it probably hits, for orderings that need that.
    pub fn key(&self, ray: &Ray, hit_point: Vec3) -> u64 {
        match self.ordering {
            Ordering::None => 0,
            Ordering::Origin => self.curve.place(self.cell(ray.org, BITS_3), BITS_3),
            Ordering::Hph => self.curve.place(self.cell(hit_point, BITS_3), BITS_3),
            Ordering::OriginDir => self.with_direction(ray.org, ray.dir),
            Ordering::HphDir => self.with_direction(hit_point, ray.dir),
            Ordering::HphOrigin => {
                let ([a, b, c], [d, e, f]) = (self.cell(hit_point, BITS_6), self.cell(ray.org, BITS_6));
                self.curve.place([a, b, c, d, e, f], BITS_6)
            }
        }
    }

    fn with_direction(&self, point: Vec3, dir: Vec3) -> u64 {
        let ([a, b, c], on_square) = (self.cell(point, BITS_5), octahedral(dir));
        let [d, e] = on_square.to_array().map(|x| quantized(x, BITS_5));
        self.curve.place([a, b, c, d, e], BITS_5)
    }

    fn cell(&self, point: Vec3, bits: u32) -> [u32; 3] {
        ((point - self.min) * self.scale).to_array().map(|x| quantized(x, bits))
    }
}

/// The cell of a number from 0 to 1; others, also those that are none, go to the ends.
fn quantized(x: f32, bits: u32) -> u32 {
    ((x * (1u32 << bits) as f32) as u32).min((1 << bits) - 1)
}

/// A direction as a point of the unit square: the faces of an octahedron unfolded, so that neighbors stay neighbors
/// (Meyer, Suessmuth, Sussner, Stamminger, Greiner 2010).
fn octahedral(dir: Vec3) -> Vec2 {
    let on_faces = dir / dir.abs().element_sum();
    let upper = on_faces.truncate();
    let sign = Vec2::select(upper.cmpge(Vec2::ZERO), Vec2::ONE, Vec2::NEG_ONE);
    let flat = if on_faces.z >= 0.0 { upper } else { (Vec2::ONE - Vec2::new(upper.y, upper.x).abs()) * sign };
    flat * 0.5 + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(ordering: Ordering) -> Keys {
        Keys::new(ordering, Curve::Z, &Aabb { min: Vec3::ZERO, max: Vec3::ONE })
    }

    #[test]
    fn keys_depend_on_what_they_are_made_of() {
        let key = |ordering, org: f32, dir: f32, hit: f32| {
            keys(ordering).key(&Ray::new(Vec3::splat(org), Vec3::new(1.0, dir, 0.0)), Vec3::splat(hit))
        };
        let depends = |ordering| {
            let from = key(ordering, 0.1, 0.2, 0.3);
            [(0.9, 0.2, 0.3), (0.1, -0.8, 0.3), (0.1, 0.2, 0.6)]
                .map(|(o, d, h)| key(ordering, o, d, h) != from)
        };
        let expected = [
            [false, false, false],
            [true, false, false],
            [true, true, false],
            [false, false, true],
            [false, true, true],
            [true, false, true],
        ];
        assert_eq!(Ordering::ALL.map(depends), expected);
    }

    #[test]
    fn near_points_have_near_places() {
        let key = |x: f32| keys(Ordering::Origin).key(&Ray::new(Vec3::splat(x), Vec3::X), Vec3::ZERO);
        let ascending: Vec<u64> = (0..100).map(|i| key(i as f32 / 100.0)).collect();
        assert!(ascending.is_sorted());
    }

    #[test]
    fn no_number_is_too_odd() {
        let flat = Aabb { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 0.0) };
        for ordering in Ordering::ALL {
            let keys = Keys::new(ordering, Curve::Hilbert, &flat);
            for odd in [f32::NAN, f32::INFINITY, -1e30, 5.0] {
                let key = keys.key(&Ray::new(Vec3::splat(odd), Vec3::splat(odd)), Vec3::splat(odd));
                assert!(key < 1 << 60, "{ordering:?} {odd}");
            }
        }
    }
}
