//! A ray against the eight boxes of a node.
//!
//! A plane is at `origin + q * spacing`, so its distance is `q * (spacing * inv) + (origin - org) * inv`: one
//! multiplication and one addition a plane. That form loses digits when the node is far away against its size,
//! and the triangle test rounds vertices too, so every box is widened by a slack that covers the sum of all
//! roundings; compare Ize 2013, who widens by the error of the division alone. With it the entry into a box is never
//! behind the hit of a triangle in it, as that is computed ([`crate::window`]). The slack is found once for each
//! page, not in each node, where it would be at the beginning of a chain of operations that wait for each other.

use crate::prepared::{PreparedRay, inverse_direction};
use crate::simd::{LANES, Simd};
use glam::Vec3;
use raystrips_geom::Frame;
use raystrips_pack::layout::{PageHeader, TopNode, WideNode};

/// Widening relative to the distance of the farthest corner: 32 units of 2^-24. All roundings of a box test and of
/// the transformation of a vertex come to 16 at most, grids reaching up to twice as far as what is in them.
const RELATIVE_SLACK: f32 = 1.0 / (1 << 19) as f32;

/// Distances beyond this are taken for it, so that sums of infinities do not come up.
const FARTHEST: f32 = 1e32;

/// The grid of a page as a ray sees it: lanes 0 to 2 are the axes, and again 4 to 6; the others mean nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayGrid {
    /// Distance along the ray from plane to plane.
    pub step: [f32; LANES],
    /// Distance of plane 0 as a lower bound of a box: moved down its axis by the slack.
    pub lo: [f32; LANES],
    /// As an upper bound of a box: moved up.
    pub hi: [f32; LANES],
    /// Inverse direction of the ray along the axes of the boxes.
    inv_dir: [f32; 4],
}

impl RayGrid {
    pub const NONE: RayGrid =
        RayGrid { step: [0.0; LANES], lo: [0.0; LANES], hi: [0.0; LANES], inv_dir: [0.0; 4] };

    #[inline(always)]
    pub fn of_page<S: Simd>(s: S, page: &PageHeader, ray: &PreparedRay) -> RayGrid {
        if page.is_turned() {
            return RayGrid::of_turned_page(s, page, ray);
        }
        let (origin, spacing) = page_grid(s, page);
        RayGrid::new(s, origin, spacing, &Line { org: ray.org, inv_dir: ray.inv_dir })
    }

    #[inline(always)]
    fn of_turned_page<S: Simd>(s: S, page: &PageHeader, ray: &PreparedRay) -> RayGrid {
        let (_, spacing) = page_grid(s, page);
        let origin = s.mul(spacing, s.splat(-32768.0));
        RayGrid::new(s, origin, spacing, &Line::turned(&page.frame(), ray))
    }

    #[inline(always)]
    fn new<S: Simd>(s: S, origin: S::F, spacing: S::F, line: &Line) -> RayGrid {
        let slack = slack(s, origin, s.mul(spacing, s.splat(f32::from(u16::MAX))), &line.org);
        let start = Start::new(s, origin, spacing, slack, line);
        RayGrid {
            step: s.store(start.step),
            lo: s.store(start.lo),
            hi: s.store(start.hi),
            inv_dir: line.inv_dir,
        }
    }
}

/// Where a ray runs, along the axes of boxes.
struct Line {
    org: [f32; 4],
    inv_dir: [f32; 4],
}

impl Line {
    /// Seen from a frame. What is rounded here is a few units of the distance to the frame, which the slack covers.
    #[inline(always)]
    fn turned(frame: &Frame, ray: &PreparedRay) -> Line {
        let org = frame.turned(Vec3::new(ray.org[0], ray.org[1], ray.org[2]) - frame.origin);
        let inv_dir = inverse_direction(frame.turned(ray.direction().as_vec3()));
        Line { org: [org.x, org.y, org.z, 0.0], inv_dir }
    }
}

