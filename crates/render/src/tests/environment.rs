//! Environments against closed forms, other ways to find the same light, and files of all kinds.

use crate::{
    Environment, EnvironmentFile, World,
    camera::CameraPaths,
    integrator::{DirectLight, LightWeight, PathTracer},
    lights::{AreaLights, PunctualLights},
    material::Materials,
    params::{Integrator, RenderParams},
    photon::PhotonParams,
    sampling::power_heuristic,
    sky::SkyLight,
    testing::{
        BruteWorld, box_walls, cornell_box, matte, mean, probe, quad, render_quietly, render_tiles_with,
    },
    wave::Tile,
};
use glam::Vec3;
use image::codecs::hdr::HdrEncoder;
use raystrips_geom::scene::{Camera, Material, Projection, Sky};
use std::{
    f64::consts::PI,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

fn params(environment: &Arc<Environment>, spp: u32, max_bounces: u32) -> RenderParams {
    let environment = Some(Arc::clone(environment));
    RenderParams { environment, width: 8, height: 8, spp, max_bounces, ..RenderParams::default() }
}

fn assert_near(actual: Vec3, expected: Vec3, tolerance: f32) {
    let error = (actual / expected - 1.0).abs().max_element();
    assert!(error < tolerance, "{actual} instead of {expected}");
}

fn even(radiance: f32) -> Arc<Environment> {
    Arc::new(Environment::new(16, 8, vec![[radiance; 3]; 128]))
}

/// A dark sky with a sun of one texel, 60 degrees above the horizon to the left of -z, and the irradiance of a floor by it.
fn sun() -> (Arc<Environment>, Vec3) {
    let (width, height) = (720, 360);
    let (x, y) = (300, 60);
    let mut texels = vec![[0.0; 3]; width * height];
    texels[y * width + x] = [4e4, 3e4, 2e4];
    // The integral of the interpolation times cosine and sine of the angle from above, over its two texels in both directions.
    let step = PI / height as f64;
    let steps = 2000;
    let across: f64 = (0..steps)
        .map(|i| {
            let offset = 2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0;
            let angle = (y as f64 + 0.5 + offset) * step;
            (1.0 - offset.abs()) * angle.cos() * angle.sin() * 2.0 * step / f64::from(steps)
        })
        .sum();
    (Arc::new(Environment::new(width, height, texels)), Vec3::new(4e4, 3e4, 2e4) * (across * step) as f32)
}

fn floor(material: Material) -> BruteWorld {
    let mut world = BruteWorld::default();
    world.add(&quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0), material);
    world.description.cameras.push(probe(Vec3::new(0.2, 0.5, 0.1), Vec3::ZERO));
    world
}

#[test]
fn small_sun_lights_a_floor_by_its_irradiance() {
    let (environment, irradiance) = sun();
    let expected = irradiance * Vec3::new(0.8, 0.5, 0.2) / PI as f32;
    let world = floor(matte([0.8, 0.5, 0.2]));
    assert_near(mean(&render_quietly(&world, &params(&environment, 64, 1))), expected, 0.01);
    // However it is turned, and what is behind it is dark.
    let turned = Arc::new(Environment::clone(&environment).turned(77.7).scaled(0.5));
    assert_near(mean(&render_quietly(&world, &params(&turned, 64, 1))), expected * 0.5, 0.01);
    let mut covered = floor(matte([0.8; 3]));
    covered.add(&quad(Vec3::new(-9.0, 1.0, -9.0), Vec3::Z * 18.0, Vec3::X * 18.0), matte([0.0; 3]));
    assert_eq!(mean(&render_quietly(&covered, &params(&environment, 16, 1))), Vec3::ZERO);
}

#[test]
fn even_environment_is_an_even_sky() {
    // What is seen of it is the same to the last bit.
    let plain = |spp| RenderParams { environment: None, ..params(&even(0.0), spp, 8) };
    let mut empty = BruteWorld::default();
    empty.description.sky = Some(Sky::Constant([0.7; 3]));
    let by_sky = render_quietly(&empty, &plain(4)).film;
    empty.description.sky = Some(Sky::Constant([3.0; 3]));
    assert!(render_quietly(&empty, &params(&even(0.7), 4, 8)).film == by_sky);
    // A furnace: a white body vanishes, and a gray one is as by the plain sky.
    for material in [matte([1.0; 3]), Material { specular: 1.0, roughness: 0.4, ..matte([0.5; 3]) }] {
        let mut world = BruteWorld::default();
        world.add(&box_walls(Vec3::splat(2.0), Vec3::splat(4.0)), material.clone());
        let by_environment = mean(&render_quietly(&world, &params(&even(1.0), 1024, 8)));
        world.description.sky = Some(Sky::Constant([1.0; 3]));
        let by_sky = mean(&render_quietly(&world, &plain(1024)));
        assert_near(by_environment, by_sky, 2e-3);
    }
}

