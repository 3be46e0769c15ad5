//! Which child of a node goes to which of its eight places.
//!
//! Place *i* stands for the octant with the upper side of axis *k* where bit *k* of *i* is set. With children where
//! they belong, a ray meets them about in the order of place XOR its own octant (Garanzha and Loop 2010; the slot
//! assignment of Ylitie, Karras and Laine 2017), so that no tracer needs to sort them.

use glam::Vec3;
use raystrips_geom::Aabb;
use raystrips_pack::layout::WIDTH;

/// Places for children with these boxes. Greedy: the pair of child and place that fits best is settled first.
pub(crate) fn places(bounds: &[Aabb]) -> Vec<usize> {
    let center = bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(*b)).center();
    let mut pairs: Vec<(f32, usize, usize)> = Vec::with_capacity(bounds.len() * WIDTH);
    for (child, b) in bounds.iter().enumerate() {
        let outward = b.center() - center;
        pairs.extend((0..WIDTH).map(|place| (outward.dot(direction(place)), child, place)));
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut places = vec![None; bounds.len()];
    let mut taken = [false; WIDTH];
    for (_, child, place) in pairs {
        if places[child].is_none() && !taken[place] {
            places[child] = Some(place);
            taken[place] = true;
        }
    }
    places.into_iter().map(|place| place.expect("there are as many places as children at least")).collect()
}

/// Diagonal of an octant.
fn direction(place: usize) -> Vec3 {
    let side = |axis: usize| if place >> axis & 1 == 1 { 1.0 } else { -1.0 };
    Vec3::new(side(0), side(1), side(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_go_to_their_octants() {
        let at = |p: Vec3| Aabb { min: p - 0.1, max: p + 0.1 };
        let bounds: Vec<Aabb> = [5, 2, 7, 0].map(|place| at(direction(place))).into();
        assert_eq!(places(&bounds), [5, 2, 7, 0]);
        let same = vec![at(Vec3::ONE); WIDTH];
        let mut all = places(&same);
        all.sort_unstable();
        assert_eq!(all, (0..WIDTH).collect::<Vec<_>>());
    }
}