/// What box tests must allow for in a box of that `origin` and `extent`, in scene units, in all lanes.
#[inline(always)]
fn slack<S: Simd>(s: S, origin: S::F, extent: S::F, org: &[f32; 4]) -> S::F {
    let reach = s.add(s.abs(s.sub(origin, s.load_twice(org))), extent);
    let reach = s.max(s.max(s.spread::<0>(reach), s.spread::<1>(reach)), s.spread::<2>(reach));
    s.mul(reach, s.splat(RELATIVE_SLACK))
}

/// The slack of all nodes above the pages, in a tree with instances of at most this condition.
///
/// In a part, origin and direction of a ray are rounded once more, and what is rounded there counts for as many times as
/// much here.
#[inline(always)]
pub(crate) fn top_slack<S: Simd>(s: S, root: &TopNode, ray: &PreparedRay, condition: f32) -> [f32; LANES] {
    let (origin, spacing) = top_grid(s, root);
    let slack = slack(s, origin, s.mul(spacing, s.splat(f32::from(u8::MAX))), &ray.org);
    s.store(s.mul(slack, s.splat(condition)))
}

/// Origin and spacing of a page's grid.
#[inline(always)]
fn page_grid<S: Simd>(s: S, page: &PageHeader) -> (S::F, S::F) {
    // They are bytes 16 to 31.
    let floats: &[f32; 16] = bytemuck::cast_ref(page);
    let words: &[u32; 16] = bytemuck::cast_ref(page);
    (s.load_twice(floats[4..8].try_into().expect("four of four")), s.powers_of_two_twice(words[7]))
}

/// Origin and spacing of a node above the pages.
#[inline(always)]
fn top_grid<S: Simd>(s: S, node: &TopNode) -> (S::F, S::F) {
    let floats: &[f32; 24] = bytemuck::cast_ref(node);
    let words: &[u32; 24] = bytemuck::cast_ref(node);
    (s.load_twice(floats[..4].try_into().expect("four of four")), s.powers_of_two_twice(words[3]))
}

/// Where a ray is inside each box.
#[derive(Clone, Copy)]
pub(crate) struct Slabs<F> {
    /// Entry.
    pub tnear: F,
    /// Exit; before the entry where the ray misses.
    pub tfar: F,
}

/// The boxes of a node in a page, for the part of the ray up to `limit`.
#[inline(always)]
pub(crate) fn page_slabs<S: Simd>(
    s: S,
    node: &WideNode,
    page: &RayGrid,
    ray: &PreparedRay,
    limit: f32,
) -> Slabs<S::F> {
    let words: &[u64; 8] = bytemuck::cast_ref(node);
    let origin = s.convert_u16_twice(words[0]);
    let page_step = s.load(&page.step);
    let start = Start {
        step: s.mul(s.powers_of_two_twice(words[1] as u32), s.load_twice(&page.inv_dir)),
        lo: s.mul_add(origin, page_step, s.load(&page.lo)),
        hi: s.mul_add(origin, page_step, s.load(&page.hi)),
    };
    slabs(s, words, &start, ray, limit)
}

/// The boxes of a node above the pages.
#[inline(always)]
pub(crate) fn top_slabs<S: Simd>(
    s: S,
    node: &TopNode,
    slack: &[f32; LANES],
    ray: &PreparedRay,
    limit: f32,
) -> Slabs<S::F> {
    let words: &[u64; 12] = bytemuck::cast_ref(node);
    let (origin, spacing) = top_grid(s, node);
    let line = Line { org: ray.org, inv_dir: ray.inv_dir };
    let start = Start::new(s, origin, spacing, s.load(slack), &line);
    slabs(s, words.first_chunk().expect("eight of twelve"), &start, ray, limit)
}

/// A grid as a ray sees it; see [`RayGrid`].
struct Start<F> {
    step: F,
    lo: F,
    hi: F,
}

