//! Fewer parts instead of coarser ones (Cook, Halstead, Planck, Ryu 2007, "Stochastic Simplification of Aggregate
//! Detail"): what is made of very many small things, as foliage is, becomes fewer and larger ones.
//!
//! Parts are ranked by a hash, which has nothing to do with where they are or how they look, and those of the lowest ranks
//! stay. They grow about their centers such that the area of all stays what it was (section 3.1), though not without
//! bounds: rays should be stopped about where the real parts would stop them. Unlike in the paper there is no fading
//! from one level of detail to the next, and no contrast to keep.

use crate::{Parts, Piece};
use glam::{DVec3, Vec3};

/// Most by which the area of a part grows: leaves that grow by less let rays through that the real ones stop.
const MAX_GROWTH: f64 = 64.0;

/// How many of the small parts stay.
#[derive(Clone, Copy, Debug)]
pub struct Thinning {
    /// Parts of at most so many triangles are small.
    pub small_part: u32,
    /// Share of the triangles of small parts to keep.
    pub kept: f64,
}

/// Leaves out small parts of a piece that has not been simplified before. Parts with locked vertices stay, since they go
/// on in other pieces. At least one small part stays where there is one.
pub fn thin(piece: &mut Piece, thinning: Thinning) {
    let parts = Parts::of(piece.positions.len(), &piece.triangles);
    let small = small_parts(piece, &parts, thinning.small_part);
    let mut order: Vec<u32> = (0..parts.sizes.len() as u32).filter(|&part| small[part as usize]).collect();
    let ranks = ranks(piece, &parts);
    order.sort_unstable_by_key(|&part| (ranks[part as usize], part));
    let triangles: u64 = order.iter().map(|&part| u64::from(parts.sizes[part as usize])).sum();
    let enough = triangles as f64 * thinning.kept;
    let mut is_gone = vec![false; parts.sizes.len()];
    let mut kept = 0u64;
    for &part in &order {
        is_gone[part as usize] = kept > 0 && kept as f64 >= enough;
        if !is_gone[part as usize] {
            kept += u64::from(parts.sizes[part as usize]);
        }
    }
    if kept == triangles {
        return;
    }
    let growth = (triangles as f64 / kept as f64).min(MAX_GROWTH).sqrt();
    grow(piece, &parts, growth, |part| small[part as usize] && !is_gone[part as usize]);
    let mut of_triangle = parts.of_triangle.iter();
    let mut stays = || of_triangle.next().is_some_and(|&part| !is_gone[part as usize]);
    let stay: Vec<bool> = piece.triangles.iter().map(|_| stays()).collect();
    retain(&mut piece.triangles, &stay);
    retain(&mut piece.geometries, &stay);
    remove_unused(piece);
}

/// Removes vertices that no triangle has, except locked ones.
fn remove_unused(piece: &mut Piece) {
    let mut used = piece.locked.clone();
    used.resize(piece.positions.len(), false);
    piece.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    let mut numbers = vec![0; used.len()];
    let is_used = |&v: &usize| used[v];
    (0..used.len()).filter(is_used).zip(0..).for_each(|(v, number)| numbers[v] = number);
    piece.triangles.iter_mut().flatten().for_each(|v| *v = numbers[*v as usize]);
    retain(&mut piece.positions, &used);
    retain(&mut piece.quadrics, &used);
    retain(&mut piece.locked, &used);
    piece.positions.shrink_to_fit();
}

/// For each part whether it is small and not locked anywhere.
fn small_parts(piece: &Piece, parts: &Parts, most: u32) -> Vec<bool> {
    let mut small: Vec<bool> = parts.sizes.iter().map(|&size| size <= most).collect();
    for (triangle, &part) in piece.triangles.iter().zip(&parts.of_triangle) {
        if triangle.iter().any(|&v| piece.locked.get(v as usize) == Some(&true)) {
            small[part as usize] = false;
        }
    }
    small
}

/// A hash of each part: that of its vertex of the least hash. The same wherever and in whatever order it is.
fn ranks(piece: &Piece, parts: &Parts) -> Vec<u64> {
    let mut ranks = vec![u64::MAX; parts.sizes.len()];
    for (triangle, &part) in piece.triangles.iter().zip(&parts.of_triangle) {
        for &v in triangle {
            let rank = &mut ranks[part as usize];
            *rank = (*rank).min(hash(piece.positions[v as usize]));
        }
    }
    // The least of many hashes is small: parts of many vertices would come first.
    ranks.iter().map(|&rank| mix(rank)).collect()
}

