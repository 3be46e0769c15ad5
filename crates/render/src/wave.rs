//! Waves: batches of paths whose rays are generated, traced and shaded in separate steps over arrays.
//!
//! A tile of the picture is worked through in waves of some thousand paths. Between the steps stand queues of
//! rays, each with what is needed to go on once it is answered; nothing depends on the order in them.

use crate::{
    deposits::Deposits,
    film::Film,
    integrator::{Shader, follow},
    interaction::{Seen, SurfaceInteraction},
    material::Materials,
    params::RenderParams,
    render::RenderStats,
    sampler::PathSampler,
    shadow,
    world::{Surface, World},
};
use glam::Vec3;
use raystrips_geom::{Aabb, Hit, Ray, morton};
use raystrips_tracer::OpenError;
use std::{mem, ops::Range, time::Instant};

/// Pixels along a side of a tile.
pub(crate) const TILE_EXTENT: u32 = 32;

/// Paths in flight a thread, with their branches: many enough to amortize a batch, few enough that their 4 MB stay in its
/// cache.
const WAVE_PATHS: u64 = 1 << 14;

/// A rectangle of the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Tile {
    /// The tiles of a picture, row by row.
    pub fn cover(width: u32, height: u32) -> Vec<Tile> {
        let starts = |extent: u32| (0..extent).step_by(TILE_EXTENT as usize);
        let tile =
            |x, y| Tile { x, y, width: TILE_EXTENT.min(width - x), height: TILE_EXTENT.min(height - y) };
        starts(height).flat_map(|y| starts(width).map(move |x| tile(x, y))).collect()
    }
}

/// A path on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    /// Pixel of the film of the tile, or of the picture.
    pub pixel: u32,
    pub sampler: PathSampler,
    /// Share of the light found next that reaches the pixel.
    pub throughput: Vec3,
    /// Density over solid angle of the current direction where light sampling could have found it too.
    pub scatter_pdf: Option<f32>,
    /// Rays traced before the current one.
    pub segment: u32,
    /// Surfaces that reflected the path.
    pub bounces: u32,
    /// Partly opaque surfaces that the path passed.
    pub passed: u32,
    /// What it is out for, as its shader says.
    pub errand: u8,
    /// What the current ray runs through, by [`Materials::absorption`]; 0 for nothing.
    pub medium: u8,
    /// How wide what is seen at once is where the current ray begins, in scene units.
    pub width: f32,
    /// How much wider it is for each unit of length from there.
    pub spread: f32,
    /// Distance from the surface that reflected the path last, past others, to where the current ray begins.
    pub straight: f32,
}

impl Path {
    /// A path that begins with so much light, or importance.
    pub fn new(pixel: u32, sampler: PathSampler, throughput: Vec3) -> Path {
        let scatter_pdf = None;
        Path {
            pixel,
            sampler,
            throughput,
            scatter_pdf,
            segment: 0,
            bounces: 0,
            passed: 0,
            errand: 0,
            medium: 0,
            width: 0.0,
            spread: 0.0,
            straight: 0.0,
        }
    }

    /// A shadow ray on its way: see [`shadow`].
    pub fn shadow(pixel: u32, light: Vec3) -> Path {
        let sampler = PathSampler::new([0; 2], 0, 0);
        Path { segment: Path::SHADOW, bounces: Path::SHADOW, ..Path::new(pixel, sampler, light) }
    }

    /// Segments that no path has.
    pub const SHADOW: u32 = u32::MAX;

    /// True if it is a shadow ray.
    pub fn is_shadow(&self) -> bool {
        self.segment == Path::SHADOW
    }

    /// How wide what is seen at once is at a distance along the current ray.
    pub fn width_at(&self, distance: f32) -> f32 {
        self.width + self.spread * distance
    }

    /// Comes to the end of the current ray.
    pub fn widen(&mut self, hit: Option<&SurfaceInteraction>) {
        self.width = hit.map_or(self.width, |hit| self.width_at(hit.distance));
    }
}

/// Rays that wait, each with its errand.
#[derive(Default)]
struct RayQueue<T> {
    rays: Vec<Ray>,
    errands: Vec<T>,
}

impl<T> RayQueue<T> {
    fn push(&mut self, ray: Ray, errand: T) {
        self.rays.push(ray);
        self.errands.push(errand);
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.errands.clear();
    }
}

