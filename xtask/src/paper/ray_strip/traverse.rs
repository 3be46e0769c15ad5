//! A single ray down the tree along a strip (paper, section 5.1, Algorithm 1).

use super::super::ray::{EARLIER, LATER, PreparedRay};
use super::RayStrips;
use super::edges::{Corners, test_leaf};
use super::record::StripRecord;
use super::tree::first_half;
use glam::{Vec3, Vec4};
use raystrips_geom::Hit;

/// A part of a strip, and where a ray is inside its bounds.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Node over it, if it has more than one leaf.
    pub node: u32,
    /// First leaf.
    pub first: u32,
    /// Leaves.
    pub units: u32,
    /// Where the ray enters.
    pub tnear: f32,
    /// Where it leaves.
    pub tfar: f32,
}

/// A part of a strip, and where the rays in `mask` are inside its bounds.
#[derive(Clone, Copy, Debug)]
pub struct PacketPart {
    /// Node over it, if it has more than one leaf.
    pub node: u32,
    /// First leaf.
    pub first: u32,
    /// Leaves.
    pub units: u32,
    /// Rays that meet it.
    pub mask: u32,
    /// Where they enter.
    pub tnear: Vec4,
    /// Where they leave.
    pub tfar: Vec4,
}

/// A half of a part: its node, first leaf and leaves.
pub type Half = (u32, u32, u32);

/// The near and the far half of a part.
#[inline]
pub fn halves(node: u32, first: u32, units: u32, first_is_near: bool) -> (Half, Half) {
    let left = first_half(units);
    let halves = ((node + 1, first, left), (node + left, first + left, units - left));
    if first_is_near { halves } else { (halves.1, halves.0) }
}

impl RayStrips {
    /// The vertices of a leaf as seen from `org`.
    #[inline]
    pub(super) fn corners(&self, [a, b, c, d]: [u32; 4], org: Vec3) -> Corners {
        let vertex = |v: u32| self.positions[v as usize];
        Corners::new([vertex(a), vertex(b), vertex(c), vertex(d)], org)
    }

    /// Tests `ray` against what it meets of a part of a strip.
    #[inline]
    pub(super) fn trace_strip(
        &self,
        strip: &StripRecord,
        ray: &PreparedRay,
        part: Part,
        stack: &mut Vec<Part>,
        best: &mut Hit,
    ) {
        stack.clear();
        let mut next = Some(part);
        while let Some(here) = next {
            next = if here.units <= self.params.whole_units {
                for unit in here.first..here.first + here.units {
                    self.test_unit(strip, unit, ray, best);
                }
                None
            } else {
                descend(strip, ray, &here, stack, best.t)
            };
            while next.is_none() {
                match stack.pop() {
                    None => return,
                    // The hit found since may be nearer: Algorithm 1 does not look.
                    Some(waiting) => next = (waiting.tnear <= best.t).then_some(waiting),
                }
            }
        }
    }

    /// Tests `ray` against the triangles of a leaf.
    #[inline]
    pub(super) fn test_unit(&self, strip: &StripRecord, unit: u32, ray: &PreparedRay, best: &mut Hit) {
        let (vertices, count) = strip.leaf(unit);
        let corners = self.corners(vertices, ray.org);
        test_leaf(&corners, count, strip.prim_id(unit), ray, best);
    }
}

/// The nearer half that `ray` meets; if it meets the other one too, that waits.
#[inline]
fn descend(
    strip: &StripRecord,
    ray: &PreparedRay,
    here: &Part,
    stack: &mut Vec<Part>,
    limit: f32,
) -> Option<Part> {
    let split = strip.node(here.node);
    let axis = usize::from(split.axis);
    let (org, inv_dir): (&[f32; 3], &[f32; 3]) = (ray.org.as_ref(), ray.inv_dir.as_ref());
    let (org, inv_dir) = (org[axis], inv_dir[axis]);
    let left_is_near = inv_dir >= 0.0;
    let (near_plane, far_plane) =
        if left_is_near { (split.left_max, split.right_min) } else { (split.right_min, split.left_max) };
    let exit = (near_plane - org) * inv_dir * LATER;
    let entry = (far_plane - org) * inv_dir * EARLIER;
    let (near, far) = halves(here.node, here.first, here.units, left_is_near != split.reverse);
    let part = |(node, first, units): Half, tnear: f32, tfar: f32| Part { node, first, units, tnear, tfar };
    // The range is narrowed for the far half too, even if the near one is missed: Algorithm 1 forgets to.
    let far_part = part(far, if entry > here.tnear { entry } else { here.tnear }, here.tfar);
    let meets_far = entry <= here.tfar && entry <= limit;
    if exit < here.tnear {
        return meets_far.then_some(far_part);
    }
    if meets_far {
        stack.push(far_part);
    }
    Some(part(near, here.tnear, if exit < here.tfar { exit } else { here.tfar }))
}
