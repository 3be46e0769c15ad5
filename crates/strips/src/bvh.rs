//! A binary hierarchy of boxes by the surface area heuristic, binned (Wald 2007).
//!
//! Knows boxes only: what they hold, and when a group of them is small enough, is the caller's.

use rayon::join;
use raystrips_geom::Aabb;
use std::ops::Range;

/// Bins a axis.
const BINS: usize = 16;
/// Below this many boxes a branch is not worth a thread.
const PARALLEL_MIN: usize = 8192;
/// Splits on one path before groups are halved by count: bounds the depth for inputs that the heuristic cannot
/// split well.
const MAX_SAH_DEPTH: usize = 40;

/// A hierarchy over a range of items.
#[derive(Clone, Debug)]
pub enum Bvh {
    /// Items that stay together.
    Leaf {
        /// Box around them.
        bounds: Aabb,
        /// Which.
        items: Range<usize>,
    },
    /// Two halves.
    Inner {
        /// Box around both.
        bounds: Aabb,
        /// The halves, in the order of their items.
        children: Box<[Bvh; 2]>,
    },
}

/// A hierarchy with the order in which its leaves name the boxes.
pub struct Built {
    /// The hierarchy; leaves are ranges of `order`.
    pub tree: Bvh,
    /// Numbers of the boxes.
    pub order: Vec<u32>,
}

impl Bvh {
    /// Box around everything below.
    pub fn bounds(&self) -> Aabb {
        match self {
            Bvh::Leaf { bounds, .. } | Bvh::Inner { bounds, .. } => *bounds,
        }
    }

    /// Both below one node; items stay as they are.
    pub fn join(a: Bvh, b: Bvh) -> Bvh {
        Bvh::Inner { bounds: a.bounds().union(b.bounds()), children: Box::new([a, b]) }
    }

    /// The same hierarchy with others in place of the leaves, visited from first to last. Their items are numbered
    /// from 0 and become those after the items of the leaf before.
    pub fn graft(self, f: &mut impl FnMut(Aabb, Range<usize>) -> Bvh) -> Bvh {
        self.graft_from(&mut 0, f)
    }

    fn graft_from(self, next: &mut usize, f: &mut impl FnMut(Aabb, Range<usize>) -> Bvh) -> Bvh {
        match self {
            Bvh::Leaf { bounds, items } => {
                let graft = f(bounds, items);
                let first = *next;
                *next += graft.items().end;
                graft.renumber(first)
            }
            Bvh::Inner { bounds, children } => {
                let [a, b] = *children;
                let a = a.graft_from(next, f);
                Bvh::Inner { bounds, children: Box::new([a, b.graft_from(next, f)]) }
            }
        }
    }

    /// The same hierarchy with items counted from `first` instead of 0.
    fn renumber(self, first: usize) -> Bvh {
        match self {
            Bvh::Leaf { bounds, items } => {
                Bvh::Leaf { bounds, items: items.start + first..items.end + first }
            }
            Bvh::Inner { bounds, children } => {
                Bvh::Inner { bounds, children: Box::new((*children).map(|c| c.renumber(first))) }
            }
        }
    }

    /// Its leaves, from first to last.
    pub fn leaves(&self) -> Vec<Range<usize>> {
        match self {
            Bvh::Leaf { items, .. } => vec![items.clone()],
            Bvh::Inner { children, .. } => children.iter().flat_map(Bvh::leaves).collect(),
        }
    }

    /// Boxes of its leaves, from first to last.
    pub fn leaf_bounds(&self) -> Vec<Aabb> {
        match self {
            Bvh::Leaf { bounds, .. } => vec![*bounds],
            Bvh::Inner { children, .. } => children.iter().flat_map(Bvh::leaf_bounds).collect(),
        }
    }

    /// The same hierarchy with leaf number *i* holding item *i* alone.
    pub fn number_leaves(self) -> Bvh {
        self.graft(&mut |bounds, _| Bvh::Leaf { bounds, items: 0..1 })
    }

    /// Up to `width` subtrees that together hold everything, in the order of their items: the largest for which
    /// `may_open` holds is opened first, so that a ray has the best chance to miss several at once. Leaves stay
    /// whole.
    pub fn open(&self, width: usize, may_open: impl Fn(&Bvh) -> bool) -> Vec<&Bvh> {
        let mut open = vec![self];
        while open.len() < width {
            let candidates =
                (0..open.len()).filter(|&i| matches!(open[i], Bvh::Inner { .. }) && may_open(open[i]));
            let area = |i: usize| open[i].bounds().half_area();
            let Some(largest) = candidates.max_by(|&i, &j| area(i).total_cmp(&area(j)).then(j.cmp(&i)))
            else {
                break;
            };
            let Bvh::Inner { children, .. } = open[largest] else { break };
            open.splice(largest..=largest, children.iter());
        }
        open
    }