impl<F: Copy> Start<F> {
    #[inline(always)]
    fn new<S: Simd<F = F>>(s: S, origin: F, spacing: F, slack: F, line: &Line) -> Start<F> {
        let inv_dir = s.load_twice(&line.inv_dir);
        let away = s.sub(origin, s.load_twice(&line.org));
        let (most, least) = (s.splat(FARTHEST), s.splat(-FARTHEST));
        Start {
            step: s.mul(spacing, inv_dir),
            lo: s.max(s.min(s.mul(s.sub(away, slack), inv_dir), most), least),
            hi: s.max(s.min(s.mul(s.add(away, slack), inv_dir), most), least),
        }
    }
}

/// The planes of eight boxes, as distances along each axis from the common origin of a packet of rays, moved outward
/// by the slack.
#[derive(Clone, Copy)]
pub(crate) struct Planes<F> {
    pub lo: [F; 3],
    pub hi: [F; 3],
}

impl<F: Copy> Planes<F> {
    /// Of a node in a page with header `page`, which is not turned.
    #[inline(always)]
    pub fn of_page_node<S: Simd<F = F>>(
        s: S,
        node: &WideNode,
        page: &PageHeader,
        ray: &PreparedRay,
    ) -> Planes<F> {
        let words: &[u64; 8] = bytemuck::cast_ref(node);
        let (page_origin, page_spacing) = page_grid(s, page);
        let slack = slack(s, page_origin, s.mul(page_spacing, s.splat(f32::from(u16::MAX))), &ray.org);
        let away = s.sub(page_origin, s.load_twice(&ray.org));
        let away = s.mul_add(s.convert_u16_twice(words[0]), page_spacing, away);
        Planes::new(s, words, s.powers_of_two_twice(words[1] as u32), s.sub(away, slack), s.add(away, slack))
    }

    /// Of a node above the pages.
    #[inline(always)]
    pub fn of_top_node<S: Simd<F = F>>(
        s: S,
        node: &TopNode,
        slack: &[f32; LANES],
        ray: &PreparedRay,
    ) -> Planes<F> {
        let words: &[u64; 12] = bytemuck::cast_ref(node);
        let (origin, spacing) = top_grid(s, node);
        let away = s.sub(origin, s.load_twice(&ray.org));
        let slack = s.load(slack);
        let words = words.first_chunk().expect("eight of twelve");
        Planes::new(s, words, spacing, s.sub(away, slack), s.add(away, slack))
    }

    #[inline(always)]
    fn new<S: Simd<F = F>>(s: S, words: &[u64; 8], spacing: F, lo: F, hi: F) -> Planes<F> {
        macro_rules! planes {
            ($first:literal, $start:expr) => {
                [
                    s.mul_add(s.convert_u8(words[$first]), s.spread::<0>(spacing), s.spread::<0>($start)),
                    s.mul_add(s.convert_u8(words[$first + 1]), s.spread::<1>(spacing), s.spread::<1>($start)),
                    s.mul_add(s.convert_u8(words[$first + 2]), s.spread::<2>(spacing), s.spread::<2>($start)),
                ]
            };
        }
        Planes { lo: planes!(2, lo), hi: planes!(5, hi) }
    }
}

/// Words 2 to 4 of a node are the least planes, 5 to 7 the greatest.
#[inline(always)]
fn slabs<S: Simd>(s: S, words: &[u64; 8], start: &Start<S::F>, ray: &PreparedRay, limit: f32) -> Slabs<S::F> {
    let mut tnear = s.splat(ray.tnear);
    let mut tfar = s.splat(limit);
    macro_rules! cut {
        ($axis:literal) => {
            let step = s.spread::<$axis>(start.step);
            let lo = s.mul_add(s.convert_u8(words[2 + $axis]), step, s.spread::<$axis>(start.lo));
            let hi = s.mul_add(s.convert_u8(words[5 + $axis]), step, s.spread::<$axis>(start.hi));
            // Which of them the ray meets first depends on its direction.
            tnear = s.max(s.min(lo, hi), tnear);
            tfar = s.min(s.max(lo, hi), tfar);
        };
    }
    cut!(0);
    cut!(1);
    cut!(2);
    Slabs { tnear, tfar }
}
