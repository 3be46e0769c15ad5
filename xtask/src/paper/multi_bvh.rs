//! The multi-BVH of "Cache-Oblivious Ray Reordering" (Moon et al. 2010, section 6; after Ernst and Greiner 2008): four
//! children a node, four triangles a leaf, and a single ray that is tested against four of either at once.
//!
//! The paper compares it with itself without the triangle packets; that is [`SingleTriangles`] over the same data.

use super::mesh::Mesh;
use super::moeller_trumbore::{self, Met, splat, test_lanes};
use super::ray::{LATER, PreparedRay, hit_or_miss};
use super::structure::{Bytes, Stacks, Structure};
use glam::{Vec3, Vec4};
use raystrips_geom::{Aabb, Hit, Ray};
use raystrips_strips::Bvh;

/// Children of a node and triangles of a leaf.
const WIDTH: usize = 4;
/// Set in links to packets.
const LEAF: u32 = 1 << 31;
/// Link of a child that is not there; its box is empty, and no ray meets it.
const NONE: u32 = u32::MAX;

/// Four children.
#[repr(C, align(16))]
struct Node {
    /// By axis: least and greatest coordinates of the children.
    bounds: [[[f32; WIDTH]; 2]; 3],
    /// Numbers of nodes or, with [`LEAF`], of packets.
    links: [u32; WIDTH],
}

/// Four triangles as a corner and two edges, by axis; those that are not there have no area.
#[repr(C, align(16))]
#[derive(Default)]
struct TrianglePacket {
    corner: [[f32; WIDTH]; 3],
    edges: [[[f32; WIDTH]; 3]; 2],
    triangles: [u32; WIDTH],
}

/// A four-wide hierarchy over packets of four triangles.
pub struct MultiBvh {
    nodes: Vec<Node>,
    packets: Vec<TrianglePacket>,
}

/// A [`MultiBvh`] that tests the triangles of a packet one by one.
pub struct SingleTriangles<'a>(pub &'a MultiBvh);

impl MultiBvh {
    /// Builds over `mesh`.
    pub fn build(mesh: &Mesh) -> MultiBvh {
        let built = raystrips_strips::bvh::build(&mesh.boxes(), &|items| items.len() <= WIDTH);
        let mut multi = MultiBvh { nodes: Vec::new(), packets: Vec::new() };
        multi.lay_out(&built.tree, mesh, &built.order);
        multi
    }

    /// Nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Lays out a node over `tree`, whose larger subtrees are opened until there are four, and gives its number.
    fn lay_out(&mut self, tree: &Bvh, mesh: &Mesh, order: &[u32]) -> u32 {
        let children = tree.open(WIDTH, |_| true);
        let number = self.nodes.len();
        let child = |i: usize| children.get(i).map_or(Aabb::EMPTY, |child| child.bounds());
        let bounds = [0, 1, 2]
            .map(|axis| [[0, 1, 2, 3].map(|i| child(i).min[axis]), [0, 1, 2, 3].map(|i| child(i).max[axis])]);
        self.nodes.push(Node { bounds, links: [NONE; WIDTH] });
        for (i, child) in children.iter().enumerate() {
            self.nodes[number].links[i] = match child {
                Bvh::Inner { .. } => self.lay_out(child, mesh, order),
                Bvh::Leaf { items, .. } => {
                    self.packets.push(TrianglePacket::new(mesh, &order[items.clone()]));
                    (self.packets.len() - 1) as u32 | LEAF
                }
            };
        }
        number as u32
    }

    #[inline]
    fn search(
        &self,
        stacks: &mut Stacks,
        ray: &Ray,
        test: impl Fn(&TrianglePacket, &RayLanes, &mut Hit),
    ) -> Hit {
        let ray = RayLanes::new(PreparedRay::new(ray));
        let mut best = ray.single.no_hit();
        let stack = &mut stacks.multi;
        stack.clear();
        stack.push((0, ray.single.tnear));
        while let Some((link, tnear)) = stack.pop() {
            if tnear > best.t {
                continue;
            }
            if link & LEAF != 0 {
                test(&self.packets[(link & !LEAF) as usize], &ray, &mut best);
            } else {
                push_children(&self.nodes[link as usize], &ray, best.t, stack);
            }
        }
        hit_or_miss(best)
    }
}

/// Pushes the children that the ray meets, the nearest last.
#[inline]
fn push_children(node: &Node, ray: &RayLanes, limit: f32, stack: &mut Vec<(u32, f32)>) {
    let (mut mask, tnear) = ray.test_boxes(node, limit);
    let tnear = tnear.to_array();
    let first = stack.len();
    while mask != 0 {
        let i = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        stack.push((node.links[i], tnear[i]));
        let mut place = stack.len() - 1;
        while place > first && stack[place - 1].1 < stack[place].1 {
            stack.swap(place - 1, place);
            place -= 1;
        }
    }
}

