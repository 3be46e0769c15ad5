//! The binary hierarchy of boxes above triangles or strips: 32 bytes a node (paper, sections 3.2 and 3.3.1).
//!
//! Siblings lie side by side in a cache line, bounds by axis, so that a single ray is tested against both at once;
//! a packet is tested against one after the other, four rays at once.

use super::moeller_trumbore::{Lanes, splat};
use super::packet::{Packet, PacketHits};
use super::ray::{LATER, PreparedRay};
use glam::{Vec4, Vec4Swizzles};
use raystrips_geom::{Aabb, Hit};
use raystrips_strips::Bvh;
use std::ops::Range;

/// What is below a node.
#[derive(Clone, Copy, Debug, Default)]
pub struct Link {
    /// Number of the siblings below, or the first item of a leaf.
    pub first: u32,
    /// Items of a leaf; 0 for inner nodes.
    pub count: u32,
}

/// Two nodes with the same parent.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Siblings {
    /// By axis: least coordinates of both, greatest coordinates of both.
    bounds: [[f32; 4]; 3],
    links: [Link; 2],
}

const _: () = assert!(size_of::<Siblings>() == 2 * Hierarchy::NODE_BYTES);

/// A hierarchy whose leaves name items of the caller.
pub struct Hierarchy {
    siblings: Vec<Siblings>,
    bounds: Aabb,
    root: Link,
}

/// A node that waits for a ray, and where the ray is inside its box.
#[derive(Clone, Copy, Debug)]
pub struct Waiting {
    link: Link,
    tnear: f32,
    tfar: f32,
}

/// The same for a packet.
#[derive(Clone, Copy, Debug)]
pub struct WaitingPacket {
    /// What is below the node.
    pub link: Link,
    /// Rays that meet its box.
    pub mask: u32,
    /// Where they enter it.
    pub tnear: Vec4,
    /// Where they leave it.
    pub tfar: Vec4,
}

impl Hierarchy {
    /// Bytes of a node: six bounds and a link.
    pub const NODE_BYTES: usize = 32;

    /// Lays out `tree`; `leaf` tells the link for the items of a leaf.
    pub fn new(tree: &Bvh, leaf: &mut impl FnMut(Range<usize>) -> Link) -> Hierarchy {
        let mut siblings = Vec::new();
        let root = lay_out(tree, &mut siblings, leaf);
        Hierarchy { siblings, bounds: tree.bounds(), root }
    }

    /// Nodes, the root included.
    pub fn node_count(&self) -> usize {
        2 * self.siblings.len() + 1
    }

    /// Bytes of all nodes.
    pub fn bytes(&self) -> u64 {
        (self.node_count() * Hierarchy::NODE_BYTES) as u64
    }

    /// Leads `ray` to the leaves that it meets before `best`, the nearer child first. `leaf` gets a leaf and where the
    /// ray enters and leaves its box.
    #[inline]
    pub fn traverse(
        &self,
        ray: &PreparedRay,
        stack: &mut Vec<Waiting>,
        best: &mut Hit,
        mut leaf: impl FnMut(Link, (f32, f32), &mut Hit),
    ) {
        let lanes = RayLanes::new(ray);
        let (mask, tnear, tfar) = lanes.test(&both(&self.bounds), best.t);
        if mask == 0 {
            return;
        }
        stack.clear();
        let mut here = Waiting { link: self.root, tnear: tnear.x, tfar: tfar.x };
        loop {
            if here.link.count == 0 {
                let siblings = &self.siblings[here.link.first as usize];
                let (mask, tnear, tfar) = lanes.test(&siblings.bounds, best.t);
                let a = Waiting { link: siblings.links[0], tnear: tnear.x, tfar: tfar.x };
                let b = Waiting { link: siblings.links[1], tnear: tnear.y, tfar: tfar.y };
                if mask != 0 {
                    let b_first = mask == 0b10 || mask == 0b11 && b.tnear < a.tnear;
                    if mask == 0b11 {
                        stack.push(if b_first { a } else { b });
                    }
                    here = if b_first { b } else { a };
                    continue;
                }
            } else {
                leaf(here.link, (here.tnear, here.tfar), best);
            }
            here = loop {
                match stack.pop() {
                    None => return,
                    Some(next) if next.tnear <= best.t => break next,
                    Some(_) => {}
                }
            };
        }
    }