/// Light that reaches a pixel unless a shadow ray finds something.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PendingLight {
    pub pixel: u32,
    pub contribution: Vec3,
}

/// Where shading leaves its results.
pub(crate) struct ShadeOutput<'a> {
    pub deposits: &'a mut Deposits,
    pub shadow: &'a mut dyn FnMut(Ray, PendingLight),
    pub branch: &'a mut dyn FnMut(Ray, &Path),
}

impl ShadeOutput<'_> {
    /// Adds light to the path's pixel.
    pub fn add(&mut self, path: &Path, light: Vec3) {
        self.deposits.add(path.pixel, light);
    }

    /// Adds light to the path's pixel once `ray` has been found free.
    pub fn add_unless_occluded(&mut self, path: &Path, ray: Ray, contribution: Vec3) {
        if contribution != Vec3::ZERO {
            (self.shadow)(ray, PendingLight { pixel: path.pixel, contribution });
        }
    }

    /// Lets a path go on with `ray` beside the one that is shaded.
    pub fn branch(&mut self, ray: Ray, path: &Path) {
        (self.branch)(ray, path);
    }

    /// Records the first surface of the path.
    pub fn add_first_hit(&mut self, path: &Path, hit: &SurfaceInteraction) {
        self.deposits.add_first_hit(path, hit);
    }
}

/// What all waves of a picture share.
pub(crate) struct WaveContext<'a> {
    pub world: &'a dyn World,
    pub params: &'a RenderParams,
    pub materials: &'a Materials,
    pub shader: &'a dyn Shader,
}

/// The arrays of a wave, kept from wave to wave.
#[derive(Default)]
pub(crate) struct Wave {
    paths: Vec<Path>,
    /// Errands are indices of paths.
    current: RayQueue<u32>,
    next: RayQueue<u32>,
    hits: Vec<Hit>,
    surfaces: Vec<Surface>,
    /// In which order hits are shaded.
    order: Vec<u32>,
    shadow: RayQueue<PendingLight>,
    /// Rays of paths that have no number yet.
    branches: Vec<(Ray, Path)>,
    occluded: Vec<bool>,
    deposits: Deposits,
    stats: RenderStats,
}

impl Wave {
    /// Renders a tile.
    pub fn render_tile(
        &mut self,
        context: &WaveContext,
        tile: &Tile,
    ) -> Result<(Film, RenderStats), OpenError> {
        let mut film = Film::new(tile.width, tile.height, context.params.aovs);
        self.stats = RenderStats::default();
        let sample_count = u64::from(tile.width * tile.height) * u64::from(context.params.spp);
        let begun = WAVE_PATHS.div_ceil(context.shader.most_branches() as u64);
        for start in (0..sample_count).step_by(begun as usize) {
            self.generate(context, tile, start..sample_count.min(start + begun), &mut film);
            let mut are_camera_rays = true;
            while !self.current.rays.is_empty() {
                self.intersect(context, are_camera_rays)?;
                are_camera_rays = false;
                self.shade(context, &mut film)?;
                self.resolve_shadows(context, &mut film)?;
                mem::swap(&mut self.current, &mut self.next);
            }
        }
        Ok((film, mem::take(&mut self.stats)))
    }

    /// Begins the paths of a range of the tile's samples, which are numbered pixel by pixel.
    fn generate(&mut self, context: &WaveContext, tile: &Tile, samples: Range<u64>, film: &mut Film) {
        let start = Instant::now();
        self.paths.clear();
        self.current.clear();
        let spp = u64::from(context.params.spp);
        for sample in samples {
            let (pixel, sample_index) = ((sample / spp) as u32, (sample % spp) as u32);
            let (x, y) = (tile.x + pixel % tile.width, tile.y + pixel / tile.width);
            film.begin_sample(pixel as usize);
            let (ray, path) = context.shader.begin([x, y], sample_index, pixel);
            self.current.push(ray, self.paths.len() as u32);
            self.paths.push(path);
        }
        self.stats.primary += self.paths.len() as u64;
        self.stats.seconds.generate += start.elapsed().as_secs_f64();
    }

