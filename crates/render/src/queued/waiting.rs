//! What waits for pages, in few bytes.

use crate::starts::CameraPacket;
use crate::{waiting_path::WaitingPath, wave::PendingLight};
use raystrips_geom::{Hit, Ray};
use raystrips_reorder::Parcel;
use raystrips_tracer::{PACKET, RayBuffer};

/// A ray that has its hit.
#[derive(Clone, Copy)]
pub(super) struct Answer {
    pub path: WaitingPath,
    pub ray: Ray,
    pub hit: Hit,
}

/// Bytes of a ray that waits, at about, with what queues have to spare.
pub(super) const RAY_BYTES: usize = 80;

/// What waits for a run of pages.
#[derive(Default)]
pub(super) struct Waiting {
    pub closest: RayBuffer<WaitingPath>,
    pub shadow: RayBuffer<PendingLight>,
    /// Hits in one of the pages, whose surface is needed.
    pub hits: Vec<Answer>,
    pub packets: Vec<CameraPacket>,
}

impl Parcel for Waiting {
    fn append(&mut self, other: &mut Waiting) {
        self.closest.append(&mut other.closest);
        self.shadow.append(&mut other.shadow);
        self.hits.append(&mut other.hits);
        self.packets.append(&mut other.packets);
    }

    fn rays(&self) -> usize {
        self.closest.len() + self.shadow.len() + self.hits.len() + self.packets.len() * PACKET
    }

    fn bytes(&self) -> usize {
        self.closest.bytes()
            + self.shadow.bytes()
            + self.hits.capacity() * size_of::<Answer>()
            + self.packets.capacity() * size_of::<CameraPacket>()
    }
}
