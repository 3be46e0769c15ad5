//! Light against closed forms: furnaces, polygon lights, point lights, and one sampling strategy against another.

use crate::{
    camera::CameraPaths,
    integrator::{DirectLight, LightWeight, PathTracer},
    lights::{AreaLights, PunctualLights},
    material::Materials,
    params::{Integrator, RenderParams},
    sampling::power_heuristic,
    sky::SkyLight,
    testing::{
        BruteWorld, box_walls, cornell_box, lamp, matte, mean, probe, quad, render_quietly,
        render_tiles_with, reversed,
    },
    wave::Tile,
};
use glam::{DVec3, Vec3};
use raystrips_geom::scene::{Light, LightKind, Material, Sky};
use std::f64::consts::PI;

fn params(spp: u32, max_bounces: u32) -> RenderParams {
    RenderParams { width: 8, height: 8, spp, max_bounces, ..RenderParams::default() }
}

fn assert_near(actual: Vec3, expected: Vec3, tolerance: f32) {
    let error = (actual / expected - 1.0).abs().max_element();
    assert!(error < tolerance, "{actual} instead of {expected}");
}

#[test]
fn closed_furnace_is_emission_over_absorption() {
    let (albedo, emission) = ([0.5, 0.3, 0.7], [1.0, 2.0, 0.5]);
    for double_sided in [false, true] {
        let mut world = BruteWorld::default();
        let walls = reversed(&box_walls(Vec3::splat(-1.0), Vec3::splat(2.0)));
        world.add(&walls, Material { emission, double_sided, ..matte(albedo) });
        world.description.cameras.push(probe(Vec3::ZERO, Vec3::new(1.7, 2.0, 0.4)));
        let picture = render_quietly(&world, &params(256, 40));
        assert_near(mean(&picture), Vec3::from(emission) / (1.0 - Vec3::from(albedo)), 0.01);
    }
}

#[test]
fn white_object_vanishes_in_a_white_sky() {
    for scale in [1e-3, 1.0, 1e6] {
        let mut world = BruteWorld::default();
        let center = Vec3::splat(3.0 * scale);
        world.add(&box_walls(center - scale, center + scale), matte([1.0; 3]));
        world.description.sky = Some(Sky::Constant([1.0; 3]));
        let picture = render_quietly(&world, &params(16, 8));
        assert_eq!(picture.film.dropped(), 0);
        for pixel in 0..64 {
            assert_near(picture.film.rgb(pixel).into(), Vec3::ONE, 1e-6);
        }
    }
}

/// Irradiance over radiance of a point by a polygon wholly above its horizon: Lambert's formula (1760), the sum
/// over the edges of the angle they subtend times the cosine of the plane of that angle.
fn lambert(p: DVec3, n: DVec3, polygon: &[DVec3]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let edges = polygon.iter().zip(next).map(|(a, b)| {
        let (a, b) = ((a - p).normalize(), (b - p).normalize());
        a.dot(b).acos() * a.cross(b).normalize().dot(n)
    });
    (0.5 * edges.sum::<f64>()).abs()
}

#[test]
fn direct_light_of_a_rectangle_is_lamberts() {
    for (scale, front, double_sided) in [(1.0, true, false), (1e-3, false, true), (1e6, true, true)] {
        let mut world = BruteWorld::default();
        let floor = quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        world.add(&floor.map(|t| t.map(|p| p * scale)), matte([0.8, 0.5, 0.2]));
        let (corner, a, b) = (Vec3::new(0.2, 1.0, -0.3), Vec3::X * 0.9, Vec3::Z * 0.6);
        let light = quad(corner, a, b).map(|t| t.map(|p| p * scale));
        let light = if front { light.to_vec() } else { reversed(&light) };
        world.add(&light, Material { double_sided, ..lamp([3.0, 2.0, 1.0]) });
        world.description.cameras.push(probe(Vec3::new(0.0, 0.1, 0.0) * scale, Vec3::ZERO));

        let polygon = [corner, corner + a, corner + a + b, corner + b].map(|p| p.as_dvec3());
        let form = (lambert(DVec3::ZERO, DVec3::Y, &polygon) / PI) as f32;
        let picture = render_quietly(&world, &params(64, 1));
        assert_near(mean(&picture), form * Vec3::new(0.8 * 3.0, 0.5 * 2.0, 0.2), 0.005);
    }
}

#[test]
fn single_sided_lamps_have_a_dark_back() {
    let mut world = BruteWorld::default();
    world.add(&quad(Vec3::ZERO, Vec3::Z, Vec3::X), matte([0.8; 3]));
    world.add(&reversed(&quad(Vec3::Y, Vec3::X, Vec3::Z)), lamp([1.0; 3]));
    world.description.cameras.push(probe(Vec3::new(0.5, 0.1, 0.5), Vec3::new(0.5, 0.0, 0.5)));
    assert_eq!(mean(&render_quietly(&world, &params(16, 1))), Vec3::ZERO);
}