    fn intersect(&mut self, context: &WaveContext, are_camera_rays: bool) -> Result<(), OpenError> {
        let start = Instant::now();
        self.hits.clear();
        self.hits.resize(self.current.rays.len(), Hit::MISS);
        let (rays, hits) = (&self.current.rays, &mut self.hits);
        match are_camera_rays {
            true => context.world.intersect_camera_batch(rays, hits)?,
            false => context.world.intersect_batch(rays, hits)?,
        }
        self.surfaces.resize(self.hits.len(), Surface::default());
        context.world.surface_batch(&self.hits, &mut self.surfaces)?;
        self.stats.seconds.trace += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Shades the hits of the current rays and fills the queues of next and shadow rays.
    fn shade(&mut self, context: &WaveContext, film: &mut Film) -> Result<(), OpenError> {
        let start = Instant::now();
        self.next.clear();
        self.shadow.clear();
        let mut push = |ray, pending| self.shadow.push(ray, pending);
        let mut branch = |ray, path: &Path| self.branches.push((ray, *path));
        let mut out = ShadeOutput { deposits: &mut self.deposits, shadow: &mut push, branch: &mut branch };
        self.order.clear();
        self.order.extend(0..self.hits.len() as u32);
        if context.shader.looks_around() {
            sort_by_place(&mut self.order, &self.current.rays, &self.hits, &context.world.bounds());
        }
        for i in self.order.iter().map(|&i| i as usize) {
            let (ray, path_index) = (&self.current.rays[i], self.current.errands[i]);
            let path = &mut self.paths[path_index as usize];
            let place = Seen { world: context.world, materials: context.materials, ray, path };
            let hit = place.surface(&self.hits[i], &self.surfaces[i])?;
            path.widen(hit.as_ref());
            let next = follow(context.shader, path, ray, hit.as_ref(), &mut out);
            if let Some(next) = next {
                self.stats.count(path);
                self.next.push(next, path_index);
            }
        }
        self.deposits.flush(film);
        self.stats.shadow += self.shadow.rays.len() as u64;
        self.branches.iter().for_each(|(_, path)| self.stats.count(path));
        if context.materials.are_see_through() {
            let RayQueue { rays, errands } = &mut self.shadow;
            let lights = errands.drain(..).map(shadow::path);
            self.branches.extend(rays.drain(..).zip(lights));
        }
        for (ray, path) in self.branches.drain(..) {
            self.next.push(ray, self.paths.len() as u32);
            self.paths.push(path);
        }
        self.stats.seconds.shade += start.elapsed().as_secs_f64();
        Ok(())
    }

    fn resolve_shadows(&mut self, context: &WaveContext, film: &mut Film) -> Result<(), OpenError> {
        let start = Instant::now();
        self.occluded.clear();
        self.occluded.resize(self.shadow.rays.len(), false);
        context.world.occluded_batch(&self.shadow.rays, &mut self.occluded)?;
        let traced = Instant::now();
        for (pending, &occluded) in self.shadow.errands.iter().zip(&self.occluded) {
            if !occluded {
                film.add(pending.pixel as usize, pending.contribution);
            }
        }
        self.stats.seconds.trace += (traced - start).as_secs_f64();
        self.stats.seconds.shade += traced.elapsed().as_secs_f64();
        Ok(())
    }
}

/// Sorts numbers of rays along a Morton curve through their hits.
fn sort_by_place(order: &mut [u32], rays: &[Ray], hits: &[Hit], bounds: &Aabb) {
    let scale = (1u32 << morton::AXIS_BITS) as f32 / bounds.extent().max_element().max(f32::MIN_POSITIVE);
    let key = |i: &u32| {
        let (ray, hit) = (&rays[*i as usize], &hits[*i as usize]);
        let place = (ray.at(hit.t) - bounds.min) * scale;
        if hit.is_hit() { morton::encode(place.to_array().map(|x| x as u32)) } else { u64::MAX }
    };
    order.sort_by_cached_key(key);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (width, height) in [(1, 1), (32, 32), (33, 65), (100, 7)] {
            let mut seen = vec![0; (width * height) as usize];
            for tile in Tile::cover(width, height) {
                for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
                    seen[((tile.y + y) * width + tile.x + x) as usize] += 1;
                }
            }
            assert!(seen.iter().all(|&count| count == 1));
        }
    }

    #[test]
    fn what_scatters_spreads_the_view_from_there_on() {
        let mut path = Path { spread: 0.001, ..Path::new(0, PathSampler::new([0; 2], 0, 0), Vec3::ONE) };
        path.width = path.width_at(1000.0);
        path.spread = 0.5;
        // However far the camera is, near a rough surface little is blurred.
        assert!((path.width_at(0.1) - 1.05).abs() < 1e-6);
    }
}
