//! What must hold for every mesh and target.

mod meshes;

use glam::Vec3;
use meshes::*;
use proptest::prelude::*;
use raystrips_simplify::{CostCurve, Piece, Simplified, Target, measure, simplify};

/// Simplifies, and checks what holds always.
fn checked(piece: &Piece, triangles: usize) -> Simplified {
    let simplified = simplify(piece.clone(), Target::triangles(triangles));
    let Piece { positions, triangles, geometries, locked, quadrics, .. } = &simplified.piece;
    assert_eq!(triangles.len(), geometries.len());
    assert_eq!(positions.len(), quadrics.len());
    assert_eq!(positions.len(), simplified.sources.len());
    assert!(locked.is_empty() || locked.len() == positions.len());
    assert!(simplified.sources.is_sorted_by(|a, b| a < b));
    assert!(triangles.iter().flatten().all(|&v| (v as usize) < positions.len()));
    assert!(triangles.iter().all(|[a, b, c]| a != b && b != c && c != a));
    assert!(positions.iter().all(|p| p.is_finite()));
    if open_edges(&distinct(&piece.triangles)) == 0 {
        assert_eq!(open_edges(triangles), 0, "closed meshes stay closed");
    }
    simplified
}

fn check_count(piece: &Piece, asked: usize) -> Simplified {
    let simplified = checked(piece, asked);
    let left = simplified.piece.triangles.len();
    assert!(left <= asked && left as f64 >= asked as f64 * 0.98 - 4.0, "{left} of {asked}");
    simplified
}

fn distance(a: &Piece, b: &Piece) -> raystrips_simplify::Distances {
    measure((&a.positions, &a.triangles), (&b.positions, &b.triangles), 20_000)
}

#[test]
fn the_count_is_reached_whatever_the_mesh() {
    for piece in [
        sphere(40),
        bumpy_grid(60),
        soup(3000, 1),
        tetrahedra(2000),
        fan(300),
        repeated(&sphere(20), 2),
        repeated(&bumpy_grid(20), 3),
        unwelded(&sphere(20)),
    ] {
        for part in [0.5, 0.1, 0.02] {
            let distinct = distinct(&piece.triangles).len() as f64;
            check_count(&piece, (distinct * part) as usize);
        }
        assert!(checked(&piece, 0).piece.triangles.is_empty());
    }
}

/// Each collapse looks at all triangles around it, so this ends only if no vertex comes to have all of them.
#[test]
fn many_triangles_at_a_vertex_take_no_longer() {
    check_count(&cone(200_000), 1000);
    // Here a collapse removes a hundred triangles.
    let left = checked(&tangle(100_000, 80_000), 2000).piece.triangles.len();
    assert!((1800..=2200).contains(&left), "{left}");
}

#[test]
fn a_copy_that_closes_a_fold_stays() {
    // A double triangle on each face of a tetrahedron would be one too many; here two more triangles go along its
    // edges the other way.
    let mut piece = tetrahedra(1);
    let [a, b, c] = piece.triangles[0];
    piece.triangles.extend([[a, b, c], [c, b, a]]);
    piece.geometries.extend([0; 2]);
    assert_eq!(open_edges(&piece.triangles), 0);
    assert_eq!(open_edges(&checked(&piece, usize::MAX).piece.triangles), 0);
    assert_eq!(
        checked(&repeated(&sphere(8), 3), usize::MAX).piece.triangles.len(),
        sphere(8).triangles.len()
    );
}

#[test]
fn the_error_of_a_sphere_rises_as_triangles_go() {
    let piece = sphere(60);
    let mut last = (0.0, 0.0);
    for asked in [3000, 1000, 300, 100, 30] {
        let simplified = check_count(&piece, asked);
        let mean = distance(&piece, &simplified.piece).mean;
        assert!(mean > last.0 && simplified.error > last.1, "{asked}: {mean}, {}", simplified.error);
        assert!(mean < 3.0 / asked as f64, "{asked}: {mean}");
        last = (mean, simplified.error);
    }
}

#[test]
fn a_flat_square_becomes_two_triangles() {
    let piece = grid(40, |_, _| 0.0);
    let simplified = check_count(&piece, 2);
    let distances = distance(&piece, &simplified.piece);
    assert!(distances.max < 1e-3, "{distances:?}");
    assert!(simplified.error < 1e-3, "{}", simplified.error);
}

#[test]
fn a_cost_is_kept_to() {
    let piece = sphere(40);
    let curve = checked(&piece, 100).curve;
    let max_cost = CostCurve::max_cost(&[curve], 600);
    let target = Target { triangles: 0, max_cost };
    let simplified = simplify(piece.clone(), target);
    let left = simplified.piece.triangles.len();
    assert!((600..700).contains(&left), "{left}");
    assert!(distance(&piece, &simplified.piece).max < 0.05);
    assert_eq!(simplify(simplified.piece.clone(), target).piece.triangles, simplified.piece.triangles);
}

