//! The direct light of the Cornell box against a computation that shares nothing with the program: its own
//! reading of the files, rays against all triangles in f64, and an even grid over the light instead of chance.

use crate::pictures::Exr;
use crate::support::{Folder, repository_file};
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;

/// Pixels of a side of the picture.
const SIZE: usize = 96;
/// Points a side within a pixel.
const PIXEL_GRID: usize = 2;
/// Steps along each side of a pixel in which another face is looked for.
const BORDER_STEPS: usize = 6;
/// Points a side on the light.
const LIGHT_GRID: usize = 12;
/// Surfaces lie so far away from themselves, in millimeters.
const SKIN: f64 = 1e-3;

#[derive(Clone, Copy, Default)]
struct Material {
    reflectance: DVec3,
    emission: DVec3,
}

struct Triangle {
    corners: [DVec3; 3],
    material: Material,
    /// Number of the face that it is part of.
    face: usize,
}

impl Triangle {
    /// Unit normal on the side from which the corners run counterclockwise.
    fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize()
    }

    /// Distance along a ray to the triangle (Möller and Trumbore 1997).
    fn distance(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let det = ab.dot(p);
        if det.abs() < 1e-12 {
            return None;
        }
        let s = origin - a;
        let u = s.dot(p) / det;
        let q = s.cross(ab);
        let v = direction.dot(q) / det;
        let t = ac.dot(q) / det;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
    }
}

/// The faces of an OBJ file, each cut into a fan from its first corner.
fn read_obj(text: &str, materials: &HashMap<String, Material>) -> Vec<Triangle> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let (mut material, mut faces) = (Material::default(), 0);
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => vertices.push(vector(words)),
            Some("usemtl") => material = materials[words.next().unwrap()],
            Some("f") => {
                let corners: Vec<DVec3> = words.map(|word| vertex(&vertices, word)).collect();
                for pair in corners[1..].windows(2) {
                    triangles.push(Triangle {
                        corners: [corners[0], pair[0], pair[1]],
                        material,
                        face: faces,
                    });
                }
                faces += 1;
            }
            _ => {}
        }
    }
    triangles
}

/// A vertex by its number from 1, or backwards from -1.
fn vertex(vertices: &[DVec3], word: &str) -> DVec3 {
    let number: isize = word.parse().unwrap();
    if number > 0 { vertices[number as usize - 1] } else { vertices[vertices.len() - number.unsigned_abs()] }
}

fn read_mtl(text: &str) -> HashMap<String, Material> {
    let mut materials = HashMap::new();
    let mut name = String::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("newmtl") => {
                name = words.next().unwrap().to_owned();
                materials.insert(name.clone(), Material::default());
            }
            Some("Kd") => materials.get_mut(&name).unwrap().reflectance = vector(words),
            Some("Ke") => materials.get_mut(&name).unwrap().emission = vector(words),
            _ => {}
        }
    }
    materials
}

fn vector<'a>(words: impl Iterator<Item = &'a str>) -> DVec3 {
    let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
    DVec3::from_slice(&numbers)
}

/// The camera of the scene, for square pictures.
struct Camera {
    position: DVec3,
    forward: DVec3,
    /// From the middle of the picture to its right border.
    right: DVec3,
    /// From the middle of the picture to its upper border.
    up: DVec3,
}

impl Camera {
    /// Reads the lines `position`, `target` and `vertical_fov_degrees` of a scene file.
    fn read(text: &str) -> Camera {
        let value = |key: &str| {
            let line = text.lines().find(|line| line.starts_with(key)).unwrap();
            let value = line.split(['=', '#']).nth(1).unwrap();
            value.replace(['[', ']', ','], " ")
        };
        let point = |key| vector(value(key).split_whitespace());
        let position = point("position");
        let forward = (point("target") - position).normalize();
        let half_height =
            (0.5 * value("vertical_fov_degrees").trim().parse::<f64>().unwrap().to_radians()).tan();
        let right = forward.cross(DVec3::Y).normalize();
        Camera { position, forward, right: right * half_height, up: right.cross(forward) * half_height }
    }

