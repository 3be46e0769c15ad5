//! Cutting polygons into triangles.
//!
//! Convex ones become a fan around the first corner. Others are cut by ear clipping (Meisters 1975) in the plane of
//! the two axes in which the polygon is largest, as told by its Newell normal. A polygon of *n* corners always gives
//! *n* - 2 triangles, whatever its shape, so that triangles can be numbered before they are made.

use glam::DVec3;

/// Point tests for each corner before ear clipping ends in a fan: no file can keep it busy for long.
const TESTS_PER_CORNER: usize = 2000;

type Point = [f64; 2];

/// Appends the triangles of the polygon as indices into `corners`.
pub(crate) fn triangulate(corners: &[[f64; 3]], triangles: &mut Vec<[u32; 3]>) {
    let count = corners.len() as u32;
    if count >= 4 {
        let points = project(corners);
        if !is_convex(&points) {
            return clip_ears(&points, triangles);
        }
    }
    triangles.extend((2..count).map(|i| [0, i - 1, i]));
}

/// The corners along the two axes in which the polygon is largest, turning counterclockwise.
fn project(corners: &[[f64; 3]]) -> Vec<Point> {
    let normal = newell_normal(corners);
    let size = normal.map(f64::abs);
    let axis = if size[0] > size[1] && size[0] > size[2] {
        0
    } else if size[1] > size[2] {
        1
    } else {
        2
    };
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        std::mem::swap(&mut u, &mut v);
    }
    corners.iter().map(|c| [c[u], c[v]]).collect()
}

/// Twice the polygon's area as a vector. Relative to the first corner, to keep digits far from the origin.
fn newell_normal(corners: &[[f64; 3]]) -> [f64; 3] {
    let local = |i: usize| DVec3::from(corners[i % corners.len()]) - DVec3::from(corners[0]);
    (0..corners.len()).map(|i| local(i).cross(local(i + 1))).sum::<DVec3>().to_array()
}

/// Twice the area of a triangle, positive where it turns counterclockwise.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// True where no corner turns clockwise. Comparisons with NaN are false, so broken polygons count as convex.
fn is_convex(points: &[Point]) -> bool {
    let n = points.len();
    !(0..n).any(|i| turn(points[i], points[(i + 1) % n], points[(i + 2) % n]) < 0.0)
}

fn clip_ears(points: &[Point], triangles: &mut Vec<[u32; 3]>) {
    let mut left: Vec<u32> = (0..points.len() as u32).collect();
    let mut tests_left = points.len() * TESTS_PER_CORNER;
    let mut at = 0;
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).map(|step| (at + step) % n).find(|&i| is_ear(points, &left, i, &mut tests_left));
        // Without an ear the polygon crosses itself: then any corner that turns the right way, then any.
        let ear = ear.or_else(|| (0..n).find(|&i| corner_turn(points, &left, i) > 0.0)).unwrap_or(0);
        triangles.push(corner(&left, ear));
        left.remove(ear);
        at = ear;
    }
    triangles.push([left[0], left[1], left[2]]);
}

fn corner(left: &[u32], i: usize) -> [u32; 3] {
    let n = left.len();
    [left[(i + n - 1) % n], left[i], left[(i + 1) % n]]
}

fn corner_turn(points: &[Point], left: &[u32], i: usize) -> f64 {
    let [a, b, c] = corner(left, i).map(|k| points[k as usize]);
    turn(a, b, c)
}

/// True where the corner can be cut off: it turns counterclockwise and no other corner lies in its triangle. Corners
/// at the same place as one of the three do not count, since polygons with holes touch themselves.
fn is_ear(points: &[Point], left: &[u32], i: usize, tests_left: &mut usize) -> bool {
    let [a, b, c] = corner(left, i).map(|k| points[k as usize]);
    if *tests_left < left.len() || turn(a, b, c) <= 0.0 {
        return false;
    }
    *tests_left -= left.len();
    !left.iter().map(|&k| points[k as usize]).any(|p| {
        p != a && p != b && p != c && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
        let [x, y, z] = newell_normal(&[a, b, c]);
        0.5 * (x * x + y * y + z * z).sqrt()
    }

    /// The sum of unsigned areas equals the polygon's area only if triangles neither overlap nor leave it.
    fn check(flat: &[[f64; 2]]) {
        type Place = fn(&Point) -> [f64; 3];
        let places: [Place; 3] =
            [|p| [p[0], p[1], 5.0], |p| [1e6, p[0] + 2e6, p[1]], |p| [p[1], p[0], p[0] + p[1]]];
        for place in places {
            let corners: Vec<_> = flat.iter().map(place).collect();
            let mut triangles = Vec::new();
            triangulate(&corners, &mut triangles);
            assert_eq!(triangles.len(), corners.len() - 2);
            let sum: f64 =
                triangles.iter().map(|t| t.map(|i| corners[i as usize])).map(|[a, b, c]| area(a, b, c)).sum();
            let [x, y, z] = newell_normal(&corners);
            let whole = 0.5 * (x * x + y * y + z * z).sqrt();
            assert!((sum - whole).abs() <= 1e-9 * whole, "{sum} of {whole}: {triangles:?}");
        }
    }

    #[test]
    fn convex_polygons_become_fans() {
        let mut triangles = Vec::new();
        triangulate(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], &mut triangles);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        check(&[[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]]);
        check(&[[0.5, 0.5], [0.0, 2.0], [0.0, 0.0], [2.0, 0.0]]);
        check(&[
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [3.0, 4.0],
            [3.0, 1.0],
            [1.0, 1.0],
            [1.0, 4.0],
            [0.0, 4.0],
        ]);
        check(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5], [0.0, 2.0]]);
        let star: Vec<_> = (0..200)
            .map(|i| (i as f64 / 200.0 * std::f64::consts::TAU, if i % 2 == 0 { 1.0 } else { 0.3 }))
            .map(|(angle, radius)| [radius * angle.cos(), radius * angle.sin()])
            .collect();
        check(&star);
    }

    #[test]
    fn holes_joined_by_a_bridge_stay_open() {
        let (outer, inner) = (
            [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]],
            [[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]],
        );
        let mut ring = outer.to_vec();
        ring.push(outer[0]);
        ring.extend(inner);
        ring.push(inner[0]);
        check(&ring);
    }

    #[test]
    fn broken_polygons_still_give_n_minus_two() {
        let nan = [f64::NAN; 3];
        for corners in
            [vec![[0.0; 3]; 7], vec![nan; 5], vec![[0.0; 3], [1.0, 0.0, 0.0], nan, [0.0, 1.0, 0.0]]]
        {
            let mut triangles = Vec::new();
            triangulate(&corners, &mut triangles);
            assert_eq!(triangles.len(), corners.len() - 2);
        }
        let bow_tie = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.5, 0.0]];
        let mut triangles = Vec::new();
        triangulate(&bow_tie, &mut triangles);
        assert_eq!(triangles.len(), 3);
    }
}
