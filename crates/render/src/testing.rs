//! For tests: a world that tries every triangle in f64, and small scenes.

use crate::{
    integrator::Shader,
    material::Materials,
    params::RenderParams,
    render::{Part, RenderOutput, Watch, render, render_given_tiles},
    unfinished::Unfinished,
    wave::Tile,
    world::{Emitter, Surface, World},
};
use glam::{DVec3, Vec3};
use raystrips_geom::{
    Aabb, Hit, Ray, Shape,
    scene::{Camera, Geometry, Material, Projection, SceneDesc},
};
use raystrips_tracer::OpenError;

/// Triangles in a list.
#[derive(Default)]
pub(crate) struct BruteWorld {
    pub description: SceneDesc,
    triangles: Vec<Emitter>,
    emitters: Vec<Emitter>,
}

impl BruteWorld {
    /// Adds triangles of a new geometry.
    pub fn add(&mut self, triangles: &[[Vec3; 3]], material: Material) {
        let geometry = self.description.geometries.len() as u32;
        let triangles = triangles.iter().map(|&corners| Emitter { corners, geometry });
        if material.is_lamp() {
            self.emitters.extend(triangles.clone());
        }
        self.triangles.extend(triangles);
        let index = self.description.materials.len() as u32;
        self.description.geometries.push(Geometry {
            name: String::new(),
            material: index,
            has_triangles: true,
        });
        self.description.materials.push(material);
    }

    fn intersect(&self, ray: &Ray) -> Hit {
        let mut nearest = Hit::MISS;
        let mut tfar = f64::from(ray.tfar);
        for (i, triangle) in self.triangles.iter().enumerate() {
            if let Some([t, u, v]) = intersect_triangle(&triangle.corners, ray, tfar) {
                tfar = t;
                nearest = Hit { t: t as f32, u: u as f32, v: v as f32, prim_id: i as u64, ..Hit::MISS };
            }
        }
        nearest
    }
}

impl World for BruteWorld {
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError> {
        rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.intersect(ray));
        Ok(())
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) -> Result<(), OpenError> {
        rays.iter().zip(occluded).for_each(|(ray, occluded)| *occluded = self.intersect(ray).is_hit());
        Ok(())
    }

    fn surface_batch(&self, hits: &[Hit], surfaces: &mut [Surface]) -> Result<(), OpenError> {
        for (hit, surface) in hits.iter().zip(surfaces).filter(|(hit, _)| hit.is_hit()) {
            let Emitter { corners, geometry } = self.triangles[hit.prim_id as usize];
            *surface = Surface {
                geometry,
                triangle: hit.prim_id,
                shape: Shape::Triangle(corners),
                u: hit.u,
                v: hit.v,
                error: 0.0,
                corners: None,
            };
        }
        Ok(())
    }

    fn bounds(&self) -> Aabb {
        Aabb::of_points(self.triangles.iter().flat_map(|triangle| triangle.corners))
    }

    fn description(&self) -> &SceneDesc {
        &self.description
    }

    fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }
}

/// Moeller and Trumbore 1997 in f64: t, u, v.
fn intersect_triangle(corners: &[Vec3; 3], ray: &Ray, tfar: f64) -> Option<[f64; 3]> {
    let [p0, p1, p2] = corners.map(|corner| corner.as_dvec3());
    let (dir, s): (DVec3, DVec3) = (ray.dir.as_dvec3(), ray.org.as_dvec3() - p0);
    let (e1, e2) = (p1 - p0, p2 - p0);
    let (q, r) = (s.cross(e1), dir.cross(e2));
    let det = e1.dot(r);
    let [t, u, v] = [e2.dot(q) / det, s.dot(r) / det, dir.dot(q) / det];
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    (inside && t >= f64::from(ray.tnear) && t < tfar).then_some([t, u, v])
}

/// Two triangles; the front is the side from which the corners run counter-clockwise.
pub(crate) fn quad(corner: Vec3, a: Vec3, b: Vec3) -> [[Vec3; 3]; 2] {
    [[corner, corner + a, corner + a + b], [corner, corner + a + b, corner + b]]
}