    /// Direction through a place of the picture, from -1 to 1 rightwards and upwards.
    fn direction(&self, place: DVec2) -> DVec3 {
        (self.forward + self.right * place.x + self.up * place.y).normalize()
    }
}

/// Light of a place.
#[derive(Default)]
struct Light {
    radiance: DVec3,
    /// Ways to points of lamps that nothing blocks.
    free: usize,
    /// Ways to points of lamps where both ends face the other.
    facing: usize,
}

impl Light {
    fn count(&mut self, other: &Light) {
        self.free += other.free;
        self.facing += other.facing;
    }
}

struct Room {
    triangles: Vec<Triangle>,
    camera: Camera,
}

impl Room {
    fn read() -> Room {
        let read =
            |name: &str| std::fs::read_to_string(repository_file("scenes/cornell").join(name)).unwrap();
        let triangles = read_obj(&read("cornell.obj"), &read_mtl(&read("cornell.mtl")));
        Room { triangles, camera: Camera::read(&read("scene.toml")) }
    }

    fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<(f64, &Triangle)> {
        let distances = self
            .triangles
            .iter()
            .filter_map(|triangle| Some((triangle.distance(origin, direction)?, triangle)));
        distances.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn is_free(&self, from: DVec3, to: DVec3) -> bool {
        let way = to - from;
        let distance = way.length();
        let direction = way / distance;
        let blocks = |triangle: &Triangle| {
            triangle.distance(from, direction).is_some_and(|t| t > SKIN && t < distance - SKIN)
        };
        !self.triangles.iter().any(blocks)
    }

    /// Light that a point of `triangle` sends along `-direction`: what it emits, and what it reflects of the
    /// light that reaches it straight from lamps. Integral over the area of the lamps of
    /// emission * cos * cos / distance².
    fn light(&self, point: DVec3, triangle: &Triangle, direction: DVec3) -> Light {
        let is_front = triangle.normal().dot(direction) < 0.0;
        let normal = if is_front { triangle.normal() } else { -triangle.normal() };
        let from = point + normal * SKIN;
        let mut irradiance = DVec3::ZERO;
        let (mut free, mut facing) = (0, 0);
        for lamp in self.triangles.iter().filter(|lamp| lamp.material.emission != DVec3::ZERO) {
            let [a, b, c] = lamp.corners;
            let area = 0.5 * (b - a).cross(c - a).length();
            for (s, t) in grid(LIGHT_GRID) {
                // A square folded onto the triangle along its diagonal covers it twice, evenly.
                let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
                let on_lamp = a + (b - a) * s + (c - a) * t;
                let way = on_lamp - from;
                let to_lamp = way.normalize();
                let cosines = normal.dot(to_lamp).max(0.0) * lamp.normal().dot(-to_lamp).max(0.0);
                if cosines > 0.0 {
                    facing += 1;
                }
                if cosines > 0.0 && self.is_free(from, on_lamp) {
                    free += 1;
                    let share = area / (LIGHT_GRID * LIGHT_GRID) as f64;
                    irradiance += lamp.material.emission * (cosines / way.length_squared() * share);
                }
            }
        }
        let emitted = if is_front { triangle.material.emission } else { DVec3::ZERO };
        let radiance = emitted + triangle.material.reflectance / PI * irradiance;
        Light { radiance, free, facing }
    }

    /// Mean light of a pixel and the face that it shows; `None` if it shows several faces or none.
    fn pixel(&self, column: usize, row: usize) -> Option<(usize, Light)> {
        let corner = DVec2::new(column as f64, row as f64);
        let seen = |(x, y): (f64, f64)| {
            let place = (corner + DVec2::new(x, y)) / SIZE as f64;
            let direction = self.camera.direction(DVec2::new(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y));
            let (distance, triangle) = self.nearest(self.camera.position, direction)?;
            Some((self.camera.position + direction * distance, triangle, direction))
        };
        let (_, Triangle { face, .. }, _) = seen((0.0, 0.0))?;
        // Others may reach in between the places looked at below: look along the border, too.
        let border = (0..=BORDER_STEPS).map(|i| i as f64 / BORDER_STEPS as f64);
        let mut border = border.flat_map(|x| [(x, 0.0), (x, 1.0), (0.0, x), (1.0, x)]);
        if !border.all(|place| seen(place).is_some_and(|(_, triangle, _)| triangle.face == *face)) {
            return None;
        }
        let mut sum = Light::default();
        for place in grid(PIXEL_GRID) {
            let (point, triangle, direction) = seen(place)?;
            let light = self.light(point, triangle, direction);
            sum.radiance += light.radiance / (PIXEL_GRID * PIXEL_GRID) as f64;
            sum.count(&light);
        }
        // A shadow may end between these places.
        for corner in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)] {
            let (point, triangle, direction) = seen(corner)?;
            sum.count(&self.light(point, triangle, direction));
        }
        Some((*face, sum))
    }
}