/// Bright above and to one side, dark below.
fn uneven() -> Arc<Environment> {
    let texel = |i: usize| {
        let (x, y) = ((i % 64) as f32, (i / 64) as f32);
        let glow = 30.0 * libm::expf(-0.05 * ((x - 20.0) * (x - 20.0) + (y - 9.0) * (y - 9.0)));
        if y > 16.0 { [0.05; 3] } else { [0.3 + glow, 0.4 + 0.8 * glow, 0.8 + 0.4 * glow] }
    };
    Arc::new(Environment::new(64, 32, (0..64 * 32).map(texel).collect()))
}

#[test]
fn strategies_agree() {
    let environment = uneven();
    let mut world = BruteWorld::default();
    let gloss = Material { specular: 1.0, roughness: 0.5, ..matte([0.6, 0.5, 0.4]) };
    world.add(&quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0), gloss);
    world.add(&box_walls(Vec3::splat(0.0), Vec3::splat(1.0)), matte([0.7; 3]));
    // Half of what comes passes, and is not found by shadow rays.
    let sheet = quad(Vec3::new(-4.0, 2.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0);
    world.add(&sheet, Material { alpha: 0.5, ..matte([0.1; 3]) });
    let projection = Projection::Orthographic { height: 3.0 };
    let camera = Camera { projection, ..probe(Vec3::new(2.0, 1.5, 2.5), Vec3::ZERO) };
    world.description.cameras.push(camera);
    let materials = Materials::new(&world.description);
    let params = RenderParams { width: 16, height: 16, ..params(&environment, 1024, 3) };
    let render_with = |weight: LightWeight| {
        let direct = DirectLight {
            area_lights: AreaLights::new(world.emitters(), &materials),
            punctual_lights: PunctualLights::new(&[]),
            weight,
            sky: SkyLight::Environment(&environment),
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
fn photons_find_the_same_light() {
    let check = |world: &BruteWorld, tolerance: f32| {
        let photons = PhotonParams { count: 200_000, nearest: 40, passes: 2, gather_rays: 1 };
        let of = |integrator| {
            let params =
                RenderParams { integrator, photons, width: 16, height: 16, ..params(&uneven(), 256, 12) };
            mean(&render_quietly(world, &params))
        };
        assert_near(of(Integrator::Photon), of(Integrator::Path), tolerance);
    };
    let projection = Projection::Orthographic { height: 2.0 };
    let mut open = floor(matte([0.6; 3]));
    open.add(&box_walls(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 0.4, 0.2)), matte([0.7, 0.3, 0.3]));
    open.description.cameras[0].projection = projection;
    check(&open, 0.02);
    // All light comes through glass.
    let mut below = floor(matte([0.5; 3]));
    let glass = Material { transmission: 1.0, specular: 1.0, roughness: 0.0, ..matte([1.0; 3]) };
    below.add(&box_walls(Vec3::new(-3.0, 1.0, -3.0), Vec3::new(3.0, 1.5, 3.0)), glass);
    below.description.cameras[0].projection = projection;
    check(&below, 0.03);
}

/// Shadow rays pass partly opaque surfaces as paths do, so light from there is found both ways.
#[test]
fn photons_find_light_that_partly_opaque_surfaces_let_pass() {
    let mut world = floor(matte([0.6; 3]));
    let sheet = quad(Vec3::new(-2.0, 0.6, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    world.add(&sheet, Material { alpha: 0.5, ..matte([0.1; 3]) });
    world.description.sky = Some(Sky::Constant([1.0; 3]));
    let photons = PhotonParams { count: 50_000, ..PhotonParams::default() };
    let by_environment =
        RenderParams { integrator: Integrator::Photon, photons, ..params(&even(1.0), 1024, 4) };
    let by_sky = RenderParams { environment: None, ..by_environment.clone() };
    let [by_environment, by_sky] =
        [by_environment, by_sky].map(|params| mean(&render_quietly(&world, &params)));
    assert_near(by_environment, by_sky, 5e-3);
}

#[test]
fn threads_and_order_change_nothing() {
    let world = cornell_box();
    for integrator in [Integrator::Path, Integrator::Photon] {
        let photons = PhotonParams { count: 4096, ..PhotonParams::default() };
        let of = |threads| {
            let params = RenderParams {
                integrator,
                photons,
                threads,
                width: 40,
                height: 30,
                ..params(&uneven(), 4, 8)
            };
            render_quietly(&world, &params).film
        };
        let one = of(1);
        assert!(one == of(2) && one == of(3));
        let other = RenderParams { integrator, photons, width: 40, height: 30, ..params(&even(1.0), 4, 8) };
        assert!(one != render_quietly(&world, &other).film);
    }
}

fn write_hdr(folder: &Path, width: usize, texels: &[[f32; 3]]) -> PathBuf {
    let path = folder.join("sky.hdr");
    let pixels: Vec<_> = texels.iter().map(|&c| image::Rgb(c)).collect();
    let file = fs::File::create(&path).unwrap();
    HdrEncoder::new(file).encode(&pixels, width, texels.len() / width).unwrap();
    path
}

fn write_exr(folder: &Path, width: usize, texels: &[[f32; 3]], is_half: bool) -> PathBuf {
    use exr::prelude::{WritableImage, f16};
    let path = folder.join("sky.exr");
    let size = (width, texels.len() / width);
    let at = |p: exr::math::Vec2<usize>| texels[p.y() * width + p.x()];
    if is_half {
        let pixel = |p| Into::<(f16, f16, f16)>::into(at(p).map(f16::from_f32));
        let channels = exr::image::SpecificChannels::rgb(pixel);
        exr::image::Image::from_channels(size, channels).write().non_parallel().to_file(&path).unwrap();
    } else {
        let channels = exr::image::SpecificChannels::rgb(|p| Into::<(f32, f32, f32)>::into(at(p)));
        exr::image::Image::from_channels(size, channels).write().non_parallel().to_file(&path).unwrap();
    }
    path
}

fn picture() -> Vec<[f32; 3]> {
    // Exact in all formats.
    (0..40 * 20)
        .map(|i| [(i % 7) as f32, 2.0, if i == 333 { 120.0 } else { 0.5 }].map(|c| c * 0.25))
        .collect()
}

#[test]
fn files_give_their_values() {
    let folder = tempfile::tempdir().unwrap();
    let expected = Environment::new(40, 20, picture());
    let exr = |is_half| write_exr(folder.path(), 40, &picture(), is_half);
    let hdr = || write_hdr(folder.path(), 40, &picture());
    for write in [&hdr as &dyn Fn() -> PathBuf, &|| exr(false), &|| exr(true)] {
        let path = write();
        let file = EnvironmentFile::open(&path).unwrap();
        assert!(file.bytes() >= 40 * 20 * 12 + 40 * 20 * 4 && file.bytes() < 1 << 20);
        assert!(file.read().unwrap() == expected, "{path:?}");
    }
    let mut odd = picture();
    odd[5] = [f32::NAN, -3.0, f32::INFINITY];
    let read = EnvironmentFile::open(&write_exr(folder.path(), 40, &odd, false)).unwrap().read().unwrap();
    assert_eq!(read.repaired(), 3);
}

#[test]
fn broken_files_are_errors_of_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let error_of = |path: &Path| match EnvironmentFile::open(path).and_then(|file| file.read()) {
        Ok(_) => None,
        Err(error) => Some(error.to_string()),
    };
    let path = folder.path().join("none.hdr");
    assert!(error_of(&path).unwrap().contains("none.hdr"));
    assert!(error_of(&folder.path().join("sky.jpg")).unwrap().ends_with("must end in .hdr or .exr"));
    fs::write(&path, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4294967295 +X 4294967295\n").unwrap();
    assert!(error_of(&path).unwrap().contains("none.hdr: "));
    fs::write(&path, [&b"#?RADIANCE\n\n-Y 9000 +X 9000\n"[..], &vec![0; 6 << 20]].concat()).unwrap();
    assert!(error_of(&path).unwrap().contains("64 million"));
    fs::write(&path, b"#?RADIANCE\n\n-Y 900 +X 900\nabcd").unwrap();
    assert!(error_of(&path).unwrap().contains("cut off"));

    let whole = [write_hdr(folder.path(), 40, &picture()), write_exr(folder.path(), 40, &picture(), true)];
    for path in whole {
        let bytes = fs::read(&path).unwrap();
        for len in (0..bytes.len()).step_by(17) {
            fs::write(&path, &bytes[..len]).unwrap();
            assert!(!error_of(&path).expect("a part is no picture").contains('\n'));
        }
        // Damage may give another picture, but nothing else.
        for i in (0..bytes.len()).filter(|&i| i < 600 || i % 13 == 0) {
            let mut damaged = bytes.clone();
            damaged[i] ^= 1 << (i % 8);
            fs::write(&path, &damaged).unwrap();
            error_of(&path);
        }
    }
}