fn hash(position: Vec3) -> u64 {
    position.to_array().iter().fold(0, |hash, x| mix(hash ^ u64::from(x.to_bits())))
}

/// Mixes all bits (Steele, Lea, Flood 2014, the finalizer of SplitMix).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}

/// Scales the parts that `grows` names about the means of their corners.
fn grow(piece: &mut Piece, parts: &Parts, by: f64, grows: impl Fn(u32) -> bool) {
    let mut sums = vec![DVec3::ZERO; parts.sizes.len()];
    for (triangle, &part) in piece.triangles.iter().zip(&parts.of_triangle) {
        sums[part as usize] +=
            triangle.iter().map(|&v| piece.positions[v as usize].as_dvec3()).sum::<DVec3>();
    }
    let mut is_done = vec![false; piece.positions.len()];
    for (triangle, &part) in piece.triangles.iter().zip(&parts.of_triangle).filter(|(_, part)| grows(**part))
    {
        let center = sums[part as usize] / (3.0 * f64::from(parts.sizes[part as usize]));
        for &v in triangle {
            if !std::mem::replace(&mut is_done[v as usize], true) {
                let position = &mut piece.positions[v as usize];
                *position = (center + (position.as_dvec3() - center) * by).as_vec3();
            }
        }
    }
}

fn retain<T>(items: &mut Vec<T>, stay: &[bool]) {
    let mut stay = stay.iter();
    items.retain(|_| stay.next() == Some(&true));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cloud of small triangles beside a strip of many triangles.
    fn cloud(count: u32) -> Piece {
        let at = |i: u32| Vec3::new((i % 37) as f32, (i / 37 % 41) as f32, (i * 7 % 29) as f32);
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for i in 0..count {
            let first = positions.len() as u32;
            let size = 0.1 + (i % 5) as f32 * 0.05;
            positions.extend([at(i), at(i) + Vec3::X * size, at(i) + Vec3::Y * size]);
            triangles.push([first, first + 1, first + 2]);
        }
        let first = positions.len() as u32;
        positions.extend((0..102).map(|i| Vec3::new(i as f32, (i % 2) as f32, -5.0)));
        triangles.extend((0..100).map(|i| [first + i, first + i + 1, first + i + 2]));
        Piece { geometries: vec![0; triangles.len()], positions, triangles, ..Piece::default() }
    }

    fn area(piece: &Piece) -> f64 {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| piece.positions[v as usize].as_dvec3());
            (b - a).cross(c - a).length() / 2.0
        };
        piece.triangles.iter().filter(|t| piece.positions[t[0] as usize].z >= 0.0).map(area).sum()
    }

    #[test]
    fn fewer_parts_of_the_same_area() {
        let whole = cloud(5000);
        let mut thinned = whole.clone();
        thin(&mut thinned, Thinning { small_part: 4, kept: 0.2 });
        assert_eq!(thinned.triangles.len(), 1000 + 100);
        assert_eq!(thinned.geometries.len(), thinned.triangles.len());
        assert!((area(&thinned) / area(&whole) - 1.0).abs() < 0.1, "{} {}", area(&thinned), area(&whole));
        // Spread as the parts are: a fifth in each quarter.
        let quarter = |piece: &Piece, q: u32| {
            let is_in = |t: &&[u32; 3]| {
                let p = piece.positions[t[0] as usize];
                p.z >= 0.0 && u32::from(p.x < 18.0) + 2 * u32::from(p.y < 20.0) == q
            };
            piece.triangles.iter().filter(is_in).count() as f64
        };
        for q in 0..4 {
            assert!((quarter(&thinned, q) / quarter(&whole, q) - 0.2).abs() < 0.04, "{q}");
        }
    }

    #[test]
    fn order_and_piece_do_not_matter_and_locked_parts_stay() {
        let mut a = cloud(1000);
        let mut b = a.clone();
        b.triangles.reverse();
        let thinning = Thinning { small_part: 4, kept: 0.1 };
        for piece in [&mut a, &mut b] {
            piece.locked = vec![false; piece.positions.len()];
            piece.locked[..30].fill(true);
            thin(piece, thinning);
        }
        b.triangles.reverse();
        assert_eq!(a.triangles, b.triangles);
        assert_eq!(a.positions, b.positions);
        assert!((0..10).all(|i| a.triangles.contains(&[3 * i, 3 * i + 1, 3 * i + 2])));
        assert_eq!(a.triangles.len(), 10 + 99 + 100);
    }
}