#[test]
fn punctual_light_falls_off_with_cosine_and_distance() {
    let kinds: [(LightKind, f64); 3] = [
        (LightKind::Point { position: [1.0, 2.0, 0.0] }, 2.0 / 5f64.sqrt() / 5.0),
        (
            LightKind::Spot {
                position: [1.0, 2.0, 0.0],
                direction: [-1.0, -2.0, 0.0],
                inner_angle: 0.1,
                outer_angle: 0.2,
            },
            2.0 / 5f64.sqrt() / 5.0,
        ),
        (LightKind::Directional { direction: [0.6, -0.8, 0.0] }, 0.8),
    ];
    for (kind, geometry) in kinds {
        let mut world = BruteWorld::default();
        world.add(&quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0), matte([0.5; 3]));
        world.description.lights.push(Light { name: String::new(), intensity: [10.0, 20.0, 30.0], kind });
        world.description.cameras.push(probe(Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO));
        let expected = Vec3::new(10.0, 20.0, 30.0) * (0.5 * geometry / PI) as f32;
        assert_near(mean(&render_quietly(&world, &params(4, 8))), expected, 1e-3);

        let roof = quad(Vec3::new(-2.0, 1.5, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
        world.add(&roof, matte([0.0; 3]));
        assert_eq!(mean(&render_quietly(&world, &params(4, 8))), Vec3::ZERO);
    }
}

#[test]
fn strategies_agree() {
    let mut world = cornell_box();
    // A large lamp next to the usual small one, so that sampling by direction alone converges.
    world.add(&quad(Vec3::new(0.0, 0.3, 0.01), Vec3::X, Vec3::Y * 0.6), lamp([1.0, 2.0, 4.0]));
    let materials = Materials::new(&world.description);
    let params = RenderParams { width: 16, height: 16, spp: 256, max_bounces: 3, ..RenderParams::default() };
    let render_with = |weight: LightWeight| {
        let direct = DirectLight {
            area_lights: AreaLights::new(crate::World::emitters(&world), &materials),
            punctual_lights: PunctualLights::new(&[]),
            weight,
            sky: SkyLight::Smooth(Sky::Constant([0.0; 3])),
            sky_weight: weight,
        };
        let camera = CameraPaths::new(&params, &world).unwrap();
        let shader = PathTracer::new(camera, direct, params.max_bounces);
        let tiles = Tile::cover(params.width, params.height);
        mean(&render_tiles_with(&world, &params, (&materials, &shader), &tiles))
    };
    let both = render_with(power_heuristic);
    assert_near(render_with(|_, _| 1.0), both, 0.01);
    assert_near(render_with(|_, _| 0.0), both, 0.01);
}

#[test]
fn partly_opaque_surfaces_let_light_pass() {
    let mut world = BruteWorld::default();
    let sheet = |y| quad(Vec3::new(-50.0, y, -50.0), Vec3::Z * 100.0, Vec3::X * 100.0);
    world.add(&sheet(0.0), matte([0.5; 3]));
    world.add(&sheet(1.0), Material { alpha: 0.25, ..matte([0.0; 3]) });
    world.add(&reversed(&sheet(2.0)), lamp([1.0; 3]));
    world.description.cameras.push(probe(Vec3::new(0.0, 0.5, 0.0), Vec3::ZERO));
    assert_near(mean(&render_quietly(&world, &params(256, 1))), Vec3::splat(0.5 * 0.75), 0.01);
}

/// In smooth glass no light is lost, and a path that is long enough comes out.
#[test]
fn clear_glass_vanishes_in_a_white_sky() {
    for thin in [false, true] {
        let mut world = BruteWorld::default();
        let glass = Material { transmission: 1.0, specular: 1.0, roughness: 0.0, thin, ..matte([1.0; 3]) };
        world.add(&box_walls(Vec3::splat(2.0), Vec3::splat(4.0)), glass);
        world.description.sky = Some(Sky::Constant([1.0; 3]));
        let picture = render_quietly(&world, &params(16, 200));
        assert_near(mean(&picture), Vec3::ONE, 1e-3);
    }
}

/// Three units of what absorbs and does not refract, seen from two units above.
fn absorbing_slab() -> BruteWorld {
    let mut world = BruteWorld::default();
    let absorbing = Material {
        transmission: 1.0,
        roughness: 0.0,
        ior: 1.0,
        absorption: [0.0, 0.5, 2.0],
        ..matte([1.0; 3])
    };
    world.add(&box_walls(Vec3::new(-9.0, -9.0, 0.0), Vec3::new(9.0, 9.0, 3.0)), absorbing);
    world.description.cameras.push(probe(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO));
    world
}

#[test]
fn light_is_absorbed_along_its_way_through_a_solid() {
    let mut world = absorbing_slab();
    world.description.sky = Some(Sky::Constant([1.0; 3]));
    let expected = Vec3::new(1.0, libm::expf(-1.5), libm::expf(-6.0));
    assert_near(mean(&render_quietly(&world, &params(4, 8))), expected, 1e-3);
}

#[test]
fn light_is_absorbed_before_what_is_inside_of_a_solid() {
    let mut world = absorbing_slab();
    // Two units below: it shines, and does not reflect.
    let plate = Material { emission: [1.0; 3], double_sided: true, ..matte([0.0; 3]) };
    world.add(&quad(Vec3::new(-1.0, -1.0, 1.0), Vec3::X * 2.0, Vec3::Y * 2.0), plate);
    world.description.sky = Some(Sky::Constant([0.0; 3]));
    let expected = Vec3::new(1.0, libm::expf(-1.0), libm::expf(-4.0));
    for integrator in [Integrator::Path, Integrator::Photon] {
        let params = RenderParams { integrator, ..params(4, 8) };
        assert_near(mean(&render_quietly(&world, &params)), expected, 1e-3);
    }
}
