//! Photon mapping against path tracing.

use crate::{
    params::{Integrator, RenderParams},
    photon::PhotonParams,
    render::{Watch, render_tiles},
    testing::{BruteWorld, box_walls, cornell_box, lamp, matte, mean, probe, quad, render_quietly, reversed},
    unfinished::Unfinished,
};
use glam::Vec3;
use raystrips_geom::scene::{Camera, Light, LightKind, Material, Projection, Sky};

fn params(integrator: Integrator, spp: u32) -> RenderParams {
    let photons = PhotonParams { count: 100_000, nearest: 40, passes: 2, gather_rays: 1 };
    RenderParams {
        integrator,
        photons,
        width: 16,
        height: 16,
        spp,
        max_bounces: 12,
        ..RenderParams::default()
    }
}

/// Means of both integrators, and how far apart they are.
fn check(world: &BruteWorld, spp: u32, tolerance: f32) {
    let [path, photon] =
        [Integrator::Path, Integrator::Photon].map(|i| mean(&render_quietly(world, &params(i, spp))));
    let apart = ((photon - path) / path.max(Vec3::splat(1e-6))).abs().max_element();
    assert!(apart < tolerance, "path {path}, photon {photon}");
}

#[test]
fn both_find_the_same_light_in_a_diffuse_box() {
    check(&cornell_box(), 256, 0.01);
}

#[test]
fn several_rays_gather_the_light_that_one_gathers() {
    let mut world = cornell_box();
    let coated = Material { specular: 1.0, roughness: 0.0, ..matte([0.5; 3]) };
    world.add(&box_walls(Vec3::new(0.2, 0.01, 0.2), Vec3::new(0.5, 0.4, 0.5)), coated);
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..matte([0.9; 3]) };
    world.add(&box_walls(Vec3::new(0.6, 0.01, 0.3), Vec3::new(0.8, 0.6, 0.6)), mirror);
    let render = |gather_rays, spp| {
        let params = params(Integrator::Photon, spp);
        let photons = PhotonParams { gather_rays, ..params.photons };
        render_quietly(&world, &RenderParams { photons, ..params })
    };
    let path = mean(&render_quietly(&world, &params(Integrator::Path, 512)));
    let (one, several) = (render(1, 64), render(8, 64));
    let apart = (mean(&several) / path - 1.0).abs().max_element();
    assert!(apart < 0.012, "path {path}, photons {} and {}", mean(&one), mean(&several));
    // What is seen sends out eight times as many, and those send out no more.
    let (one, several) = (one.stats, several.stats);
    assert_eq!(one.primary, several.primary);
    let seen = 16 * 16 * 64;
    assert!((7 * seen / 2..8 * seen).contains(&(several.secondary - one.secondary)), "{one:?} {several:?}");
    assert!(several.shadow.abs_diff(one.shadow) < seen / 10, "{one:?} {several:?}");
}

/// A floor under a slab of glass: all light comes through it.
fn under_glass(glass: Material) -> BruteWorld {
    let mut world = BruteWorld::default();
    world.add(&quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0), matte([0.5; 3]));
    world.add(&box_walls(Vec3::new(-3.0, 1.0, -3.0), Vec3::new(3.0, 1.5, 3.0)), glass);
    let projection = Projection::Orthographic { height: 2.0 };
    world.description.cameras.push(Camera { projection, ..probe(Vec3::new(0.0, 0.5, 0.0), Vec3::ZERO) });
    world
}

#[test]
fn both_find_the_same_caustics() {
    let glass = Material { transmission: 1.0, specular: 1.0, roughness: 0.0, ..matte([1.0; 3]) };
    let mut by_lamp = under_glass(glass.clone());
    by_lamp.add(
        &reversed(&quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0)),
        lamp([3.0, 2.0, 1.0]),
    );
    check(&by_lamp, 1024, 0.03);
    let mut by_sky = under_glass(glass);
    by_sky.description.sky = Some(Sky::Constant([1.0; 3]));
    check(&by_sky, 256, 0.03);
}

#[test]
fn lights_without_a_surface_send_photons() {
    let mut world = cornell_box();
    let kind = LightKind::Point { position: [0.5, 0.6, 0.5] };
    world.description.lights.push(Light { name: String::new(), intensity: [0.5; 3], kind });
    check(&world, 256, 0.015);
}

#[test]
fn threads_and_pauses_change_nothing() {
    let world = cornell_box();
    let of = |threads, has_pauses: bool| {
        let params = RenderParams { threads, ..params(Integrator::Photon, 4) };
        // Every other look asks for a pause.
        let looks = std::sync::atomic::AtomicU32::new(0);
        let is_due = || has_pauses && looks.fetch_add(1, std::sync::atomic::Ordering::Relaxed) % 40 == 39;
        let mut unfinished = Unfinished::new(&params);
        while !unfinished.is_finished() {
            let watch = Watch { is_due: &is_due, progress: &|_| () };
            unfinished = render_tiles(&world, &params, unfinished, &watch).unwrap();
        }
        unfinished.into_output().film
    };
    let film = of(1, false);
    assert!(film == of(2, false) && film == of(2, true));
}