/// The walls of a box, with their fronts outside.
pub(crate) fn box_walls(min: Vec3, max: Vec3) -> Vec<[Vec3; 3]> {
    let e = max - min;
    let [x, y, z] = [Vec3::X * e.x, Vec3::Y * e.y, Vec3::Z * e.z];
    let walls = [quad(min, y, x), quad(min, z, y), quad(min, x, z)];
    let opposite = [quad(max, -y, -x), quad(max, -z, -y), quad(max, -x, -z)];
    // A quad spanned from the greatest corner by the reversed edges faces the other way; swap to face outside.
    let flip = |[p0, p1, p2]: [Vec3; 3]| [p0, p2, p1];
    walls.into_iter().flatten().chain(opposite.into_iter().flatten().map(flip)).collect()
}

/// The same triangles seen from the other side.
pub(crate) fn reversed(triangles: &[[Vec3; 3]]) -> Vec<[Vec3; 3]> {
    triangles.iter().map(|&[p0, p1, p2]| [p0, p2, p1]).collect()
}

pub(crate) fn matte(base_color: [f32; 3]) -> Material {
    Material { base_color, ..Material::default() }
}

/// A black surface that emits.
pub(crate) fn lamp(emission: [f32; 3]) -> Material {
    Material { base_color: [0.0; 3], emission, ..Material::default() }
}

/// A camera that looks at one point through a picture of nearly no size.
pub(crate) fn probe(position: Vec3, target: Vec3) -> Camera {
    let forward = (target - position).normalize();
    Camera {
        name: String::new(),
        position: position.as_dvec3().into(),
        forward: forward.into(),
        up: forward.any_orthonormal_vector().into(),
        projection: Projection::Orthographic { height: 1e-4 * position.distance(target) },
        aspect: None,
    }
}

/// A box with a lamp in its ceiling, a red and a green wall and two blocks, in the unit cube: 36 triangles.
pub(crate) fn cornell_box() -> BruteWorld {
    let mut world = BruteWorld::default();
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let white = [quad(Vec3::ZERO, z, x), quad(y, x, z), quad(Vec3::ZERO, x, y)].concat();
    world.add(&white, matte([0.73; 3]));
    world.add(&quad(Vec3::ZERO, y, z), matte([0.65, 0.05, 0.05]));
    world.add(&quad(x, z, y), matte([0.12, 0.45, 0.15]));
    world.add(&quad(Vec3::new(0.35, 0.998, 0.35), x * 0.3, z * 0.3), lamp([15.0, 11.0, 5.0]));
    let tall = box_walls(Vec3::new(0.15, 0.0, 0.15), Vec3::new(0.45, 0.6, 0.4));
    let low = box_walls(Vec3::new(0.55, 0.0, 0.5), Vec3::new(0.85, 0.3, 0.8));
    world.add(&[tall, low].concat(), matte([0.73; 3]));
    world.description.cameras.push(Camera {
        name: "front".into(),
        position: [0.5, 0.5, 2.4],
        forward: [0.0, 0.0, -1.0],
        up: [0.0, 1.0, 0.0],
        projection: Projection::Perspective { vertical_fov: 0.68 },
        aspect: None,
    });
    world
}

/// Renders without progress.
pub(crate) fn render_quietly(world: &dyn World, params: &RenderParams) -> RenderOutput {
    render(world, params, &|_| {}).expect("the parameters of tests are valid")
}

/// Mean of all pixels.
pub(crate) fn mean(output: &RenderOutput) -> Vec3 {
    let count = (output.film.width() * output.film.height()) as usize;
    (0..count).map(|pixel| Vec3::from(output.film.rgb(pixel))).sum::<Vec3>() / count as f32
}

#[test]
fn boxes_face_outside() {
    let center = Vec3::new(1.0, 2.0, 3.0);
    for [p0, p1, p2] in box_walls(center - 0.5, center + 0.5) {
        assert!((p1 - p0).cross(p2 - p0).dot(p0 - center) > 0.0);
    }
}

/// Renders the tiles with a shader that is not one of the parameters'.
pub(crate) fn render_tiles_with(
    world: &dyn World,
    params: &RenderParams,
    (materials, shader): (&Materials, &dyn Shader),
    tiles: &[Tile],
) -> RenderOutput {
    let (begin, watch) = (Unfinished::new(params), &Watch { is_due: &|| false, progress: &|_| {} });
    let part = Part { params, shader, materials, begin, watch };
    render_given_tiles(world, tiles, part).unwrap().into_output()
}
