//! A ray against the triangles of a leaf by Plücker coordinates, four edges at a time (paper, section 5.2).
//!
//! Seen from the ray's origin, the side on which the ray passes the edge from a to b is the sign of
//! dot(cross(b, a), dir). The ray meets a triangle if it passes all three edges on the same side. Edges that
//! triangles share are computed once: five for the two triangles of a leaf.

use super::super::ray::PreparedRay;
use glam::{Vec3, Vec4, Vec4Swizzles};
use raystrips_geom::Hit;

/// The four vertices of a leaf as seen from the origin of rays.
pub struct Corners {
    points: [Vec3; 4],
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

/// Moments of edges from each vertex to another one.
pub struct Moments {
    /// Components of all four.
    pub x: Vec4,
    pub y: Vec4,
    pub z: Vec4,
}

impl Corners {
    /// `vertices` as seen from `org`.
    #[inline]
    pub fn new(vertices: [Vec3; 4], org: Vec3) -> Corners {
        let [a, b, c, d] = [vertices[0] - org, vertices[1] - org, vertices[2] - org, vertices[3] - org];
        Corners {
            x: Vec4::new(a.x, b.x, c.x, d.x),
            y: Vec4::new(a.y, b.y, c.y, d.y),
            z: Vec4::new(a.z, b.z, c.z, d.z),
            points: [a, b, c, d],
        }
    }

    /// Moments of the edges from vertex i to i + 1; the fourth is none of the strip's.
    #[inline]
    pub fn to_next(&self) -> Moments {
        self.moments(self.x.yzwx(), self.y.yzwx(), self.z.yzwx())
    }

    /// Moments of the edges from vertex i to i + 2; the third and fourth are none of the strip's.
    #[inline]
    pub fn to_next_but_one(&self) -> Moments {
        self.moments(self.x.zwxy(), self.y.zwxy(), self.z.zwxy())
    }

    #[inline]
    fn moments(&self, x: Vec4, y: Vec4, z: Vec4) -> Moments {
        Moments { x: y * self.z - z * self.y, y: z * self.x - x * self.z, z: x * self.y - y * self.x }
    }

    /// Normal of triangle `i` and its product with the vector to the plane.
    #[inline]
    pub fn plane(&self, i: usize) -> (Vec3, f32) {
        let [a, b, c] = [self.points[i], self.points[i + 1], self.points[i + 2]];
        let normal = (b - a).cross(c - a);
        (normal, a.dot(normal))
    }
}

/// Replaces `best` where `ray` meets one of the first `count` triangles of a leaf nearer.
#[inline]
pub fn test_leaf(corners: &Corners, count: u32, prim_id: u64, ray: &PreparedRay, best: &mut Hit) {
    let side = |edges: Moments| edges.x * ray.dir.x + edges.y * ray.dir.y + edges.z * ray.dir.z;
    let next = side(corners.to_next());
    // Opposite corner of each edge, triangle by triangle: the sides are weights of the corners but for their sum.
    let (w0, w1, w2) = (next.yzwx(), -side(corners.to_next_but_one()), next);
    let least = w0.min(w1).min(w2);
    let most = w0.max(w1).max(w2);
    let inside = least.cmpge(Vec4::ZERO) | most.cmple(Vec4::ZERO);
    let mask = inside.bitmask() & ((1 << count) - 1);
    if mask == 0 {
        return;
    }
    let sum = w0 + w1 + w2;
    for i in 0..2 {
        if mask >> i & 1 == 0 {
            continue;
        }
        let (normal, height) = corners.plane(i);
        let t = height / normal.dot(ray.dir);
        // A swap has no area: all of its sides are 0 where the first test lets it pass, and its distance is no number.
        if t >= ray.tnear && t < best.t && sum[i] != 0.0 {
            let prim_id = prim_id + i as u64;
            *best = Hit { t, u: w1[i] / sum[i], v: w2[i] / sum[i], prim_id, ..Hit::MISS };
        }
    }
}
