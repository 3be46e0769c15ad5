//! Groups of boxes that fill wide nodes, and a hierarchy over the groups.
//!
//! A ray tests all boxes of a node at once, so what a subtree costs is the nodes it needs, not the boxes: the
//! surface area heuristic here counts ⌈n / width⌉ nodes for n boxes. Splits that leave nodes half empty thereby
//! lose to those that fill them, unless they save area.

use crate::bvh::{Built, Bvh};
use raystrips_geom::Aabb;

/// What a node more than necessary costs, as a share of the area of the split group: its bytes. `docs/RESULTS.md`,
/// "Fuller nodes".
const EXTRA_NODE: f32 = 0.5;

/// Divides `bounds` into groups of at most `width` and builds a hierarchy whose leaves are the groups.
///
/// # Panics
/// If there are no boxes.
pub fn group(bounds: &[Aabb], width: usize) -> Built {
    assert!(!bounds.is_empty(), "no boxes");
    let mut order: Vec<u32> = (0..bounds.len() as u32).collect();
    let ranks = [0, 1, 2].map(|axis| ranks(bounds, axis));
    let costs = vec![0.0; bounds.len()];
    let tree = Grouping { bounds, width, ranks, costs }.split(&mut order, 0);
    Built { tree, order }
}

/// The place of each box among all by its center on one axis.
fn ranks(bounds: &[Aabb], axis: usize) -> Vec<u32> {
    let center = |i: u32| bounds[i as usize].min[axis] + bounds[i as usize].max[axis];
    let mut order: Vec<u32> = (0..bounds.len() as u32).collect();
    order.sort_unstable_by(|&a, &b| center(a).total_cmp(&center(b)).then(a.cmp(&b)));
    let mut ranks = vec![0; bounds.len()];
    order.iter().zip(0..).for_each(|(&i, rank)| ranks[i as usize] = rank);
    ranks
}

struct Grouping<'a> {
    bounds: &'a [Aabb],
    width: usize,
    /// On each axis.
    ranks: [Vec<u32>; 3],
    /// Costs of the splits at hand.
    costs: Vec<f32>,
}

impl Grouping<'_> {
    /// A hierarchy over `items`, which are items `first..` of all.
    fn split(&mut self, items: &mut [u32], first: usize) -> Bvh {
        let bounds = items.iter().fold(Aabb::EMPTY, |all, &i| all.union(self.bounds[i as usize]));
        if items.len() <= self.width {
            return Bvh::Leaf { bounds, items: first..first + items.len() };
        }
        let mut best: Option<(f32, usize, usize)> = None;
        for axis in 0..3 {
            self.sort(items, axis);
            let (cost, middle) = self.best_split(items, bounds.half_area());
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, middle));
            }
        }
        let (_, axis, middle) = best.expect("three axes were tried");
        self.sort(items, axis);
        let (left, right) = items.split_at_mut(middle);
        let left = self.split(left, first);
        let right = self.split(right, first + middle);
        Bvh::Inner { bounds, children: Box::new([left, right]) }
    }

    fn sort(&self, items: &mut [u32], axis: usize) {
        items.sort_unstable_by_key(|&i| self.ranks[axis][i as usize]);
    }

    /// The cheapest place to split `items` in their order, and its cost.
    fn best_split(&mut self, items: &[u32], area: f32) -> (f32, usize) {
        let width = self.width;
        let nodes = |n: usize| n.div_ceil(width);
        let cost = |n: usize, bounds: &Aabb| bounds.half_area() * nodes(n) as f32;
        let costs = &mut self.costs;
        let mut right = Aabb::EMPTY;
        for i in (1..items.len()).rev() {
            right = right.union(self.bounds[items[i] as usize]);
            costs[i] = cost(items.len() - i, &right);
        }
        let mut left = Aabb::EMPTY;
        for i in 1..items.len() {
            left = left.union(self.bounds[items[i - 1] as usize]);
            let extra = nodes(i) + nodes(items.len() - i) - nodes(items.len());
            costs[i] += cost(i, &left) + extra as f32 * EXTRA_NODE * area;
        }
        // Boxes so small or thin that they have no area all cost the same.
        let uneven = |i: usize| (nodes(i) + nodes(items.len() - i), i.abs_diff(items.len() - i));
        let order = |&a: &usize, &b: &usize| costs[a].total_cmp(&costs[b]).then(uneven(a).cmp(&uneven(b)));
        let best = (1..items.len()).min_by(order);
        let best = best.expect("more than one item");
        (costs[best], best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    #[test]
    fn a_row_fills_its_groups() {
        let bounds: Vec<Aabb> = (0..61).map(|i| Aabb::EMPTY.grow(Vec3::new(i as f32, 0.0, 0.0))).collect();
        let built = group(&bounds, 8);
        assert_eq!(built.tree.leaves().len(), 8);
    }

    proptest! {
        #[test]
        fn every_box_is_in_one_group(points in prop::collection::vec(prop::array::uniform3(-1e3f32..1e3), 1..200)) {
            let bounds: Vec<Aabb> = points.iter().map(|&p| Aabb::EMPTY.grow(Vec3::from_array(p))).collect();
            let built = group(&bounds, 8);
            let mut end = 0;
            for leaf in built.tree.leaves() {
                prop_assert_eq!(leaf.start, end);
                prop_assert!((1..=8).contains(&leaf.len()));
                end = leaf.end;
            }
            let mut sorted = built.order.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, (0..bounds.len() as u32).collect::<Vec<_>>());
        }
    }
}
