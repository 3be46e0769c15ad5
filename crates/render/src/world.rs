//! What the renderer needs of the traced scene: the seam between this crate and whoever answers rays.

use glam::Vec3;
use raystrips_geom::texture::TILE_BYTES;
use raystrips_geom::{Aabb, Attributes, Hit, Ray, Shape, scene::SceneDesc};
use raystrips_tracer::{Loan, OpenError, PageId, Place};
use std::ops::Deref;
use std::sync::Arc;

/// A scene that can be traced. Called from many threads at once. Where not all of it is in memory, an answer can fail.
///
/// Everything is in one space, that of the triangles; [`World::description`] is moved there.
pub trait World: Sync {
    /// Writes the nearest hit of `rays[i]` into `hits[i]`, [`Hit::MISS`] where there is none. The slices have
    /// the same length.
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError>;

    /// The same for rays that keep together, those of neighboring pixels.
    fn intersect_camera_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError> {
        self.intersect_batch(rays, hits)
    }

    /// Writes into `occluded[i]` whether anything lies on the segment of `rays[i]`. The slices have the same
    /// length.
    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) -> Result<(), OpenError>;

    /// How many pages are best brought at a time; `None` where all is in memory, so that no ray ever stops.
    fn pages_at_a_time(&self) -> Option<usize> {
        None
    }

    /// Goes on with those of `rays` that have not ended toward their nearest hits, as far as what is in memory lets them:
    /// `progress[i]` is how far `rays[i]` has come. The slices have the same length.
    fn intersect_ahead(&self, rays: &[Ray], progress: &mut [Progress<Hit>]) -> Result<(), OpenError> {
        let mut hits = vec![Hit::MISS; rays.len()];
        self.intersect_batch(rays, &mut hits)?;
        progress.iter_mut().zip(hits).for_each(|(progress, hit)| *progress = Progress::Ended(hit));
        Ok(())
    }

    /// The same for [`World::occluded_batch`].
    fn occluded_ahead(&self, rays: &[Ray], progress: &mut [Progress<bool>]) -> Result<(), OpenError> {
        let mut occluded = vec![false; rays.len()];
        self.occluded_batch(rays, &mut occluded)?;
        let ended = progress.iter_mut().zip(occluded);
        ended.for_each(|(progress, is_occluded)| *progress = Progress::Ended(is_occluded));
        Ok(())
    }

    /// Brings pages for which rays have stopped.
    fn bring(&self, _pages: &[PageId]) -> Result<(), OpenError> {
        unreachable!("no ray stops where all is in memory")
    }

    /// Writes the triangle of `hits[i]`, which [`World::intersect_batch`] found, into `surfaces[i]`, and leaves it as it
    /// is for a miss. The slices have the same length.
    fn surface_batch(&self, hits: &[Hit], surfaces: &mut [Surface]) -> Result<(), OpenError>;

    /// A box around all triangles.
    fn bounds(&self) -> Aabb;

    /// Materials, lights, cameras and sky.
    fn description(&self) -> &SceneDesc;

    /// Every triangle whose material is emissive: light sampling is only right when none is missing. The order
    /// must not change between runs, since it decides which random number picks which light.
    fn emitters(&self) -> &[Emitter];

    /// A tile of an image of the description; white in worlds without images.
    ///
    /// # Errors
    /// If it cannot be read.
    fn tile(&self, _tile: u64) -> Result<Tile<'_>, OpenError> {
        Ok(Tile::Borrowed(&[255; TILE_BYTES]))
    }

    /// Lends memory that is for pages, in worlds that have some for those. `None` if it has none, or less.
    fn lend(&self, _bytes: u64) -> Option<Loan> {
        None
    }
}

/// How far a ray has come.
#[derive(Clone, Copy, Debug)]
pub enum Progress<T> {
    /// To this place, and has not been traced since.
    Waits(Place),
    /// To this place, where it needs a page that is not in memory.
    Stopped(PageId, Place),
    /// To its end.
    Ended(T),
}

/// The bytes of a tile.
pub enum Tile<'a> {
    /// Those of the world.
    Borrowed(&'a [u8]),
    /// In memory as long as somebody has them.
    Shared(Arc<[u8]>),
}

impl Deref for Tile<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Tile::Borrowed(bytes) => bytes,
            Tile::Shared(bytes) => bytes,
        }
    }
}

/// The triangle or segment that was hit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// Index into [`SceneDesc::geometries`].
    pub geometry: u32,
    /// Number of the triangle, for the use of the caller.
    pub triangle: u64,
    /// What it is.
    pub shape: Shape,
    /// Weight of the second corner at the point that was hit, or the share of the segment before that.
    pub u: f32,
    /// Weight of the third corner; 0 on a segment.
    pub v: f32,
    /// By how much more than elsewhere the next ray may take it to be beside its place.
    pub error: f32,
    /// What the corners of the triangle have besides, if they have anything.
    pub corners: Option<[Attributes; 3]>,
}

/// A triangle that emits light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// Corners as wound in the mesh: counter-clockwise as seen from the front.
    pub corners: [Vec3; 3],
    /// Index into [`SceneDesc::geometries`].
    pub geometry: u32,
}