    /// The items below.
    pub fn items(&self) -> Range<usize> {
        match self {
            Bvh::Leaf { items, .. } => items.clone(),
            Bvh::Inner { children, .. } => children[0].items().start..children[1].items().end,
        }
    }
}

/// A box and its number.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    id: u32,
}

/// Builds a hierarchy over `bounds`. Groups for which `is_leaf` holds are not split; groups of one never are.
/// The result does not depend on the number of threads.
///
/// # Panics
/// If there are no boxes or more than 2^32.
pub fn build(bounds: &[Aabb], is_leaf: &(dyn Fn(&[u32]) -> bool + Sync)) -> Built {
    build_weighted(bounds, &|_| 1, 1, is_leaf)
}

/// The same over boxes that stand for `weight` things each, with at least `least` of them on both sides of a split
/// where that can be.
///
/// # Panics
/// If there are no boxes or more than 2^32.
pub fn build_weighted(
    bounds: &[Aabb],
    weight: &(impl Fn(u32) -> u64 + Sync),
    least: u64,
    is_leaf: &(dyn Fn(&[u32]) -> bool + Sync),
) -> Built {
    assert!(!bounds.is_empty() && bounds.len() <= u32::MAX as usize, "{} boxes", bounds.len());
    let mut items: Vec<Item> = bounds.iter().zip(0..).map(|(&bounds, id)| Item { bounds, id }).collect();
    let mut order = vec![0; items.len()];
    let tree = build_range(&mut items, &mut order, 0, 0, &Splits { weight, least, is_leaf });
    Built { tree, order }
}

/// What decides on splits.
struct Splits<'a, W> {
    weight: &'a W,
    /// Weight wanted on both sides.
    least: u64,
    is_leaf: &'a (dyn Fn(&[u32]) -> bool + Sync),
}

/// Builds over `items`, which are items `first..` of all, and writes their final order to `order`.
fn build_range<W: Fn(u32) -> u64 + Sync>(
    items: &mut [Item],
    order: &mut [u32],
    first: usize,
    depth: usize,
    splits: &Splits<W>,
) -> Bvh {
    for (slot, item) in order.iter_mut().zip(items.iter()) {
        *slot = item.id;
    }
    let bounds = items.iter().fold(Aabb::EMPTY, |all, item| all.union(item.bounds));
    if items.len() == 1 || (splits.is_leaf)(order) {
        return Bvh::Leaf { bounds, items: first..first + items.len() };
    }
    let middle = if depth < MAX_SAH_DEPTH { partition_by_area(items, splits) } else { None };
    let middle = middle.unwrap_or_else(|| partition_by_count(items));
    let parallel = items.len() >= PARALLEL_MIN;
    let (left, right) = items.split_at_mut(middle);
    let (left_order, right_order) = order.split_at_mut(middle);
    let mut build_left = || build_range(left, left_order, first, depth + 1, splits);
    let mut build_right = || build_range(right, right_order, first + middle, depth + 1, splits);
    let (left, right) = if parallel { join(build_left, build_right) } else { (build_left(), build_right()) };
    Bvh::Inner { bounds, children: Box::new([left, right]) }
}

/// What falls into one bin.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    weight: u64,
}

const EMPTY_BIN: Bin = Bin { bounds: Aabb::EMPTY, weight: 0 };

impl Bin {
    fn merge(self, other: Bin) -> Bin {
        Bin { bounds: self.bounds.union(other.bounds), weight: self.weight + other.weight }
    }

    fn cost(&self) -> f32 {
        if self.weight == 0 { 0.0 } else { self.bounds.half_area() * self.weight as f32 }
    }
}

/// Maps centers of boxes to bins along one axis.
#[derive(Clone, Copy)]
struct Binning {
    axis: usize,
    min: f32,
    scale: f32,
}

impl Binning {
    /// `None` where all centers coincide.
    fn new(centers: &Aabb, axis: usize) -> Option<Binning> {
        let extent = centers.max[axis] - centers.min[axis];
        let scale = BINS as f32 / extent;
        (extent > 0.0 && scale.is_finite()).then_some(Binning { axis, min: centers.min[axis], scale })
    }

    #[inline]
    fn bin(&self, bounds: &Aabb) -> usize {
        let center = (bounds.min[self.axis] + bounds.max[self.axis]) * 0.5;
        (((center - self.min) * self.scale) as usize).min(BINS - 1)
    }
}

