//! The triangles of a cell of marching cubes, for each of the 256 ways in which its corners are inside or outside.
//!
//! The table is computed, not copied: on each face of the cube, inside corners that are not neighbors are kept
//! apart. Both cells at a face see the same corners and draw the same lines, so that the surface has no holes; the
//! lines of six faces make closed loops, which are cut into triangles.
//!
//! Corner *c* is at (*c* & 1, *c* >> 1 & 1, *c* >> 2). Edge *e* runs along axis *e* / 4 from the corner whose other
//! two coordinates are the bits of *e* % 4, the lower axis first.

/// Triangles as edges of the cube, for a mask of inside corners.
pub type CaseTable = Vec<Vec<[u8; 3]>>;

/// Computes all cases.
pub fn case_table() -> CaseTable {
    (0..=255).map(triangles).collect()
}

/// The corners at the ends of an edge.
pub fn edge_corners(edge: u8) -> [u8; 2] {
    let axis = edge / 4;
    let [low, high] = other_axes(axis);
    let begin = (edge & 1) << low | (edge >> 1 & 1) << high;
    [begin, begin | 1 << axis]
}

fn other_axes(axis: u8) -> [u8; 2] {
    [[1, 2], [0, 2], [0, 1]][usize::from(axis)]
}

fn edge_between(a: u8, b: u8) -> u8 {
    let axis = (a ^ b).trailing_zeros() as u8;
    let [low, high] = other_axes(axis);
    axis * 4 + (a >> low & 1) + (a >> high & 1) * 2
}

fn triangles(inside: u8) -> Vec<[u8; 3]> {
    let mut next = [None; 12];
    (0..6).for_each(|face| draw_lines(face, inside, &mut next));
    let mut out = Vec::new();
    for begin in 0..12 {
        let mut corners = Vec::new();
        let mut edge = begin;
        while let Some(following) = next[usize::from(edge)].take() {
            corners.push(edge);
            edge = following;
        }
        if !corners.is_empty() {
            out.extend(cut(&corners).expect("no loop has all its diagonals in faces"));
        }
    }
    out
}

/// Adds a line for each run of inside corners around a face.
fn draw_lines(face: u8, inside: u8, next: &mut [Option<u8>; 12]) {
    let corners = face_corners(face);
    let is_inside = |i: usize| inside >> corners[i % 4] & 1 == 1;
    let edge = |i: usize| edge_between(corners[i % 4], corners[(i + 1) % 4]);
    for leave in (0..4).filter(|&i| is_inside(i) && !is_inside(i + 1)) {
        let enter = (leave + 1..leave + 4).rev().find(|&i| is_inside(i + 1) && !is_inside(i));
        if let Some(enter) = enter {
            next[usize::from(edge(enter))] = Some(edge(leave));
        }
    }
}

/// Corners of a face in the order around it, the same turn for all faces seen from outside.
fn face_corners(face: u8) -> [u8; 4] {
    let (axis, side) = (face / 2, face % 2);
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3].map(|a| 1 << a);
    let around = if side == 1 { [0, u, u | v, v] } else { [0, v, u | v, u] };
    around.map(|corner| corner | side << axis)
}

/// Triangles of a loop. A diagonal in a face of the cube might be a diagonal of the next cell too, and an edge of
/// four triangles; so none is.
fn cut(corners: &[u8]) -> Option<Vec<[u8; 3]>> {
    if let [a, b, c] = *corners {
        return Some(vec![[a, b, c]]);
    }
    (0..corners.len()).find_map(|ear| {
        let count = corners.len();
        let [before, after] = [corners[(ear + count - 1) % count], corners[(ear + 1) % count]];
        let mut rest = corners.to_vec();
        let tip = rest.remove(ear);
        let mut triangles = (!share_a_face(before, after)).then(|| cut(&rest))??;
        triangles.push([before, tip, after]);
        Some(triangles)
    })
}

fn share_a_face(a: u8, b: u8) -> bool {
    let corners = [edge_corners(a), edge_corners(b)].concat();
    (0..3).any(|axis| corners.iter().all(|c| c >> axis & 1 == corners[0] >> axis & 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_numbered_as_they_are_found() {
        for edge in 0..12 {
            let [a, b] = edge_corners(edge);
            assert_eq!((edge_between(a, b), edge_between(b, a)), (edge, edge));
        }
    }

    #[test]
    fn every_crossed_edge_is_used_and_no_other() {
        for (inside, triangles) in case_table().iter().enumerate() {
            let used = triangles.iter().flatten().fold(0, |mask, edge| mask | 1 << edge);
            let crossed = |e: &u8| edge_corners(*e).map(|c| inside >> c & 1).iter().sum::<usize>() == 1;
            let crossed = (0..12).filter(crossed).fold(0, |mask: u16, edge| mask | 1 << edge);
            assert_eq!(used, crossed, "{inside:08b}");
        }
    }

    #[test]
    fn fronts_look_out() {
        let middle = |edge: u8| {
            let [a, b] = edge_corners(edge);
            glam::Vec3::from_array([0, 1, 2].map(|axis| f32::from((a >> axis & 1) + (b >> axis & 1)) * 0.5))
        };
        let table = case_table();
        assert_eq!(table[1].len(), 1);
        let [a, b, c] = table[1][0].map(middle);
        assert!((b - a).cross(c - a).dot(glam::Vec3::ONE) > 0.0);
    }
}
