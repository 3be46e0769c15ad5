//! The beginnings of paths, along a Z-curve over the picture.

use crate::{
    params::RenderParams,
    wave::{TILE_EXTENT, Tile},
};
use raystrips_geom::morton;
use raystrips_tracer::PACKET;
use std::ops::Range;

/// Packets started at a time.
const BATCH_PACKETS: u64 = 64;

/// Camera rays that are traced together, by a number from which they can be made again: waiting costs nearly nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraPacket {
    number: u64,
    /// How often it was traced in vain, some page being absent.
    pub attempts: u32,
}

/// The samples of a picture, in batches of neighbors.
pub(crate) struct Starts {
    tiles: Vec<Tile>,
    spp: u64,
    /// Batches of a whole tile.
    per_tile: u64,
}

impl Starts {
    /// Paths started at a time.
    pub const BATCH: u64 = BATCH_PACKETS * PACKET as u64;

    pub fn new(params: &RenderParams) -> Starts {
        let mut tiles = Tile::cover(params.width, params.height);
        tiles.sort_by_key(|tile| morton::encode([tile.x / TILE_EXTENT, tile.y / TILE_EXTENT, 0]));
        let spp = u64::from(params.spp);
        let per_tile = (u64::from(TILE_EXTENT * TILE_EXTENT) * spp).div_ceil(Starts::BATCH);
        Starts { tiles, spp, per_tile }
    }

    pub fn count(&self) -> u64 {
        self.tiles.len() as u64 * self.per_tile
    }

    /// The packets of a batch.
    pub fn packets(&self, batch: u64) -> impl Iterator<Item = CameraPacket> {
        let (_, samples) = self.samples(batch);
        let count = (samples.end - samples.start).div_ceil(PACKET as u64);
        (0..count).map(move |i| CameraPacket { number: batch * BATCH_PACKETS + i, attempts: 0 })
    }

    /// The pixels and numbers of the samples of a packet.
    pub fn of_packet(&self, packet: CameraPacket) -> impl Iterator<Item = ([u32; 2], u32)> {
        let (tile, samples) = self.samples(packet.number / BATCH_PACKETS);
        let begin = samples.start + packet.number % BATCH_PACKETS * PACKET as u64;
        (begin..samples.end.min(begin + PACKET as u64)).map(|sample| {
            let pixel = (sample / self.spp) as u32;
            ([tile.x + pixel % tile.width, tile.y + pixel / tile.width], (sample % self.spp) as u32)
        })
    }

    /// The tile that a batch is in, and which of its samples they are.
    fn samples(&self, batch: u64) -> (&Tile, Range<u64>) {
        let tile = &self.tiles[(batch / self.per_tile) as usize];
        let count = u64::from(tile.width * tile.height) * self.spp;
        let begin = (batch % self.per_tile * Starts::BATCH).min(count);
        (tile, begin..count.min(begin + Starts::BATCH))
    }
}