    /// The same for a packet: nodes that any of its rays meets are visited, in the order of the first such ray.
    #[inline]
    pub fn traverse_packet(
        &self,
        packet: &Packet,
        stack: &mut Vec<WaitingPacket>,
        best: &mut PacketHits,
        mut leaf: impl FnMut(&WaitingPacket, &mut PacketHits),
    ) {
        stack.clear();
        let mut here = test_packet(packet, &both(&self.bounds), 0, self.root, best.t);
        if here.mask == 0 {
            return;
        }
        loop {
            if here.link.count == 0 {
                let Siblings { bounds, links } = &self.siblings[here.link.first as usize];
                let a = test_packet(packet, bounds, 0, links[0], best.t);
                let b = test_packet(packet, bounds, 1, links[1], best.t);
                if a.mask | b.mask != 0 {
                    let both = a.mask & b.mask;
                    let b_nearer = b.tnear.cmplt(a.tnear).bitmask();
                    let b_first = a.mask == 0 || b_nearer & (both & both.wrapping_neg()) != 0;
                    if a.mask != 0 && b.mask != 0 {
                        stack.push(if b_first { a } else { b });
                    }
                    here = if b_first { b } else { a };
                    continue;
                }
            } else {
                leaf(&here, best);
            }
            here = loop {
                let Some(next) = stack.pop() else { return };
                let mask = next.mask & next.tnear.cmple(best.t).bitmask();
                if mask != 0 {
                    break WaitingPacket { mask, ..next };
                }
            };
        }
    }
}

/// Bounds of siblings that are both `bounds`: the root is tested like others.
#[inline]
fn both(bounds: &Aabb) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|axis| [bounds.min[axis], bounds.min[axis], bounds.max[axis], bounds.max[axis]])
}

/// Appends what is below `tree` to `siblings`, parents before children, and gives the link to it.
fn lay_out(tree: &Bvh, siblings: &mut Vec<Siblings>, leaf: &mut impl FnMut(Range<usize>) -> Link) -> Link {
    let children = match tree {
        Bvh::Leaf { items, .. } => return leaf(items.clone()),
        Bvh::Inner { children, .. } => children,
    };
    let [a, b] = [children[0].bounds(), children[1].bounds()];
    let place = siblings.len();
    siblings.push(Siblings {
        bounds: [0, 1, 2].map(|axis| [a.min[axis], b.min[axis], a.max[axis], b.max[axis]]),
        links: [Link::default(); 2],
    });
    for (i, child) in children.iter().enumerate() {
        siblings[place].links[i] = lay_out(child, siblings, leaf);
    }
    Link { first: place as u32, count: 0 }
}

/// A ray as the test of siblings wants it.
struct RayLanes {
    org: Lanes,
    inv_dir: Lanes,
    tnear: Vec4,
}

impl RayLanes {
    #[inline]
    fn new(ray: &PreparedRay) -> RayLanes {
        RayLanes { org: splat(ray.org), inv_dir: splat(ray.inv_dir), tnear: Vec4::splat(ray.tnear) }
    }

    /// Which of two boxes the ray meets before `limit`, and in the first two lanes where it enters and leaves them.
    #[inline]
    fn test(&self, bounds: &[[f32; 4]; 3], limit: f32) -> (u32, Vec4, Vec4) {
        let mut tnear = self.tnear;
        let mut tfar = Vec4::INFINITY;
        for (axis, &bounds) in bounds.iter().enumerate() {
            let t = (Vec4::from_array(bounds) - self.org[axis]) * self.inv_dir[axis];
            let other = t.zwxy();
            tnear = tnear.max(t.min(other));
            tfar = tfar.min(t.max(other));
        }
        let tfar = (tfar * LATER).min(Vec4::splat(limit));
        (tnear.cmple(tfar).bitmask() & 0b11, tnear, tfar)
    }
}

/// Which rays of `packet` meet box `child` of two before `limit`.
#[inline]
fn test_packet(
    packet: &Packet,
    bounds: &[[f32; 4]; 3],
    child: usize,
    link: Link,
    limit: Vec4,
) -> WaitingPacket {
    let mut tnear = packet.tnear;
    let mut tfar = Vec4::INFINITY;
    for (axis, bounds) in bounds.iter().enumerate() {
        let at = |bound: usize| (Vec4::splat(bounds[bound]) - packet.org[axis]) * packet.inv_dir[axis];
        let (near, far) = if packet.positive[axis] { (child, child + 2) } else { (child + 2, child) };
        tnear = tnear.max(at(near));
        tfar = tfar.min(at(far));
    }
    let tfar = (tfar * LATER).min(limit);
    WaitingPacket { link, mask: tnear.cmple(tfar).bitmask(), tnear, tfar }
}
