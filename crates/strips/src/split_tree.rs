//! The balanced tree along a strip: a spatial kd-tree over its windows (Lauterbach et al. 2007, section 4.1).
//!
//! The paper halves triangles down to two; here windows are halved, the left half the greater, so that *w*
//! windows always have *w* - 1 nodes. Nodes are in pre-order: the left child of node *i* is *i* + 1, the right
//! one *i* + (windows on the left).

use raystrips_geom::Aabb;
use raystrips_geom::strip::PlaneSplit;

/// The tree over windows with the given boxes.
pub fn split_tree(windows: &[Aabb]) -> Vec<PlaneSplit> {
    let mut nodes = Vec::with_capacity(windows.len().saturating_sub(1));
    split(windows, &mut nodes);
    nodes
}

fn split(windows: &[Aabb], nodes: &mut Vec<PlaneSplit>) -> Aabb {
    if let [window] = windows {
        return *window;
    }
    let (left, right) = windows.split_at(windows.len().div_ceil(2));
    let place = nodes.len();
    nodes.push(PlaneSplit { axis: 0, reversed: false, lower_max: 0.0, upper_min: 0.0 });
    let left = split(left, nodes);
    let right = split(right, nodes);
    nodes[place] = best_split(&left, &right);
    left.union(right)
}

/// The axis on which the two overlap least.
fn best_split(left: &Aabb, right: &Aabb) -> PlaneSplit {
    let on_axis = |axis: usize| {
        let reversed = left.min[axis] + left.max[axis] > right.min[axis] + right.max[axis];
        let (lower, upper) = if reversed { (right, left) } else { (left, right) };
        PlaneSplit { axis: axis as u8, reversed, lower_max: lower.max[axis], upper_min: upper.min[axis] }
    };
    let overlap = |s: &PlaneSplit| s.lower_max - s.upper_min;
    (1..3).map(on_axis).fold(on_axis(0), |best, s| if overlap(&s) < overlap(&best) { s } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_row_of_windows_splits_along_the_row() {
        let window =
            |i: i32| Aabb { min: Vec3::new(-i as f32, 0.0, 0.0), max: Vec3::new(1.0 - i as f32, 9.0, 9.0) };
        let windows: Vec<Aabb> = (0..5).map(window).collect();
        let tree = split_tree(&windows);
        assert_eq!(tree.len(), 4);
        assert_eq!(tree[0], PlaneSplit { axis: 0, reversed: true, lower_max: -2.0, upper_min: -2.0 });
        assert!(tree.iter().all(|s| s.axis == 0 && s.reversed));
        assert!(split_tree(&windows[..1]).is_empty());
    }
}
