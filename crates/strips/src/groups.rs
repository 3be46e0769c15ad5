//! Groups of boxes that fill wide nodes, and a hierarchy over the groups.
//!
//! A ray tests all boxes of a node at once, so what a subtree costs is the nodes it needs, not the boxes: the
//! surface area heuristic here counts ⌈n / width⌉ nodes for n boxes. Splits that leave nodes half empty thereby
//! lose to those that fill them, unless they save area.

use crate::bvh::{Built, Bvh};
use raystrips_geom::Aabb;
use std::ops::Range;

/// What a node more than necessary costs, as a share of the area of the split group: its bytes. `docs/RESULTS.md`,
/// "Fuller nodes".
const EXTRA_NODE: f32 = 0.5;

/// Divides `bounds` into groups of at most `width` and builds a hierarchy whose leaves are the groups.
///
/// # Panics
/// If there are no boxes.
pub fn group(bounds: &[Aabb], width: usize) -> Built {
    assert!(!bounds.is_empty(), "no boxes");
    let count = bounds.len();
    let mut grouping = Grouping {
        bounds,
        width,
        order: (0..count as u32).collect(),
        sorted: [0, 1, 2].map(|axis| sorted(bounds, axis)),
        is_left: vec![false; count],
        right: Vec::with_capacity(count),
        costs: vec![0.0; count],
    };
    let tree = grouping.split(0..count);
    Built { tree, order: grouping.order }
}

/// The boxes by their centers on one axis.
fn sorted(bounds: &[Aabb], axis: usize) -> Vec<u32> {
    let center = |b: &Aabb| b.min[axis] + b.max[axis];
    // By the center, then by the number: both in one whole number, which is faster to compare.
    let key = |(i, b): (u32, &Aabb)| u64::from(ascending_bits(center(b))) << 32 | u64::from(i);
    let mut keys: Vec<u64> = (0..).zip(bounds).map(key).collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

/// Bits that ascend as the numbers do ([`f32::total_cmp`]).
fn ascending_bits(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

struct Grouping<'a> {
    bounds: &'a [Aabb],
    width: usize,
    /// As leaves name the boxes.
    order: Vec<u32>,
    /// By centers on each axis. What a node holds is in the same range of each.
    sorted: [Vec<u32>; 3],
    /// Which boxes of a node go to its first half, by number.
    is_left: Vec<bool>,
    /// Scratch for a second half.
    right: Vec<u32>,
    /// Costs of the splits at hand.
    costs: Vec<f32>,
}

impl Grouping<'_> {
    /// A hierarchy over `items`.
    fn split(&mut self, items: Range<usize>) -> Bvh {
        let of = |all: Aabb, &i: &u32| all.union(self.bounds[i as usize]);
        let bounds = self.order[items.clone()].iter().fold(Aabb::EMPTY, of);
        if items.len() <= self.width {
            return Bvh::Leaf { bounds, items };
        }
        let splits = [0, 1, 2].map(|axis| self.best_split(axis, items.clone(), bounds.half_area()));
        let axis = (1..3).fold(0, |best, axis| if splits[axis].0 < splits[best].0 { axis } else { best });
        let middle = splits[axis].1;
        self.part(axis, items.clone(), middle);
        let middle = items.start + middle;
        let left = self.split(items.start..middle);
        let right = self.split(middle..items.end);
        Bvh::Inner { bounds, children: Box::new([left, right]) }
    }

    /// Puts the first `middle` of `items` on `axis` before the others on all axes.
    fn part(&mut self, axis: usize, items: Range<usize>, middle: usize) {
        let chosen = &self.sorted[axis][items.clone()];
        for (place, &i) in chosen.iter().enumerate() {
            self.is_left[i as usize] = place < middle;
        }
        self.order[items.clone()].copy_from_slice(chosen);
        for other in (0..3).filter(|&other| other != axis) {
            let sorted = &mut self.sorted[other][items.clone()];
            self.right.clear();
            let mut left = 0;
            for k in 0..sorted.len() {
                let i = sorted[k];
                if self.is_left[i as usize] {
                    sorted[left] = i;
                    left += 1;
                } else {
                    self.right.push(i);
                }
            }
            sorted[left..].copy_from_slice(&self.right);
        }
    }

    /// The cost of the cheapest place to split `items` on an axis, and how many are before it.
    fn best_split(&mut self, axis: usize, items: Range<usize>, area: f32) -> (f32, usize) {
        let (items, width) = (&self.sorted[axis][items], self.width);
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
