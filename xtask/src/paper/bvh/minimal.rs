//! "Minimal" triangles (paper, sections 3.2 and 6.1): three indices into a global list of vertices. The paper adds
//! two bytes of material, which are left out of all structures here.

use super::super::mesh::Mesh;
use super::super::moeller_trumbore::{self, Met, splat, test_lanes};
use super::super::packet::{Packet, PacketHits};
use super::super::ray::PreparedRay;
use super::TriangleList;
use glam::Vec3;
use raystrips_geom::Hit;

/// Triangles as vertices of a global list.
pub struct Minimal {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Minimal {
    #[inline]
    fn corners(&self, i: usize) -> [Vec3; 3] {
        let [a, b, c] = self.triangles[i];
        [self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]]
    }
}

impl TriangleList for Minimal {
    fn new(mesh: &Mesh, order: &[u32]) -> Minimal {
        let triangles = order.iter().map(|&i| mesh.triangles[i as usize]).collect();
        Minimal { positions: mesh.positions.clone(), triangles }
    }

    fn bytes(&self) -> u64 {
        (size_of_val(&self.positions[..]) + size_of_val(&self.triangles[..])) as u64
    }

    #[inline]
    fn test(&self, i: usize, ray: &PreparedRay, best: &mut Hit) {
        let [a, b, c] = self.corners(i);
        moeller_trumbore::test(a, [b - a, c - a], i as u64, ray, best);
    }

    #[inline]
    fn test_packet(&self, i: usize, packet: &Packet, best: &mut PacketHits) {
        let [a, b, c] = self.corners(i);
        let edges = [splat(b - a), splat(c - a)];
        let Met { inside, t, u, v } = test_lanes(&packet.org, &packet.dir, &splat(a), &edges);
        let mask = (inside & t.cmpge(packet.tnear) & t.cmplt(best.t)).bitmask();
        if mask != 0 {
            best.update(mask, t, u, v, i as u64);
        }
    }
}