/// Splits where the surface area heuristic says, and gives the size of the left part. `None` if no plane
/// between bins separates anything.
fn partition_by_area<W: Fn(u32) -> u64>(items: &mut [Item], splits: &Splits<W>) -> Option<usize> {
    let centers = items.iter().fold(Aabb::EMPTY, |all, i| all.grow((i.bounds.min + i.bounds.max) * 0.5));
    let binnings: Vec<Binning> = (0..3).filter_map(|axis| Binning::new(&centers, axis)).collect();
    let mut bins = [[EMPTY_BIN; BINS]; 3];
    for item in items.iter() {
        for binning in &binnings {
            let bin = &mut bins[binning.axis][binning.bin(&item.bounds)];
            bin.bounds = bin.bounds.union(item.bounds);
            bin.weight += (splits.weight)(item.id);
        }
    }
    let best = |least| {
        let candidates = binnings.iter().filter_map(|b| {
            let (cost, plane) = best_plane(&bins[b.axis], least)?;
            Some((cost, plane, *b))
        });
        candidates.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let (_, plane, binning) = best(splits.least).or_else(|| best(1))?;
    let middle = partition(items, |item| binning.bin(&item.bounds) < plane);
    (middle > 0 && middle < items.len()).then_some(middle)
}

/// The cheapest of the planes between bins that leave `least` on both sides: its cost and the first bin right of it.
fn best_plane(bins: &[Bin; BINS], least: u64) -> Option<(f32, usize)> {
    let mut right = [EMPTY_BIN; BINS + 1];
    for i in (0..BINS).rev() {
        right[i] = right[i + 1].merge(bins[i]);
    }
    let mut left = EMPTY_BIN;
    let mut best: Option<(f32, usize)> = None;
    for plane in 1..BINS {
        left = left.merge(bins[plane - 1]);
        if left.weight < least || right[plane].weight < least {
            continue;
        }
        let cost = left.cost() + right[plane].cost();
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, plane));
        }
    }
    best
}

/// Halves by count along the widest axis of the centers.
fn partition_by_count(items: &mut [Item]) -> usize {
    let centers = items.iter().fold(Aabb::EMPTY, |all, i| all.grow((i.bounds.min + i.bounds.max) * 0.5));
    let axis = centers.extent().max_position();
    let middle = items.len() / 2;
    let key = |i: &Item| i.bounds.min[axis] + i.bounds.max[axis];
    items.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.id.cmp(&b.id)));
    middle
}

/// Brings the items for which `is_left` holds to the front and gives their number. Not stable, but the same
/// for the same input.
fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let mut left = 0;
    let mut right = items.len();
    while left < right {
        if is_left(&items[left]) {
            left += 1;
        } else {
            right -= 1;
            items.swap(left, right);
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    fn check(tree: &Bvh, bounds: &[Aabb], order: &[u32], depth: usize) -> usize {
        assert!(depth < MAX_SAH_DEPTH + 33);
        match tree {
            Bvh::Leaf { bounds: b, items } => {
                assert!(!items.is_empty());
                assert!(order[items.clone()].iter().all(|&i| b.contains(&bounds[i as usize])));
                items.len()
            }
            Bvh::Inner { bounds: b, children } => {
                assert!(children.iter().all(|c| b.contains(&c.bounds())));
                children.iter().map(|c| check(c, bounds, order, depth + 1)).sum()
            }
        }
    }

    proptest! {
        #[test]
        fn holds_every_box_once(points in prop::collection::vec(prop::array::uniform3(-1e30f32..1e30), 1..300), same in 0usize..50) {
            let mut bounds: Vec<Aabb> = points.iter().map(|&p| Aabb::EMPTY.grow(Vec3::from_array(p))).collect();
            bounds.extend(std::iter::repeat_n(bounds[0], same));
            let built = build(&bounds, &|items| items.len() <= 3);
            prop_assert_eq!(check(&built.tree, &bounds, &built.order, 0), bounds.len());
            let mut sorted = built.order.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, (0..bounds.len() as u32).collect::<Vec<_>>());
        }
    }

    #[test]
    fn opens_to_width() {
        let bounds: Vec<Aabb> = (0..20).map(|i| Aabb::EMPTY.grow(Vec3::splat(i as f32))).collect();
        let built = build(&bounds, &|_| false);
        assert_eq!(built.tree.open(8, |_| true).len(), 8);
        assert_eq!(built.tree.open(100, |_| true).len(), 20);
        assert_eq!(built.tree.open(8, |_| false).len(), 1);
        assert_eq!(built.tree.items(), 0..20);
    }
}