/// Middles of the squares of a grid over the unit square.
fn grid(side: usize) -> impl Iterator<Item = (f64, f64)> {
    let middle = move |i: usize| (i as f64 + 0.5) / side as f64;
    (0..side * side).map(move |i| (middle(i % side), middle(i / side)))
}

/// Radiance that pixels should have and do have, summed over some of them.
#[derive(Clone, Copy, Default)]
struct Sums {
    pixels: usize,
    expected: DVec3,
    rendered: DVec3,
}

impl Sums {
    fn add(&mut self, expected: DVec3, rendered: DVec3) {
        self.pixels += 1;
        self.expected += expected;
        self.rendered += rendered;
    }

    /// Largest error of a channel, relative.
    fn error(&self) -> f64 {
        ((self.rendered - self.expected) / self.expected).abs().max_element()
    }
}

#[test]
fn the_cornell_box_is_lit_as_computed_by_hand() {
    let folder = Folder::new();
    let scene = repository_file("scenes/cornell/scene.toml");
    let arguments =
        format!("-o a.exr --bounces 1 --integrator path --spp 128 --size {SIZE}x{SIZE} --cache cache");
    let arguments = ["render", scene.to_str().unwrap()].into_iter().chain(arguments.split(' '));
    folder.run_args(&arguments.collect::<Vec<_>>()).done();
    let picture = Exr::read(&folder.path("a.exr"));

    let room = Room::read();
    let (mut all, mut faces) = (Sums::default(), BTreeMap::<usize, Sums>::new());
    for (column, row) in (0..SIZE * SIZE).map(|i| (i % SIZE, i / SIZE)) {
        let Some((face, light)) = room.pixel(column, row) else { continue };
        let (expected, rendered) = (light.radiance, DVec3::from_array(picture.rgb(column, row)));
        // A penumbra is noisy; it counts in the sums only.
        if light.free == light.facing || light.free == 0 {
            let is_right = (rendered - expected).abs().cmple(0.1 * expected + 2e-3).all();
            assert!(is_right, "pixel {column}, {row}, face {face}: {rendered}, expected {expected}");
        }
        all.add(expected, rendered);
        faces.entry(face).or_default().add(expected, rendered);
    }
    for (face, sums) in &faces {
        let mean = sums.expected.max_element() / sums.pixels as f64;
        eprintln!("face {face}: {} pixels, mean {mean:.4}, error {:.4} %", sums.pixels, 100.0 * sums.error());
    }
    // Dark faces say nothing of relative errors.
    let lit =
        faces.iter().filter(|(_, s)| s.pixels >= 8 && s.expected.max_element() > 0.02 * s.pixels as f64);
    let lit: BTreeMap<_, _> = lit.collect();
    for (name, face) in
        [("floor", 0), ("light", 5), ("back", 6), ("right", 7), ("left", 8), ("short block's top", 9)]
    {
        assert!(lit.contains_key(&face), "the {name} is lit and seen");
    }
    assert!(lit.values().all(|sums| sums.error() < 0.01));
    assert!(all.pixels > SIZE * SIZE / 2);
    assert!(all.error() < 0.003, "{}", all.error());
}