/// A ray in all lanes.
struct RayLanes {
    single: PreparedRay,
    org: [Vec4; 3],
    dir: [Vec4; 3],
    inv_dir: [Vec4; 3],
    /// By axis: which bound is met first.
    near: [usize; 3],
}

impl RayLanes {
    #[inline]
    fn new(single: PreparedRay) -> RayLanes {
        let near = |inv_dir: f32| usize::from(inv_dir < 0.0);
        let near = [near(single.inv_dir.x), near(single.inv_dir.y), near(single.inv_dir.z)];
        RayLanes {
            org: splat(single.org),
            dir: splat(single.dir),
            inv_dir: splat(single.inv_dir),
            near,
            single,
        }
    }

    /// Which children the ray meets before `limit`, and where.
    #[inline]
    fn test_boxes(&self, node: &Node, limit: f32) -> (u32, Vec4) {
        let mut tnear = Vec4::splat(self.single.tnear);
        let mut tfar = Vec4::INFINITY;
        for axis in 0..3 {
            let at = |bound: usize| {
                (Vec4::from_array(node.bounds[axis][bound]) - self.org[axis]) * self.inv_dir[axis]
            };
            let near = self.near[axis];
            tnear = tnear.max(at(near));
            tfar = tfar.min(at(1 - near));
        }
        let tfar = (tfar * LATER).min(Vec4::splat(limit));
        (tnear.cmple(tfar).bitmask(), tnear)
    }
}

impl TrianglePacket {
    fn new(mesh: &Mesh, triangles: &[u32]) -> TrianglePacket {
        let mut packet = TrianglePacket { triangles: [NONE; WIDTH], ..TrianglePacket::default() };
        for (lane, &triangle) in triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(triangle as usize);
            packet.triangles[lane] = triangle;
            for axis in 0..3 {
                packet.corner[axis][lane] = a[axis];
                packet.edges[0][axis][lane] = b[axis] - a[axis];
                packet.edges[1][axis][lane] = c[axis] - a[axis];
            }
        }
        packet
    }

    /// All four at once, by the test of Möller and Trumbore.
    #[inline]
    fn test(&self, ray: &RayLanes, best: &mut Hit) {
        let lanes = |[x, y, z]: &[[f32; WIDTH]; 3]| {
            [Vec4::from_array(*x), Vec4::from_array(*y), Vec4::from_array(*z)]
        };
        let (corner, edges) = (lanes(&self.corner), [lanes(&self.edges[0]), lanes(&self.edges[1])]);
        let Met { inside, t, u, v } = test_lanes(&ray.org, &ray.dir, &corner, &edges);
        let within = t.cmpge(Vec4::splat(ray.single.tnear)) & t.cmplt(Vec4::splat(best.t));
        let mut mask = (inside & within).bitmask();
        while mask != 0 {
            let i = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            if t[i] < best.t {
                *best = Hit { t: t[i], u: u[i], v: v[i], prim_id: u64::from(self.triangles[i]), ..Hit::MISS };
            }
        }
    }

    /// One after the other.
    #[inline]
    fn test_each(&self, ray: &RayLanes, best: &mut Hit) {
        let vector = |[x, y, z]: &[[f32; WIDTH]; 3], i: usize| Vec3::new(x[i], y[i], z[i]);
        for i in (0..WIDTH).take_while(|&i| self.triangles[i] != NONE) {
            let a = vector(&self.corner, i);
            let edges = [vector(&self.edges[0], i), vector(&self.edges[1], i)];
            moeller_trumbore::test(a, edges, u64::from(self.triangles[i]), &ray.single, best);
        }
    }
}

impl Structure for MultiBvh {
    fn bytes(&self) -> Bytes {
        Bytes {
            geometry: size_of_val(&self.packets[..]) as u64,
            hierarchy: size_of_val(&self.nodes[..]) as u64,
        }
    }

    #[inline]
    fn intersect(&self, stacks: &mut Stacks, ray: &Ray) -> Hit {
        self.search(stacks, ray, TrianglePacket::test)
    }
}

impl Structure for SingleTriangles<'_> {
    fn bytes(&self) -> Bytes {
        self.0.bytes()
    }

    #[inline]
    fn intersect(&self, stacks: &mut Stacks, ray: &Ray) -> Hit {
        self.0.search(stacks, ray, TrianglePacket::test_each)
    }
}
