//! A pack as a world.

use crate::world::{Emitter, Surface, World};
use glam::Vec3;
use raystrips_geom::{Aabb, Hit, Ray, scene::SceneDesc};
use raystrips_tracer::{Scene, Tracer};

/// A scene of the tracer, ready to be rendered.
pub struct TracedWorld {
    scene: Scene,
    emitters: Vec<Emitter>,
}

impl TracedWorld {
    /// Takes over `scene`.
    pub fn new(scene: Scene) -> TracedWorld {
        let emitter = |e: &raystrips_tracer::Emitter| Emitter {
            corners: e.corners.map(Vec3::from_array),
            geometry: e.geometry,
        };
        let emitters = scene.emitters().iter().map(emitter).collect();
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
        let found = self.scene.resolve(hit);
        Surface {
            geometry: found.geometry,
            triangle: found.triangle,
            corners: found.corners,
            u: found.u,
            v: found.v,
        }
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
