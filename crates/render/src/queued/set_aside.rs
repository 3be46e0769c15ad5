//! Rays that a worker cannot go on with, until they are put into queues all at once.

use super::waiting::{Answer, Waiting};
use crate::{starts::CameraPacket, waiting_path::WaitingPath, wave::PendingLight};
use raystrips_tracer::{PACKET, PageId, Parked};

/// Rays with the page that each needs, in the order in which they came.
#[derive(Default)]
pub(super) struct SetAside {
    pub closest: Vec<(PageId, Parked<WaitingPath>)>,
    pub shadow: Vec<(PageId, Parked<PendingLight>)>,
    pub hits: Vec<(PageId, Answer)>,
    pub packets: Vec<(PageId, CameraPacket)>,
    /// What is put into queues, by run.
    places: Vec<Place>,
}

/// Where one is: its run of pages, its kind, its number among those of its kind.
type Place = (u32, Kind, u32);

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Closest,
    Shadow,
    Hit,
    Packet,
}

impl SetAside {
    /// How many rays they are.
    pub fn rays(&self) -> usize {
        self.closest.len() + self.shadow.len() + self.hits.len() + self.packets.len() * PACKET
    }

    /// Sorts them by run of pages.
    pub fn sort(&mut self, run_of: impl Fn(PageId) -> u32) {
        let SetAside { closest, shadow, hits, packets, places } = self;
        places.clear();
        let mut add = |kind, pages: &mut dyn Iterator<Item = PageId>| {
            places.extend((0..).zip(pages).map(|(number, page)| (run_of(page), kind, number)));
        };
        add(Kind::Closest, &mut closest.iter().map(|(page, _)| *page));
        add(Kind::Shadow, &mut shadow.iter().map(|(page, _)| *page));
        add(Kind::Hit, &mut hits.iter().map(|(page, _)| *page));
        add(Kind::Packet, &mut packets.iter().map(|(page, _)| *page));
        places.sort_unstable();
    }

    /// For each run what adds its rays to a queue, once they are sorted.
    pub fn by_run(&self) -> impl Iterator<Item = (u32, impl FnOnce(&mut Waiting))> {
        self.places.chunk_by(|a, b| a.0 == b.0).map(move |places| {
            let (run, ..) = places[0];
            (run, move |queue: &mut Waiting| self.add(places, queue))
        })
    }

    fn add(&self, places: &[Place], queue: &mut Waiting) {
        for places in places.chunk_by(|a, b| a.1 == b.1) {
            let (_, kind, _) = places[0];
            let numbers = places.iter().map(|&(.., number)| number as usize);
            match kind {
                Kind::Closest => {
                    queue.closest.reserve(places.len());
                    numbers.for_each(|i| queue.closest.push_parked(&self.closest[i].1));
                }
                Kind::Shadow => {
                    queue.shadow.reserve(places.len());
                    numbers.for_each(|i| queue.shadow.push_parked(&self.shadow[i].1));
                }
                Kind::Hit => queue.hits.extend(numbers.map(|i| self.hits[i].1)),
                Kind::Packet => queue.packets.extend(numbers.map(|i| self.packets[i].1)),
            }
        }
    }

    /// Removes all.
    pub fn clear(&mut self) {
        self.closest.clear();
        self.shadow.clear();
        self.hits.clear();
        self.packets.clear();
    }
}
