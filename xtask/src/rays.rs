//! Rays for measuring: of the kinds that renderers trace, from a scene of its own.

use glam::Vec3;
use raystrips_geom::{Hit, Ray, Shape};
use raystrips_tracer::{Scene, Tracer};

/// Most rays of one kind.
const MAX_RAYS: usize = 1 << 20;
/// Pixels along a side of the picture of primary rays.
const PICTURE: usize = 1024;
/// Half the field of view of that picture, in radians.
const HALF_FOV: f32 = std::f32::consts::FRAC_PI_8;

/// Camera rays in scan-line order; occlusion rays a quarter of the diagonal long from what they hit; rays of the
/// second diffuse bounce; chords between points of the bounding sphere: all in the order in which a renderer makes
/// them.
pub fn ray_sets(scene: &Scene) -> [Vec<Ray>; 4] {
    ray_sets_of(scene, PICTURE)
}

/// The same for a picture of `side` x `side` pixels.
pub fn ray_sets_of(scene: &Scene, side: usize) -> [Vec<Ray>; 4] {
    let mut maker = Maker::new(scene);
    let primary = maker.primary(side);
    let first: Vec<Bounce> = primary.iter().filter_map(|ray| maker.bounce(ray)).collect();
    let reach = 0.25 * maker.radius * 2.0;
    let ao = first
        .iter()
        .take(MAX_RAYS / 4)
        .flat_map(|b| [0, 1, 2, 3].map(|k| Ray { tfar: reach, ..b.ray(k) }))
        .collect();
    let second = first.iter().filter_map(|b| maker.bounce(&b.ray(4))).map(|b| b.ray(5)).collect();
    let chord = (0..MAX_RAYS).map(|i| maker.chord(i as u64)).collect();
    [primary, ao, second, chord]
}

/// Camera rays of a picture of `side` x `side` pixels in scan-line order.
pub fn picture(scene: &Scene, side: usize) -> Vec<Ray> {
    Maker::new(scene).primary(side)
}

/// The rays of a picture, `side` by `side` in scan-line order, in blocks of `block` by `block`, which divides `side`.
pub fn in_blocks<T: Copy>(picture: &[T], side: usize, block: usize) -> Vec<T> {
    let pixels =
        move |first: usize| (first..first + block).flat_map(move |y| (0..block).map(move |x| (x, y)));
    let blocks = (0..side).step_by(block).flat_map(|y| (0..side).step_by(block).map(move |x| (x, y)));
    blocks.flat_map(|(left, top)| pixels(top).map(move |(x, y)| picture[y * side + left + x])).collect()
}

struct Maker<'s> {
    scene: &'s Scene,
    tracer: Tracer<'s>,
    center: Vec3,
    radius: f32,
}

/// A point off a surface and the normal there.
struct Bounce {
    point: Vec3,
    normal: Vec3,
    seed: u64,
}

impl Bounce {
    /// The `k`th diffuse ray from here.
    fn ray(&self, k: u64) -> Ray {
        let mut random = Random(self.seed.wrapping_mul(31).wrapping_add(k));
        // A point of the unit sphere on top of the surface: cosine-weighted.
        let dir = (self.normal + random.direction()).normalize_or(self.normal);
        Ray::new(self.point, dir)
    }
}

impl<'s> Maker<'s> {
    fn new(scene: &'s Scene) -> Maker<'s> {
        let bounds = scene.bounds();
        Maker { scene, tracer: Tracer::new(scene), center: bounds.center(), radius: bounds.diagonal() * 0.5 }
    }

    fn primary(&self, side: usize) -> Vec<Ray> {
        let view = Vec3::new(-0.55, -0.35, -0.76).normalize();
        let right = view.cross(Vec3::Y).normalize();
        let up = right.cross(view);
        let eye = self.center - view * (0.85 * self.radius / HALF_FOV.sin());
        let width = HALF_FOV.tan();
        let along = |pixel: usize| (2.0 * (pixel as f32 + 0.5) / side as f32 - 1.0) * width;
        let ray = |x: usize, y: usize| Ray::new(eye, (view + right * along(x) - up * along(y)).normalize());
        (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).map(|(x, y)| ray(x, y)).collect()
    }

    fn bounce(&mut self, ray: &Ray) -> Option<Bounce> {
        let hit: Hit = self.tracer.intersect(ray);
        let shape = hit.is_hit().then(|| self.scene.resolve(&hit).shape)?;
        let Shape::Triangle(corners) = shape else { return None };
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize()?;
        let normal = if normal.dot(ray.dir) > 0.0 { -normal } else { normal };
        let point = ray.at(hit.t) + normal * (self.radius * 2e-5);
        let seed = u64::from(point.x.to_bits()) << 32
            ^ u64::from(point.y.to_bits())
            ^ u64::from(point.z.to_bits()) << 16;
        Some(Bounce { point, normal, seed })
    }

    fn chord(&self, i: u64) -> Ray {
        let mut random = Random(i);
        let [from, to] = [random.direction(), random.direction()].map(|d| self.center + d * self.radius);
        Ray { org: from, tnear: 0.0, dir: (to - from).normalize_or(Vec3::X), tfar: from.distance(to) }
    }
}

/// Splitmix64.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 40) as f32 / (1u32 << 24) as f32
    }

    fn direction(&mut self) -> Vec3 {
        let z = 2.0 * self.unit() - 1.0;
        let (sin, cos) = (std::f32::consts::TAU * self.unit()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * cos, r * sin, z)
    }
}
