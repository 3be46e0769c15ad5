//! What is written is read.
#![allow(clippy::unwrap_used, reason = "a test")]

use glam::Vec3;
use proptest::prelude::*;
use raystrips_geom::strip::{PlaneSplit, strip_triangle, window_count};
use raystrips_geom::{Aabb, RadiusCode, Segment};
use raystrips_pack::layout::{ChildBoxes, MAX_STRIP_TRIANGLES, WIDTH};
use raystrips_pack::page::builder::{BuiltPage, Children, StripParts};
use raystrips_pack::strip_record::SPLIT_PLANE_STEP;
use raystrips_pack::{PageBuilder, PageEntry, PageView, StoredStrands, StrandParts, WideNode, check_page};

/// The parts of a strip: splits, turns, refs.
type Parts = (Vec<PlaneSplit>, Vec<u8>, Vec<u8>);

/// Number of vertices, and how far they lie from 0 at most.
const VERTICES: u8 = 100;
const SIZE: f32 = 65535.0;

fn vertices() -> Vec<Vec3> {
    let x = |i: u8, k: u32| (f32::from(i) * 0.37 * (k as f32)).sin().abs() * SIZE;
    (0..VERTICES).map(|i| Vec3::new(x(i, 1), x(i, 2), x(i, 3))).collect()
}

fn split() -> impl Strategy<Value = PlaneSplit> {
    let plane = || prop_oneof![Just(0.0), Just(SIZE), 0.0..SIZE];
    (0..3u8, any::<bool>(), plane(), plane()).prop_map(|(axis, reversed, lower_max, upper_min)| PlaneSplit {
        axis,
        reversed,
        lower_max,
        upper_min,
    })
}

fn strip(most: usize) -> impl Strategy<Value = Parts> {
    (1..=most).prop_flat_map(|n| {
        let windows = window_count(n);
        let turns = prop::collection::vec((0..32u8).prop_map(|bits| bits << 1), windows);
        (prop::collection::vec(split(), windows - 1), turns, prop::collection::vec(0..VERTICES, n + 2))
    })
}

/// A page of one cluster and one node.
fn page(strips: &[Parts]) -> BuiltPage {
    let vertices = vertices();
    let parts = strips.iter().map(|(splits, turns, refs)| StripParts { refs, turns, splits, geometry: 0 });
    let mut page = PageBuilder::default();
    let root = page.reserve_nodes(1);
    let cluster = page.cluster(&vertices, parts.collect());
    let bounds = vec![Aabb { min: Vec3::ZERO, max: Vec3::splat(SIZE) }; strips.len()];
    page.set_node(root, bounds, Children::Strips { cluster, first: 0 });
    page.finish(0).unwrap()
}

