//! Packets down the tree along a strip (paper, section 5.3): a part is visited if any ray meets it, and where few
//! do, each goes on alone, with its four lanes given to edges instead of rays.

use super::super::hierarchy::WaitingPacket;
use super::super::packet::{Packet, PacketHits, lanes};
use super::super::ray::{EARLIER, LATER};
use super::RayStrips;
use super::edges::Corners;
use super::record::StripRecord;
use super::traverse::{Half, PacketPart, Part, halves};
use glam::{Vec3, Vec4};

/// With so many active rays or fewer, they are traced one by one. Measured; the paper says "a certain threshold".
const FEW: u32 = 1;

impl RayStrips {
    /// Tests the rays of `packet` that meet `leaf` against what they meet of its strip.
    #[inline]
    pub(super) fn trace_strip_packet(
        &self,
        packet: &Packet,
        leaf: &WaitingPacket,
        stack: &mut Vec<PacketPart>,
        single_stack: &mut Vec<Part>,
        best: &mut PacketHits,
    ) {
        let strip = self.strip(leaf.link);
        let WaitingPacket { mask, tnear, tfar, .. } = *leaf;
        stack.clear();
        let mut next = Some(PacketPart { node: 0, first: 0, units: strip.units(), mask, tnear, tfar });
        while let Some(here) = next {
            next = if here.mask.count_ones() <= FEW {
                for i in lanes(here.mask) {
                    let PacketPart { node, first, units, .. } = here;
                    let part = Part { node, first, units, tnear: here.tnear[i], tfar: here.tfar[i] };
                    let search =
                        |best: &mut _| self.trace_strip(&strip, &packet.rays[i], part, single_stack, best);
                    best.search_single(i, search);
                }
                None
            } else if here.units <= self.params.whole_units {
                for unit in here.first..here.first + here.units {
                    self.test_unit_packet(&strip, unit, packet, here.mask, best);
                }
                None
            } else {
                descend(&strip, packet, &here, stack, best.t)
            };
            while next.is_none() {
                let Some(waiting) = stack.pop() else { return };
                let mask = waiting.mask & waiting.tnear.cmple(best.t).bitmask();
                next = (mask != 0).then_some(PacketPart { mask, ..waiting });
            }
        }
    }

    /// Rays of one origin see the same moments, so that only the products with their directions are left for each
    /// (Benthin 2005); others are tested one by one.
    #[inline]
    fn test_unit_packet(
        &self,
        strip: &StripRecord,
        unit: u32,
        packet: &Packet,
        mask: u32,
        best: &mut PacketHits,
    ) {
        let Some(org) = packet.shared_origin else {
            for i in lanes(mask) {
                best.search_single(i, |best| self.test_unit(strip, unit, &packet.rays[i], best));
            }
            return;
        };
        let (vertices, count) = strip.leaf(unit);
        let corners = self.corners(vertices, org);
        test_leaf(&corners, count, strip.prim_id(unit), packet, best);
    }
}

/// The nearer half that any ray meets; if any meets the other one too, that waits.
#[inline]
fn descend(
    strip: &StripRecord,
    packet: &Packet,
    here: &PacketPart,
    stack: &mut Vec<PacketPart>,
    limit: Vec4,
) -> Option<PacketPart> {
    let split = strip.node(here.node);
    let axis = usize::from(split.axis);
    let (org, inv_dir) = (packet.org[axis], packet.inv_dir[axis]);
    let left_is_near = packet.positive[axis];
    let (near_plane, far_plane) =
        if left_is_near { (split.left_max, split.right_min) } else { (split.right_min, split.left_max) };
    let exit = (Vec4::splat(near_plane) - org) * inv_dir * LATER;
    let entry = (Vec4::splat(far_plane) - org) * inv_dir * EARLIER;
    let near_mask = here.mask & exit.cmpge(here.tnear).bitmask();
    let far_mask = here.mask & entry.cmple(here.tfar.min(limit)).bitmask();
    let (near, far) = halves(here.node, here.first, here.units, left_is_near != split.reverse);
    let part =
        |(node, first, units): Half, mask, tnear, tfar| PacketPart { node, first, units, mask, tnear, tfar };
    let far_part = part(far, far_mask, here.tnear.max(entry), here.tfar);
    if near_mask == 0 {
        return (far_mask != 0).then_some(far_part);
    }
    if far_mask != 0 {
        stack.push(far_part);
    }
    Some(part(near, near_mask, here.tnear, here.tfar.min(exit)))
}

/// Replaces `best` where rays that share the origin of `corners` meet one of the first `count` triangles nearer.
#[inline]
fn test_leaf(corners: &Corners, count: u32, prim_id: u64, packet: &Packet, best: &mut PacketHits) {
    let [dx, dy, dz] = packet.dir;
    let next = corners.to_next();
    let next_but_one = corners.to_next_but_one();
    let (nx, ny, nz) = (next.x.to_array(), next.y.to_array(), next.z.to_array());
    let (ox, oy, oz) = (next_but_one.x.to_array(), next_but_one.y.to_array(), next_but_one.z.to_array());
    let mut w2 = dx * nx[0] + dy * ny[0] + dz * nz[0];
    for i in 0..count as usize {
        let w0 = dx * nx[i + 1] + dy * ny[i + 1] + dz * nz[i + 1];
        let w1 = -(dx * ox[i] + dy * oy[i] + dz * oz[i]);
        let (least, most) = (w0.min(w1).min(w2), w0.max(w1).max(w2));
        let inside = least.cmpge(Vec4::ZERO) | most.cmple(Vec4::ZERO);
        if inside.any() {
            let sum = w0 + w1 + w2;
            let (normal, height): (Vec3, f32) = corners.plane(i);
            let t = Vec4::splat(height) / (dx * normal.x + dy * normal.y + dz * normal.z);
            let nearer = t.cmpge(packet.tnear) & t.cmplt(best.t) & sum.cmpne(Vec4::ZERO);
            let mask = (inside & nearer).bitmask();
            if mask != 0 {
                best.update(mask, t, w1 / sum, w2 / sum, prim_id + i as u64);
            }
        }
        w2 = w0;
    }
}