#[test]
fn locked_vertices_stay() {
    let mut piece = bumpy_grid(40);
    let is_at_edge = |p: &Vec3| p.x == 0.0 || p.y == 0.0 || p.x == 1.0 || p.y == 1.0;
    piece.locked = piece.positions.iter().map(is_at_edge).collect();
    let simplified = checked(&piece, 0);
    let left: Vec<Vec3> = simplified.piece.positions.iter().copied().filter(is_at_edge).collect();
    let before: Vec<Vec3> = piece.positions.iter().copied().filter(is_at_edge).collect();
    assert_eq!(left, before);
    assert_eq!(open_edges(&simplified.piece.triangles), open_edges(&piece.triangles));
    let mut used = vec![false; left.len()];
    simplified.piece.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    assert!(used.into_iter().all(|used| used));
    for (v, &source) in simplified.sources.iter().enumerate() {
        assert_eq!(simplified.piece.locked[v], piece.locked[source as usize]);
    }
}

#[test]
fn halves_with_a_locked_seam_fit_and_quadrics_add_up() {
    let whole = sphere(30);
    let halves = [0, 1].map(|half| {
        let mut piece = whole.clone();
        let is_mine = |t: &[u32; 3]| {
            (t.iter().map(|&v| whole.positions[v as usize].z).sum::<f32>() < 0.0) == (half == 0)
        };
        piece.triangles.retain(is_mine);
        piece.geometries.truncate(piece.triangles.len());
        piece
    });
    let touches = |piece: &Piece, v: u32| piece.triangles.iter().flatten().any(|&w| w == v);
    let locked: Vec<bool> =
        (0..whole.positions.len() as u32).map(|v| halves.iter().all(|piece| touches(piece, v))).collect();
    let simplified = halves.map(|mut piece| {
        piece.locked = locked.clone();
        let asked = piece.triangles.len() / 4;
        simplify(piece, Target::triangles(asked))
    });
    let joined = join(&simplified);
    assert_eq!(open_edges(&joined.triangles), 0);
    let weight: f64 = joined.quadrics.iter().map(|q| f64::from(q.weight())).sum();
    let area = std::f64::consts::PI * 4.0;
    assert!((weight - area).abs() < 0.05 * area, "{weight} of {area}");
    let again = check_count(&joined, joined.triangles.len() / 4);
    assert!(distance(&whole, &again.piece).max < 0.1);
}

#[test]
fn the_border_of_materials_stays() {
    let mut piece = bumpy_grid(60);
    let geometry = |t: &[u32; 3]| {
        let x: f32 = t.iter().map(|&v| piece.positions[v as usize].x).sum();
        u32::from(x / 3.0 > 0.5)
    };
    piece.geometries = piece.triangles.iter().map(geometry).collect();
    let simplified = check_count(&piece, piece.triangles.len() / 50).piece;
    for geometry in [0, 1] {
        let [before, after] = [&piece, &simplified].map(|p| only(p, geometry));
        assert!(distance(&before, &after).max < 0.05, "{geometry}: {:?}", distance(&before, &after));
    }
}

#[test]
fn twice_the_same() {
    for piece in [sphere(30), soup(500, 3), tetrahedra(100)] {
        let [a, b] = [0, 1].map(|_| checked(&piece, piece.triangles.len() / 10));
        assert_eq!(a.piece.positions, b.piece.positions);
        assert_eq!(a.piece.triangles, b.piece.triangles);
        assert_eq!(a.piece.quadrics, b.piece.quadrics);
    }
}

#[test]
fn nothing_is_simplified_to_nothing() {
    assert!(checked(&Piece::default(), 0).piece.positions.is_empty());
}

proptest! {
    #[test]
    fn any_triangles_over_few_vertices(
        triangles in prop::collection::vec(prop::array::uniform3(0u32..12), 0..80),
        places in prop::collection::vec(prop::array::uniform3(-2i8..3), 12),
        locked in prop::collection::vec(prop::bool::weighted(0.2), 12),
        asked in 0usize..40,
    ) {
        let positions = places.iter().map(|p| Vec3::from_array(p.map(f32::from))).collect();
        let geometries = triangles.iter().map(|t| t[0] % 2).collect();
        let mut piece = Piece { positions, triangles, geometries, ..Piece::default() };
        let whole = checked(&piece, usize::MAX).piece.triangles.len();
        let left = checked(&piece, asked).piece.triangles.len();
        // No collapse here removes more than all triangles of an edge and those that fall on one another.
        prop_assert!(left <= asked + if asked == 0 { 0 } else { 20 }, "{left} of {asked}");
        prop_assert_eq!(left == 0, asked == 0 || whole == 0);
        piece.locked = locked;
        checked(&piece, asked);
    }

    #[test]
    fn a_far_away_origin_changes_little(x in -1000.0f64..1000.0) {
        let mut piece = sphere(12);
        let near = checked(&piece, 60);
        piece.origin.x = x;
        let far = checked(&piece, 60);
        prop_assert!((near.error - far.error).abs() < 1e-2);
    }
}
