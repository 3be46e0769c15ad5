//! What is written is read.
#![allow(clippy::unwrap_used, reason = "a test")]

use glam::Vec3;
use proptest::prelude::*;
use raystrips_geom::Aabb;
use raystrips_geom::strip::window_count;
use raystrips_pack::StripView;
use raystrips_pack::layout::{ChildBoxes, MAX_STRIP_TRIANGLES, WIDTH};
use raystrips_pack::strip_record::{SplitNode, push_strip, record_bytes};

/// The parts of a strip: tree, turns, refs.
type Parts = (Vec<SplitNode>, Vec<u8>, Vec<u8>);

fn split() -> impl Strategy<Value = SplitNode> {
    (0..3u8, any::<bool>(), any::<u8>(), any::<u8>())
        .prop_map(|(axis, reversed, lower_max, upper_min)| SplitNode { axis, reversed, lower_max, upper_min })
}

fn strip() -> impl Strategy<Value = Parts> {
    (1..=MAX_STRIP_TRIANGLES).prop_flat_map(|n| {
        let windows = window_count(n);
        let turns = prop::collection::vec((0..32u8).prop_map(|bits| bits << 1), windows);
        (prop::collection::vec(split(), windows - 1), turns, prop::collection::vec(any::<u8>(), n + 2))
    })
}

fn boxes(scale: f32) -> impl Strategy<Value = Vec<Aabb>> {
    let corner = || prop::array::uniform3(-1.0..1.0f32);
    let one = (corner(), corner(), -20..20i32).prop_map(move |(min, extent, exponent)| {
        let min = Vec3::from_array(min) * scale;
        let extent = Vec3::from_array(extent).abs() * scale * (exponent as f32).exp2();
        Aabb { min, max: min + extent }
    });
    prop::collection::vec(one, 1..=WIDTH)
}

fn check_boxes(bounds: &[Aabb]) -> Result<(), TestCaseError> {
    let boxes = ChildBoxes::around(bounds, 3);
    for (i, inner) in bounds.iter().enumerate() {
        let outer = boxes.child_bounds(i);
        prop_assert!(outer.min.cmple(inner.min).all() && inner.max.cmple(outer.max).all(), "child {i}");
    }
    for unused in bounds.len()..WIDTH {
        for axis in 0..3 {
            prop_assert_eq!((boxes.lo[axis][unused], boxes.hi[axis][unused]), (255, 0));
        }
    }
    prop_assert_eq!(boxes.cluster, 3);
    Ok(())
}

proptest! {
    #[test]
    fn strips(strips in prop::collection::vec(strip(), 1..8)) {
        let mut bytes = Vec::new();
        let starts: Vec<usize> =
            strips.iter().map(|(tree, turns, refs)| push_strip(&mut bytes, tree, turns, refs)).collect();
        let mut end = 0;
        for ((tree, turns, refs), start) in strips.iter().zip(starts) {
            prop_assert_eq!(start, end);
            let view = StripView::at(&bytes, start).unwrap();
            prop_assert_eq!((view.turns(), view.refs()), (&turns[..], &refs[..]));
            prop_assert_eq!((view.triangle_count(), view.window_count()), (refs.len() - 2, turns.len()));
            for (i, split) in tree.iter().enumerate() {
                prop_assert_eq!(view.split(i), *split);
            }
            let windows = (0..view.window_count()).map(|w| view.window(w));
            prop_assert_eq!(windows.map(|(count, ..)| count).sum::<usize>(), view.triangle_count());
            prop_assert_eq!(view.record_bytes(), record_bytes(view.triangle_count()));
            end += view.record_bytes();
        }
        prop_assert_eq!(end, bytes.len());
        prop_assert!(StripView::at(&bytes, end).is_none());
    }

    #[test]
    fn cut_strips_are_none((tree, turns, refs) in strip(), cut in any::<prop::sample::Index>()) {
        let mut bytes = Vec::new();
        push_strip(&mut bytes, &tree, &turns, &refs);
        prop_assert!(StripView::at(&bytes[..cut.index(bytes.len())], 0).is_none());
    }

    #[test]
    fn child_boxes_contain(bounds in boxes(1.0)) {
        check_boxes(&bounds)?;
    }

    #[test]
    fn child_boxes_contain_at_any_scale(bounds in (-60..60i32).prop_flat_map(|e| boxes((e as f32).exp2()))) {
        check_boxes(&bounds)?;
    }
}

#[test]
fn a_point_has_a_box() {
    for x in [0.0, 1e-38, -1e30, 12345.678] {
        let point = Vec3::splat(x);
        let boxes = ChildBoxes::around(&[Aabb { min: point, max: point }], 0);
        let outer = boxes.child_bounds(0);
        assert!(outer.min.cmple(point).all() && point.cmple(outer.max).all());
    }
}
