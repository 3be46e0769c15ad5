//! Photon mapping against path tracing, for every kind of path from a light L by smooth (S), glossy (G) and diffuse (D)
//! surfaces to the eye E: each of these scenes is dark but for one of them.

use crate::{
    Environment,
    params::{Integrator, RenderParams},
    photon::PhotonParams,
    testing::{BruteWorld, box_walls, lamp, matte, mean, probe, quad, render_quietly, reversed},
};
use glam::Vec3;
use raystrips_geom::scene::{Camera, Material, Projection, Sky};
use std::sync::Arc;

fn params(integrator: Integrator, spp: u32) -> RenderParams {
    let photons = PhotonParams { count: 150_000, nearest: 60, passes: 2, gather_rays: 1 };
    let (width, height, max_bounces) = (16, 16, 12);
    RenderParams { integrator, photons, width, height, spp, max_bounces, ..RenderParams::default() }
}

/// Both integrators find the same mean.
fn check(name: &str, world: &BruteWorld, params: impl Fn(Integrator) -> RenderParams, tolerance: f32) {
    let [path, photon] =
        [Integrator::Path, Integrator::Photon].map(|i| mean(&render_quietly(world, &params(i))));
    assert!(path.min_element() > 0.0, "{name}: nothing is seen");
    let apart = (photon / path - 1.0).abs().max_element();
    assert!(apart < tolerance, "{name}: path {path}, photon {photon}");
}

fn metal(roughness: f32) -> Material {
    Material { metallic: 1.0, roughness, ..matte([0.9, 0.7, 0.5]) }
}

/// Smooth or rough glass, as a sheet.
fn pane(roughness: f32) -> Material {
    Material { transmission: 1.0, specular: 1.0, roughness, thin: true, ..matte([0.9; 3]) }
}

/// A level square about the y-axis that faces up.
fn square(y: f32, half: f32) -> [[Vec3; 3]; 2] {
    quad(Vec3::new(-half, y, -half), Vec3::Z * (2.0 * half), Vec3::X * (2.0 * half))
}

/// A camera that sees a square of what is ahead.
fn look(world: &mut BruteWorld, from: Vec3, to: Vec3) {
    let projection = Projection::Orthographic { height: 1.6 };
    world.description.cameras.push(Camera { projection, ..probe(from, to) });
}

/// A floor that `square(y)` is above, lit by way of it alone: a lamp between them shines upwards, or one above all downwards.
fn under(y: f32, above: Material, lamp_y: f32) -> BruteWorld {
    let mut world = BruteWorld::default();
    world.add(&square(0.0, 3.0), matte([0.5; 3]));
    world.add(&reversed(&square(y, 3.0)), above);
    let shape = square(lamp_y, 0.4);
    let shape = if lamp_y < y { shape.to_vec() } else { reversed(&shape) };
    world.add(&shape, lamp([3.0, 2.0, 1.0]));
    look(&mut world, Vec3::new(0.9, 0.5, 0.0), Vec3::new(0.9, 0.0, 0.0));
    world
}

#[test]
fn light_by_way_of_a_reflector() {
    for (name, reflector) in [("LSDE", metal(0.0)), ("LGDE", metal(0.35)), ("LDDE", metal(0.6))] {
        check(name, &under(2.0, reflector, 1.0), |i| params(i, 256), 0.02);
    }
}

#[test]
fn light_through_sheets() {
    for (name, roughness) in [("LSDE", 0.0), ("LGDE", 0.35)] {
        check(name, &under(1.0, pane(roughness), 2.0), |i| params(i, 256), 0.02);
    }
    let mut two = under(1.0, pane(0.0), 2.0);
    two.add(&square(1.3, 3.0), pane(0.35));
    check("LGSDE", &two, |i| params(i, 1024), 0.02);
    // From a ceiling, which is lit by a lamp that shines upwards.
    for (name, roughness) in [("LDSDE", 0.0), ("LDGDE", 0.35)] {
        let mut world = under(2.0, matte([0.8; 3]), 1.5);
        world.add(&square(1.0, 3.0), pane(roughness));
        check(name, &world, |i| params(i, 128), 0.02);
    }
}

#[test]
fn lamps_and_what_they_light_in_mirrors() {
    for (name, reflector) in [("S", metal(0.0)), ("G", metal(0.35))] {
        let mut world = under(2.0, reflector, 1.0);
        world.description.cameras.clear();
        look(&mut world, Vec3::new(0.8, 1.1, 0.0), Vec3::new(0.4, 2.0, 0.0));
        check(&format!("L{name}E"), &world, |i| params(i, 256), 0.02);
        world.add(&reversed(&square(0.9, 0.4)), lamp([2.0; 3]));
        world.description.cameras.clear();
        look(&mut world, Vec3::new(1.0, 0.5, 0.0), Vec3::new(1.5, 2.0, 0.0));
        check(&format!("LD{name}E"), &world, |i| params(i, 256), 0.02);
    }
    let mut world = under(2.0, matte([0.5; 3]), 1.0);
    world.description.cameras.clear();
    look(&mut world, Vec3::new(0.0, 1.9, 0.0), Vec3::ZERO);
    check("LE", &world, |i| params(i, 64), 0.02);
}

#[test]
fn light_past_partly_opaque_sheets() {
    let sheet = |base_color| Material { alpha: 0.5, ..matte(base_color) };
    for (name, color) in [("black", [0.0; 3]), ("gray", [0.5; 3])] {
        check(name, &under(1.0, sheet(color), 2.0), |i| params(i, 256), 0.01);
    }
}

/// Photons know nothing of such lamps.
#[test]
fn light_of_lamps_with_a_texture() {
    let mut textured = lamp([3.0, 2.0, 1.0]);
    textured.textures.emission = Some(0);
    for (name, reflector) in [("LDDE", matte([0.8; 3])), ("LSDE", metal(0.0)), ("LGDE", metal(0.35))] {
        let mut world = under(2.0, reflector, 1.0);
        world.add(&square(1.1, 0.8), textured.clone());
        check(name, &world, |i| params(i, 256), 0.02);
    }
}

#[test]
fn light_of_the_sky() {
    let environment = Arc::new(Environment::new(16, 8, vec![[1.0, 2.0, 3.0]; 128]));
    for (name, above) in
        [("S", metal(0.0)), ("G", metal(0.35)), ("D", matte([0.8; 3])), ("sheet", pane(0.35))]
    {
        let mut world = under(1.0, above, 0.5);
        let by_environment =
            |i| RenderParams { environment: Some(Arc::clone(&environment)), ..params(i, 128) };
        check(&format!("environment, {name}"), &world, by_environment, 0.02);
        world.description.sky = Some(Sky::Constant([1.0, 2.0, 3.0]));
        check(&format!("sky, {name}"), &world, |i| params(i, 128), 0.02);
    }
}

/// A path is as long by photons as without them.
#[test]
fn bounces_are_counted_alike() {
    for bounces in [0, 1, 2, 3] {
        let mut world = BruteWorld::default();
        world.add(&reversed(&box_walls(Vec3::splat(-1.0), Vec3::ONE)), matte([0.8; 3]));
        world.add(&reversed(&square(0.9, 0.5)), lamp([1.0; 3]));
        look(&mut world, Vec3::ZERO, Vec3::new(0.1, if bounces == 0 { 0.9 } else { -1.0 }, 0.2));
        let name = format!("{bounces} bounces");
        check(&name, &world, |i| RenderParams { max_bounces: bounces, ..params(i, 256) }, 0.02);
    }
}
