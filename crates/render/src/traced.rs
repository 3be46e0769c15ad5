//! A pack as a world.

use crate::world::{Emitter, Surface, World};
use glam::Vec3;
use raystrips_geom::{Aabb, Hit, Ray, scene::SceneDesc};
use raystrips_tracer::{PagePool, ResolvedHit, Scene, Tracer};

/// A scene of the tracer, ready to be rendered.
pub struct TracedWorld {
    scene: Scene,
    emitters: Vec<Emitter>,
}

impl TracedWorld {
    /// Takes over `scene`.
    pub fn new(scene: Scene) -> TracedWorld {
        let emitters = emitters(scene.emitters());
        TracedWorld { scene, emitters }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

impl World for TracedWorld {
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) {
        Tracer::new(&self.scene).intersect_batch(rays, hits);
    }

    fn intersect_camera_batch(&self, rays: &[Ray], hits: &mut [Hit]) {
        Tracer::new(&self.scene).intersect_packet(rays, hits);
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) {
        Tracer::new(&self.scene).occluded_batch(rays, occluded);
    }

    fn surface(&self, hit: &Hit) -> Surface {
        surface_of(&self.scene.locate(hit))
    }

    fn bounds(&self) -> Aabb {
        self.scene.bounds()
    }

    fn description(&self) -> &SceneDesc {
        self.scene.description()
    }

    fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }
}

/// A pack of which some pages are in memory, ready to be [rendered](crate::render_queued).
pub struct PagedWorld {
    pool: PagePool,
    emitters: Vec<Emitter>,
}

impl PagedWorld {
    /// Takes over `pool`.
    pub fn new(pool: PagePool) -> PagedWorld {
        let emitters = emitters(&pool.pack().emitters);
        PagedWorld { pool, emitters }
    }

    /// The pages.
    pub fn pool(&self) -> &PagePool {
        &self.pool
    }

    pub(crate) fn description(&self) -> &SceneDesc {
        &self.pool.pack().manifest.scene
    }

    pub(crate) fn bounds(&self) -> Aabb {
        let manifest = &self.pool.pack().manifest;
        Aabb { min: Vec3::from_array(manifest.bounds_min), max: Vec3::from_array(manifest.bounds_max) }
    }

    pub(crate) fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }
}

fn emitters(stored: &[raystrips_tracer::Emitter]) -> Vec<Emitter> {
    let emitter = |e: &raystrips_tracer::Emitter| Emitter {
        corners: e.corners.map(Vec3::from_array),
        geometry: e.geometry,
    };
    stored.iter().map(emitter).collect()
}

pub(crate) fn surface_of(found: &ResolvedHit) -> Surface {
    let &ResolvedHit { geometry, triangle, corners, u, v } = found;
    Surface { geometry, triangle, corners, u, v }
}
