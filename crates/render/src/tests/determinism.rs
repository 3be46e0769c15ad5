//! The same picture, to the last bit, however the work is cut.

use crate::{
    RenderOutput, RenderProgress, RenderStats,
    camera::CameraPaths,
    integrator::{DirectLight, PathTracer},
    lights::{AreaLights, PunctualLights},
    material::Materials,
    params::{Integrator, RenderParams},
    render::{Watch, render},
    sampling::power_heuristic,
    sky::SkyLight,
    testing::{cornell_box, render_quietly, render_tiles_with},
    unfinished::Unfinished,
    wave::Tile,
    world::World,
};
use raystrips_geom::scene::Sky;
use std::sync::Mutex;

fn params(threads: usize) -> RenderParams {
    RenderParams { width: 70, height: 45, spp: 4, threads, ..RenderParams::default() }
}

#[test]
fn threads_change_nothing() {
    let world = cornell_box();
    for integrator in [Integrator::Path, Integrator::Ao, Integrator::Normal] {
        let picture = |threads| render_quietly(&world, &RenderParams { integrator, ..params(threads) });
        let one = picture(1);
        for threads in [2, 3] {
            let other = picture(threads);
            assert!(one.film == other.film, "{integrator} with {threads} threads");
            assert_eq!(ray_counts(&one), ray_counts(&other));
        }
        assert!(one.film != render_quietly(&world, &RenderParams { seed: 1, integrator, ..params(1) }).film);
    }
}

fn ray_counts(output: &RenderOutput) -> [u64; 3] {
    let RenderStats { primary, shadow, secondary, .. } = output.stats;
    [primary, shadow, secondary]
}

#[test]
fn order_of_tiles_changes_nothing() {
    let (world, params) = (cornell_box(), params(1));
    let materials = Materials::new(&world.description);
    let shader = PathTracer::new(
        CameraPaths::new(&params, &world).unwrap(),
        DirectLight {
            area_lights: AreaLights::new(world.emitters(), &materials),
            punctual_lights: PunctualLights::new(&[]),
            weight: power_heuristic,
            sky: SkyLight::Smooth(Sky::Constant([0.0; 3])),
            sky_weight: power_heuristic,
        },
        params.max_bounces,
    );
    let picture = |tiles: &[Tile]| render_tiles_with(&world, &params, (&materials, &shader), tiles);
    let mut tiles = Tile::cover(params.width, params.height);
    let film = picture(&tiles).film;
    assert!(film == render_quietly(&world, &params).film);
    tiles.reverse();
    assert!(film == picture(&tiles).film);
    tiles.rotate_left(2);
    tiles.swap(0, 3);
    assert!(film == picture(&tiles).film);
    // Other tiles too.
    let columns: Vec<Tile> =
        (0..params.width).map(|x| Tile { x, y: 0, width: 1, height: params.height }).collect();
    assert!(film == picture(&columns).film);
}

#[test]
fn progress_ends_with_everything() {
    let last = Mutex::new(None);
    let output =
        render(&cornell_box(), &params(2), &|progress| *last.lock().unwrap() = Some(progress)).unwrap();
    let [primary, shadow, secondary] = ray_counts(&output);
    let samples_total = 70 * 45 * 4;
    assert_eq!(primary, samples_total);
    let expected =
        RenderProgress { samples_done: primary, samples_total, rays: primary + shadow + secondary };
    assert_eq!(*last.lock().unwrap(), Some(expected));
}

#[test]
fn pauses_change_nothing() {
    let world = cornell_box();
    let whole = render_quietly(&world, &params(2));
    let mut unfinished = Unfinished::new(&params(2));
    let mut parts = 0;
    while !unfinished.is_finished() {
        let watch = Watch { is_due: &|| true, progress: &|_| {} };
        unfinished = crate::render_tiles(&world, &params(2), unfinished, &watch).unwrap();
        parts += 1;
    }
    assert!(parts > 1);
    let output = unfinished.into_output();
    assert!(output.film == whole.film);
    assert_eq!(ray_counts(&output), ray_counts(&whole));
}
