//! The point of a mesh that is closest to another point, by a hierarchy of boxes.

use glam::{DVec3, Vec3};
use raystrips_geom::Aabb;

/// Most triangles of a leaf.
const LEAF_TRIANGLES: usize = 4;

/// A node: children are after one another, triangles as well.
struct Node {
    bounds: Aabb,
    /// First child or first triangle.
    first: u32,
    /// Triangles; 0 for an inner node.
    count: u32,
}

/// A hierarchy of boxes over triangles, for closest points.
pub struct ClosestPoint {
    nodes: Vec<Node>,
    triangles: Vec<[Vec3; 3]>,
}

/// Nearest triangle so far.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Squared distance.
    pub distance_squared: f64,
    /// The triangle's place in the hierarchy: a good guess for points nearby.
    pub triangle: u32,
}

impl ClosestPoint {
    /// Builds the hierarchy by cutting at the median of the longest axis.
    ///
    /// # Panics
    /// If there are no triangles or an index is out of range.
    pub fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> ClosestPoint {
        assert!(!triangles.is_empty(), "there is no closest point of nothing");
        let mut corners: Vec<[Vec3; 3]> =
            triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let mut nodes = vec![Node { bounds: Aabb::EMPTY, first: 0, count: 0 }];
        let mut to_do = vec![(0, 0..corners.len())];
        while let Some((node, range)) = to_do.pop() {
            let here = &mut corners[range.clone()];
            let bounds = Aabb::of_points(here.iter().flatten().copied());
            if range.len() <= LEAF_TRIANGLES {
                nodes[node] = Node { bounds, first: range.start as u32, count: range.len() as u32 };
                continue;
            }
            let centers = Aabb::of_points(here.iter().map(center)).extent();
            let axis = (0..3).fold(0, |a, b| if centers[b] > centers[a] { b } else { a });
            let middle = range.len() / 2;
            here.select_nth_unstable_by(middle, |a, b| center(a)[axis].total_cmp(&center(b)[axis]));
            let first = nodes.len();
            nodes[node] = Node { bounds, first: first as u32, count: 0 };
            for (child, range) in
                [range.start..range.start + middle, range.start + middle..range.end].into_iter().enumerate()
            {
                nodes.push(Node { bounds: Aabb::EMPTY, first: 0, count: 0 });
                to_do.push((first + child, range));
            }
        }
        ClosestPoint { nodes, triangles: corners }
    }

    /// The triangle nearest to `point`. `guess` is any triangle's place; the nearer it is, the faster.
    pub fn nearest(&self, point: DVec3, guess: u32) -> Nearest {
        self.nearer(point, Nearest { distance_squared: self.distance_squared(point, guess), triangle: guess })
    }

    /// The squared distance to the triangle nearest to `point`, or `most` if all are farther away.
    pub fn distance_squared_within(&self, point: DVec3, most: f64) -> f64 {
        if box_distance_squared(&self.nodes[0].bounds, point) >= most {
            return most;
        }
        self.nearer(point, Nearest { distance_squared: most, triangle: 0 }).distance_squared
    }

    /// The triangle nearest to `point`, if it is nearer than what was found so far.
    fn nearer(&self, point: DVec3, mut nearest: Nearest) -> Nearest {
        let mut stack = [(0u32, 0.0f64); 64];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (node, distance) = stack[height];
            if distance >= nearest.distance_squared {
                continue;
            }
            let node = &self.nodes[node as usize];
            for triangle in node.first..node.first + node.count {
                let distance_squared = self.distance_squared(point, triangle);
                if distance_squared < nearest.distance_squared {
                    nearest = Nearest { distance_squared, triangle };
                }
            }
            if node.count == 0 {
                let children = [node.first, node.first + 1]
                    .map(|child| (child, box_distance_squared(&self.nodes[child as usize].bounds, point)));
                let near = usize::from(children[1].1 < children[0].1);
                // The hierarchy halves the triangles, so it is at most 32 deep.
                stack[height] = children[1 - near];
                stack[height + 1] = children[near];
                height += 2;
            }
        }
        nearest
    }

    fn distance_squared(&self, point: DVec3, triangle: u32) -> f64 {
        let corners = self.triangles[triangle as usize].map(|p| p.as_dvec3());
        point.distance_squared(closest_of_triangle(point, corners))
    }
}

fn center(corners: &[Vec3; 3]) -> Vec3 {
    Aabb::of_points(corners.iter().copied()).center()
}

fn box_distance_squared(bounds: &Aabb, point: DVec3) -> f64 {
    let nearest = point.max(bounds.min.as_dvec3()).min(bounds.max.as_dvec3());
    point.distance_squared(nearest)
}

/// The point of a triangle that is closest to `p` (Ericson 2005, "Real-Time Collision Detection", section 5.1.5).
fn closest_of_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let is_inside = |p: DVec3, q: DVec3, x: DVec3| normal.dot((q - p).cross(x - p)) >= 0.0;
    if normal != DVec3::ZERO && is_inside(a, b, p) && is_inside(b, c, p) && is_inside(c, a, p) {
        return p - normal * (normal.dot(p - a) / normal.length_squared());
    }
    let on_edges = [closest_of_segment(p, a, b), closest_of_segment(p, b, c), closest_of_segment(p, c, a)];
    let nearer = |x: DVec3, y: DVec3| if p.distance_squared(y) < p.distance_squared(x) { y } else { x };
    nearer(nearer(on_edges[0], on_edges[1]), on_edges[2])
}

fn closest_of_segment(p: DVec3, a: DVec3, b: DVec3) -> DVec3 {
    let length_squared = a.distance_squared(b);
    if length_squared == 0.0 {
        return a;
    }
    a + (b - a) * ((p - a).dot(b - a) / length_squared).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn soup() -> impl Strategy<Value = Vec<Vec3>> {
        prop::collection::vec(prop::array::uniform3(-1.0f32..1.0).prop_map(Vec3::from_array), 3..120)
    }

    proptest! {
        #[test]
        fn same_as_looking_at_all(points in soup(), from in prop::array::uniform3(-3.0f64..3.0)) {
            let triangles: Vec<[u32; 3]> = (0..points.len() as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
            let tree = ClosestPoint::of(&points, &triangles);
            let from = DVec3::from_array(from);
            let all = (0..triangles.len() as u32).map(|t| tree.distance_squared(from, t));
            prop_assert_eq!(tree.nearest(from, 0).distance_squared, all.fold(f64::INFINITY, f64::min));
        }
    }

    #[test]
    fn regions_of_a_triangle() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let closest = |x, y, z| closest_of_triangle(DVec3::new(x, y, z), corners);
        assert_eq!(closest(0.25, 0.25, 3.0), DVec3::new(0.25, 0.25, 0.0));
        assert_eq!(closest(0.5, -2.0, 1.0), DVec3::new(0.5, 0.0, 0.0));
        assert_eq!(closest(-1.0, -1.0, 0.0), DVec3::ZERO);
        assert!(closest(1.0, 1.0, 0.0).distance(DVec3::new(0.5, 0.5, 0.0)) < 1e-15);
    }
}
