//! How many triangles a simplification leaves, by the cost of its collapses.
//!
//! Costs come in classes, within which they differ by at most 1/16.

/// Bits of an `f64` below those that tell the class: sign, exponent and four bits of the mantissa remain.
const DROPPED_BITS: u32 = 48;
/// Costs are not negative, so the sign is not needed.
pub(crate) const CLASSES: usize = 1 << (63 - DROPPED_BITS);

/// The class of a cost that is not negative.
pub(crate) fn class(cost: f64) -> usize {
    (cost.abs().to_bits() >> DROPPED_BITS) as usize
}

/// How many triangles were left when collapses up to some class of cost were done.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CostCurve {
    begin: u32,
    /// Classes in ascending order, each with the triangles that were left before a collapse of a higher one.
    steps: Vec<(u16, u32)>,
}

impl CostCurve {
    pub(crate) fn beginning_with(triangles: usize) -> CostCurve {
        CostCurve { begin: triangles as u32, steps: Vec::new() }
    }

    /// Notes that a collapse of this cost has left so many triangles. One that costs less than an earlier one could not
    /// have been done before that.
    pub(crate) fn record(&mut self, cost: f64, left: usize) {
        let class = class(cost) as u16;
        match self.steps.last_mut() {
            Some(last) if last.0 >= class => last.1 = left as u32,
            _ => self.steps.push((class, left as u32)),
        }
    }

    /// Triangles that are left when all collapses of classes below `class` are done.
    fn left_below(&self, class: u16) -> u64 {
        let steps = self.steps.partition_point(|step| step.0 < class);
        steps.checked_sub(1).map_or(self.begin, |last| self.steps[last].1).into()
    }

    /// The least cost that no collapse may have for `curves` to be left with `triangles` or a little more. All collapses
    /// of the curves are allowed if that still leaves more.
    pub fn max_cost(curves: &[CostCurve], triangles: u64) -> f64 {
        match CostCurve::last_class(curves, triangles) {
            Some(class) => f64::from_bits(u64::from(class) << DROPPED_BITS),
            None => f64::INFINITY,
        }
    }

    /// Divides `triangles` among the meshes of `curves` such that what is collapsed costs about the same in all of them:
    /// how many each keeps.
    pub fn divide(curves: &[CostCurve], triangles: u64) -> Vec<u64> {
        let left_below = |class: u16| curves.iter().map(|c| c.left_below(class)).collect::<Vec<u64>>();
        // Beyond what the curves can tell all lose the same share.
        let (low, high) = match CostCurve::last_class(curves, triangles) {
            Some(class) => (left_below(class + 1), left_below(class)),
            None => (vec![0; curves.len()], left_below(u16::MAX)),
        };
        let [low_sum, high_sum] = [&low, &high].map(|counts| counts.iter().sum::<u64>());
        let part = triangles.saturating_sub(low_sum) as f64 / (high_sum - low_sum).max(1) as f64;
        // Rounded such that the sum is right.
        let (mut sum, mut divided) = (0.0, 0);
        let share = |(&low, &high): (&u64, &u64)| {
            sum += low as f64 + part.min(1.0) * (high - low) as f64;
            let share = (sum.round() as u64).saturating_sub(divided);
            divided += share;
            share
        };
        low.iter().zip(&high).map(share).collect()
    }

    /// The class of which some collapses are to be done, and all of those below, for `triangles` to be left; `None` if all
    /// collapses leave more.
    fn last_class(curves: &[CostCurve], triangles: u64) -> Option<u16> {
        let mut classes: Vec<u16> = curves.iter().flat_map(|c| &c.steps).map(|step| step.0).collect();
        classes.sort_unstable();
        classes.dedup();
        let left_after = |&class: &u16| curves.iter().map(|curve| curve.left_below(class + 1)).sum::<u64>();
        let first = classes.partition_point(|class| left_after(class) > triangles);
        classes.get(first).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(begin: usize, collapses: &[(f64, usize)]) -> CostCurve {
        let mut curve = CostCurve::beginning_with(begin);
        collapses.iter().for_each(|&(cost, left)| curve.record(cost, left));
        curve
    }

    #[test]
    fn cheap_collapses_after_dear_ones_are_dear() {
        let curve = curve(10, &[(1.0, 9), (4.0, 8), (2.0, 6), (8.0, 5)]);
        let left = [0.5, 1.0, 2.0, 4.0, 5.0, 9.0].map(|cost| curve.left_below(class(cost) as u16));
        assert_eq!(left, [10, 10, 9, 9, 6, 5]);
    }

    #[test]
    fn what_costs_least_goes_first() {
        let flat = curve(100, &(0..90).map(|i| (1.0 + f64::from(i), 99 - i as usize)).collect::<Vec<_>>());
        let rough = curve(100, &(0..90).map(|i| (50.0 + f64::from(i), 99 - i as usize)).collect::<Vec<_>>());
        let curves = [flat, rough];
        for triangles in [190, 150, 101, 60, 20] {
            let divided = CostCurve::divide(&curves, triangles);
            assert_eq!(divided.iter().sum::<u64>(), triangles);
            assert!(divided[0] <= divided[1], "{divided:?}");
            let cost = CostCurve::max_cost(&curves, triangles);
            let left = curves.each_ref().map(|curve| curve.left_below(class(cost) as u16));
            assert!(left[0] + left[1] >= triangles && left[0] + left[1] <= triangles + 8, "{left:?}");
        }
        // More than the curves can tell.
        assert_eq!(CostCurve::divide(&curves, 10), [5, 5]);
        assert_eq!(CostCurve::max_cost(&curves, 10), f64::INFINITY);
        assert_eq!(CostCurve::divide(&curves, 300), [100, 100]);
    }
}
