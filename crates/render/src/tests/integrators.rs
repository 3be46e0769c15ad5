//! The simple integrators, first-hit values, defaults and refusals.

use crate::{
    params::{Integrator, MAX_EXTENT, RenderError, RenderParams},
    render::render,
    testing::{BruteWorld, box_walls, cornell_box, matte, mean, probe, quad, render_quietly},
};
use glam::Vec3;

fn small(integrator: Integrator) -> RenderParams {
    RenderParams { integrator, width: 8, height: 8, spp: 16, ..RenderParams::default() }
}

#[test]
fn normals_face_the_viewer() {
    for (from, expected) in [(Vec3::Y, Vec3::new(0.5, 1.0, 0.5)), (Vec3::NEG_Y, Vec3::new(0.5, 0.0, 0.5))] {
        let mut world = BruteWorld::default();
        world.add(&quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0), matte([0.2, 0.4, 0.6]));
        world.description.cameras.push(probe(from, Vec3::ZERO));
        let film = render_quietly(&world, &small(Integrator::Normal)).film;
        for pixel in 0..64 {
            assert_eq!(Vec3::from(film.rgb(pixel)), expected);
            assert_eq!(Vec3::from(film.normal(pixel).unwrap()), expected * 2.0 - 1.0);
            assert!(Vec3::from(film.albedo(pixel).unwrap()).abs_diff_eq(Vec3::new(0.2, 0.4, 0.6), 1e-6));
            assert!((film.depth(pixel) - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn ambient_occlusion_of_a_wall_is_half() {
    // A wall of great height beside a point hides half of its cosine-weighted hemisphere.
    let mut world = BruteWorld::default();
    world.add(&quad(Vec3::new(-1e3, 0.0, -1e3), Vec3::Z * 2e3, Vec3::X * 2e3), matte([0.5; 3]));
    world.add(&quad(Vec3::new(-1e3, 0.0, -1e-3), Vec3::X * 2e3, Vec3::Y * 1e3), matte([0.5; 3]));
    world.description.cameras.push(probe(Vec3::new(0.0, 1.0, 1.0), Vec3::ZERO));
    let picture = render_quietly(&world, &RenderParams { spp: 256, ..small(Integrator::Ao) });
    assert!((mean(&picture) - 0.5).abs().max_element() < 0.005, "{}", mean(&picture));
    assert_eq!(picture.stats.shadow, picture.stats.primary);
}

#[test]
fn default_camera_and_sky_show_something() {
    let mut world = BruteWorld::default();
    world.add(&box_walls(Vec3::splat(10.0), Vec3::splat(30.0)), matte([0.5; 3]));
    let film =
        render_quietly(&world, &RenderParams { width: 32, height: 24, ..small(Integrator::Path) }).film;
    let [middle, corner] = [12 * 32 + 16, 0];
    assert!(film.depth(middle).is_finite() && film.depth(corner).is_infinite());
    assert!(film.rgb(middle)[1] > 0.1 && film.rgb(corner)[1] > film.rgb(middle)[1]);

    let dark = RenderParams { default_light: false, ..small(Integrator::Path) };
    assert_eq!(mean(&render_quietly(&world, &dark)), Vec3::ZERO);
    let empty = render_quietly(&BruteWorld::default(), &small(Integrator::Normal));
    assert_eq!(mean(&empty), Vec3::ZERO);
}

#[test]
fn useless_parameters_are_refused() {
    let world = cornell_box();
    let refuse = |params: RenderParams| render(&world, &params, &|_| {}).unwrap_err();
    let params = RenderParams::default;
    assert!(matches!(refuse(RenderParams { width: 0, ..params() }), RenderError::Size { .. }));
    assert!(matches!(refuse(RenderParams { height: MAX_EXTENT + 1, ..params() }), RenderError::Size { .. }));
    assert!(matches!(refuse(RenderParams { spp: 0, ..params() }), RenderError::Spp { spp: 0 }));
    let mut camera = world.description.cameras[0].clone();
    camera.forward = [0.0; 3];
    let message = refuse(RenderParams { camera: Some(camera), ..params() }).to_string();
    assert_eq!(message, "camera \"front\" has no forward direction");
}
