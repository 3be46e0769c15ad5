//! The beginnings of paths.

use crate::{
    params::RenderParams,
    wave::{TILE_EXTENT, Tile},
};

/// Paths started at a time.
const BATCH: u64 = 4096;

/// The samples of a picture, in batches of neighbors.
pub(super) struct Starts {
    tiles: Vec<Tile>,
    spp: u64,
    /// Batches of a whole tile.
    per_tile: u64,
}

impl Starts {
    pub fn new(params: &RenderParams) -> Starts {
        let tiles = Tile::cover(params.width, params.height);
        let spp = u64::from(params.spp);
        let per_tile = (u64::from(TILE_EXTENT * TILE_EXTENT) * spp).div_ceil(BATCH);
        Starts { tiles, spp, per_tile }
    }

    pub fn count(&self) -> u64 {
        self.tiles.len() as u64 * self.per_tile
    }

    /// The pixels and numbers of the samples of a batch.
    pub fn batch(&self, number: u64) -> impl Iterator<Item = ([u32; 2], u32)> {
        let tile = &self.tiles[(number / self.per_tile) as usize];
        let begin = number % self.per_tile * BATCH;
        let end = (begin + BATCH).min(u64::from(tile.width * tile.height) * self.spp);
        (begin..end).map(|sample| {
            let pixel = (sample / self.spp) as u32;
            ([tile.x + pixel % tile.width, tile.y + pixel / tile.width], (sample % self.spp) as u32)
        })
    }
}
