//! A pack in memory as a world.

use crate::world::{Emitter, Surface, Tile, World};
use glam::Vec3;
use raystrips_geom::{Aabb, Attributes, Hit, Ray, scene::SceneDesc};
use raystrips_tracer::{OpenError, ResolvedHit, Scene, Tracer};

/// A scene of the tracer, ready to be rendered.
pub struct TracedWorld {
    scene: Scene,
    emitters: Vec<Emitter>,
}

impl TracedWorld {
    /// Takes over `scene`.
    pub fn new(scene: Scene) -> TracedWorld {
        let emitters = emitters(scene.emitters());
        TracedWorld { scene: scene.with_opacity(), emitters }
    }

    fn surface(&self, hit: &Hit) -> Surface {
        let found = self.scene.locate(hit);
        let corners = self.scene.attributes(hit, found.triangle);
        surface_of(&found, corners)
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

impl World for TracedWorld {
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError> {
        Tracer::new(&self.scene).intersect_batch(rays, hits);
        Ok(())
    }

    fn intersect_camera_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError> {
        Tracer::new(&self.scene).intersect_packet(rays, hits);
        Ok(())
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) -> Result<(), OpenError> {
        Tracer::new(&self.scene).occluded_batch(rays, occluded);
        Ok(())
    }

    fn surface_batch(&self, hits: &[Hit], surfaces: &mut [Surface]) -> Result<(), OpenError> {
        let pairs = hits.iter().zip(surfaces).filter(|(hit, _)| hit.is_hit());
        pairs.for_each(|(hit, surface)| *surface = self.surface(hit));
        Ok(())
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

    fn tile(&self, tile: u64) -> Result<Tile<'_>, OpenError> {
        Ok(Tile::Borrowed(self.scene.tile(tile)))
    }
}

pub(crate) fn emitters(stored: &[raystrips_tracer::Emitter]) -> Vec<Emitter> {
    let emitter = |e: &raystrips_tracer::Emitter| Emitter {
        corners: e.corners.map(Vec3::from_array),
        geometry: e.geometry,
    };
    stored.iter().map(emitter).collect()
}

pub(crate) fn surface_of(found: &ResolvedHit, corners: Option<[Attributes; 3]>) -> Surface {
    let &ResolvedHit { geometry, triangle, shape, u, v, error } = found;
    Surface { geometry, triangle, shape, u, v, error, corners }
}