/// Checks what was read against what was written.
fn check_strips(view: &PageView, strips: &[Parts]) -> Result<(), TestCaseError> {
    let cluster = view.cluster(0);
    prop_assert_eq!(cluster.strip_numbers().len(), strips.len());
    let mut triangles = 0;
    for (i, (splits, turns, refs)) in cluster.strip_numbers().zip(strips) {
        let strip = view.strip(i);
        let n = refs.len() - 2;
        prop_assert_eq!((strip.refs(), strip.window_count()), (&refs[..], turns.len()));
        prop_assert_eq!((strip.primitive_count(), cluster.triangle_index(i, 0)), (n, triangles));
        prop_assert_eq!(view.window_record(i).is_some(), view.header().max_windows == 1);
        let heads: Vec<_> = (0..turns.len()).map(|w| strip.window(w).0).collect();
        prop_assert_eq!(heads.iter().map(|head| head.turns()).collect::<Vec<_>>(), turns.clone());
        prop_assert_eq!(heads.iter().map(|head| head.count()).sum::<usize>(), n);
        for k in 0..n {
            prop_assert_eq!(strip.triangle(k), strip_triangle(turns, k).map(|corner| refs[corner]));
        }
        for (s, split) in splits.iter().enumerate() {
            let stored = strip.split(s);
            prop_assert_eq!((stored.axis, stored.reversed), (split.axis, split.reversed));
            let plane = |p: u16| view.grid().plane(usize::from(split.axis), p * SPLIT_PLANE_STEP);
            prop_assert!(plane(stored.lower_max) >= split.lower_max.into());
            prop_assert!(plane(stored.upper_min) <= split.upper_min.into());
        }
        triangles += n;
    }
    Ok(())
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

fn contains(outer: Aabb, inner: Aabb) -> bool {
    outer.min.cmple(inner.min).all() && inner.max.cmple(outer.max).all()
}

fn check_boxes(bounds: &[Aabb]) -> Result<(), TestCaseError> {
    let boxes = ChildBoxes::around(bounds);
    let unused = |lo: [[u8; WIDTH]; 3], hi: [[u8; WIDTH]; 3]| {
        (bounds.len()..WIDTH).all(|i| (0..3).all(|axis| (lo[axis][i], hi[axis][i]) == (255, 0)))
    };
    prop_assert!((0..bounds.len()).all(|i| contains(boxes.child_bounds(i), bounds[i])));
    prop_assert!(unused(boxes.lo, boxes.hi));
    let mut page = PageBuilder::default();
    let root = page.reserve_nodes(1);
    page.set_node(root, bounds.to_vec(), Children::Nodes(1));
    with_view(&page.finish(0).unwrap(), |view| {
        let node = view.nodes()[0];
        prop_assert!((0..bounds.len()).all(|i| contains(node.child_bounds(view.grid(), i), bounds[i])));
        prop_assert!(unused(node.lo, node.hi));
        Ok(())
    })
}

/// Calls `f` with the page, aligned in memory, and the bytes it has there.
fn with_bytes<R>(page: &BuiltPage, f: impl FnOnce(&[u8]) -> R) -> R {
    let mut memory: Vec<WideNode> = vec![bytemuck::Zeroable::zeroed(); page.bytes.len().div_ceil(64)];
    let bytes = &mut bytemuck::cast_slice_mut(&mut memory)[..page.bytes.len()];
    bytes.copy_from_slice(&page.bytes);
    f(bytes)
}

fn with_view<R>(page: &BuiltPage, f: impl FnOnce(PageView) -> R) -> R {
    with_bytes(page, |bytes| f(PageView::new(bytes).unwrap()))
}

proptest! {
    #[test]
    fn strips_of_one_window(strips in prop::collection::vec(strip(6), 1..8)) {
        with_view(&page(&strips), |view| check_strips(&view, &strips))?;
    }

    #[test]
    fn strips_of_any_length(strips in prop::collection::vec(strip(MAX_STRIP_TRIANGLES), 1..8)) {
        with_view(&page(&strips), |view| check_strips(&view, &strips))?;
    }

    #[test]
    fn what_is_built_is_sound(strips in prop::collection::vec(strip(20), 1..8)) {
        let page = page(&strips);
        let entry = PageEntry {
            offset: 4096,
            first_triangle: 0,
            bytes: page.bytes.len() as u32,
            checksum: crc32c::crc32c(&page.bytes),
            triangle_count: page.triangle_count,
            node_count: page.node_count,
        };
        with_bytes(&page, |bytes| check_page(bytes, 0, &entry, 1, 1).map(|_| ())).unwrap();
        prop_assert_eq!(page.counts.tracing() + page.counts.materials, page.bytes.len() as u64);
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
        check_boxes(&[Aabb { min: point, max: point }]).unwrap();
    }
}

#[test]
fn windows_of_strands_come_back() {
    let vertices = vertices();
    let code = RadiusCode::covering(0.5, 20.0);
    // The first two are a pair, and so are the last two, which are given the other way round.
    let windows: Vec<(Vec<u8>, Vec<u8>)> = [0..=1, 1..=3, 10..=13, 20..=24, 40..=46, 35..=40]
        .map(|refs| (refs.clone().collect(), refs.map(|vertex| 5 * vertex).collect()))
        .to_vec();
    let parts: Vec<StrandParts> =
        windows.iter().map(|(refs, radii)| StrandParts { refs, radii, geometry: 0 }).collect();
    let strands = StoredStrands::of(&vertices, &parts);
    let mut page = PageBuilder::new(code, None);
    let root = page.reserve_nodes(1);
    let cluster = page.strands(&strands);
    let bounds = vec![Aabb { min: Vec3::ZERO, max: Vec3::splat(SIZE) }; windows.len()];
    page.set_node(root, bounds, Children::Strips { cluster, first: 0 });
    let built = page.finish(0).unwrap();
    assert_eq!((built.triangle_count, built.segment_count), (21, 21));
    with_view(&built, |view| {
        let cluster = view.cluster(0);
        for (strip, (refs, radii)) in cluster.strips().zip(&windows) {
            let strand = strip.strand().unwrap();
            assert_eq!(strip.primitive_count(), refs.len() - 1);
            assert_eq!(strand.is_backward, [0, 35].contains(&refs[0]));
            for i in 0..strand.segments {
                let expected = Segment {
                    ends: [i, i + 1].map(|k| vertices[usize::from(refs[k])]),
                    radii: [i, i + 1].map(|k| code.decode(radii[k])),
                };
                assert_eq!(cluster.segment(strand, i), expected);
            }
        }
    });
}
