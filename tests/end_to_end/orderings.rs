//! The same picture in any order, by any threads, with any part of the pack in memory.

use crate::hair::lawn;
use crate::instances::rings;
use crate::models::Mesh;
use crate::support::{Folder, repository_file};
use crate::textures::quarters;
use raystrips_render::{
    Curve, Film, HitPoints, Integrator, OrderParams, Ordering, PagedWorld, PhotonParams, QueueParams,
    RenderParams, Schedule, TracedWorld, Unfinished, Watch, World, render, render_ordered, render_queued,
};
use raystrips_tracer::{PagePool, ProxyKind, Scene};
use std::path::Path;

/// Parts of the pages in memory, in percent.
const BUDGETS: [u64; 3] = [100, 25, 6];

fn params_of(integrator: Integrator, threads: usize) -> RenderParams {
    let photons = PhotonParams { count: 4000, nearest: 20, passes: 2, gather_rays: 3 };
    RenderParams { integrator, photons, width: 48, height: 32, spp: 4, threads, ..RenderParams::default() }
}

/// The pack at `path` with so many percent of its pages in memory.
fn paged_world(path: &Path, percent: u64) -> PagedWorld {
    let pages = Scene::open(path).unwrap().manifest().pages;
    let frame_bytes = PagePool::frame_bytes(PagePool::open(path, 0, 0).unwrap().pack());
    PagedWorld::new(PagePool::open(path, (pages * percent / 100).max(2) * frame_bytes, 1 << 20).unwrap())
}

fn hit_points(path: &Path, world: &dyn World) -> HitPoints {
    let proxy = Scene::open_proxy(path, ProxyKind::Fine).unwrap();
    HitPoints::new(proxy, Scene::open(path).unwrap().geometry_bounds(), &world.bounds())
}

/// Renders with as many pauses as there can be, or without any.
fn to_the_end(
    params: &RenderParams,
    has_pauses: bool,
    part: impl Fn(Unfinished, &Watch) -> Result<Unfinished, raystrips_render::RenderError>,
) -> raystrips_render::RenderOutput {
    let mut unfinished = Unfinished::new(params);
    let watch = Watch { is_due: &|| has_pauses, progress: &|_| {} };
    while !unfinished.is_finished() {
        unfinished = part(unfinished, &watch).unwrap();
    }
    unfinished.into_output()
}

fn check_all(path: &Path, integrator: Integrator) {
    let params = |threads| params_of(integrator, threads);
    let whole = TracedWorld::new(Scene::open(path).unwrap());
    let resident = render(&whole, &params(1), &|_| {}).unwrap();
    let rays = |stats: &raystrips_render::RenderStats| [stats.primary, stats.shadow, stats.secondary];
    let check = |output: raystrips_render::RenderOutput, what: &str| {
        let same: fn(&Film, &Film) -> bool = |a, b| a == b;
        assert!(same(&output.film, &resident.film), "{what}");
        // After a pause photons are sent out once more.
        assert!(integrator == Integrator::Photon || rays(&output.stats) == rays(&resident.stats), "{what}");
    };
    let hit_points = hit_points(path, &whole);
    let scratch = tempfile::tempdir().unwrap();
    for (i, ordering) in Ordering::ALL.into_iter().enumerate() {
        let threads = 1 + i % 2;
        let curve = if i < 3 { Curve::Z } else { Curve::Hilbert };
        let order = |buffer_bytes, scratch| OrderParams {
            ordering,
            curve,
            buffer_bytes,
            scratch,
            hit_points: Some(&hit_points),
        };
        // Of whole generations, with little memory, and of few paths at a time.
        for (scratch, has_pauses) in [(Some(scratch.path()), false), (None, false), (None, true)] {
            let order = order(1 << 20, scratch);
            let what = format!("{ordering:?} in memory, scratch {scratch:?}, pauses {has_pauses}");
            check(
                to_the_end(&params(threads), has_pauses, |begin, watch| {
                    render_ordered(&whole, &params(threads), &order, begin, watch)
                }),
                &what,
            );
        }
        for (threads, percent) in [1, 2].into_iter().flat_map(|t| BUDGETS.map(|percent| (t, percent))) {
            let order = order(1 << 18, Some(scratch.path()));
            let world = paged_world(path, percent);
            let has_pauses = percent == 25;
            let what = format!("{ordering:?}, {threads} threads, {percent} %");
            check(
                to_the_end(&params(threads), has_pauses, |begin, watch| {
                    render_ordered(&world, &params(threads), &order, begin, watch)
                }),
                &what,
            );
        }
    }
    for (threads, percent) in [1, 2].into_iter().flat_map(|t| BUDGETS.map(|percent| (t, percent))) {
        for (schedule, read_bytes) in
            [(Schedule::Longest, 0), (Schedule::Longest, 1 << 15), (Schedule::Benefit, 1 << 16)]
        {
            let world = paged_world(path, percent);
            let paging = QueueParams { ray_bytes: 1 << 16, process_bytes: u64::MAX, read_bytes, schedule };
            let has_pauses = percent == 25;
            let what = format!("queues {paging:?}, {threads} threads, {percent} %");
            check(
                to_the_end(&params(threads), has_pauses, |begin, watch| {
                    render_queued(&world, &params(threads), &paging, begin, watch)
                }),
                &what,
            );
            let has_many_pages = world.pool().pack().directory.len() > 100;
            assert!(world.pool().counts().evicted > 0 || percent > 6 || !has_many_pages, "{what}");
        }
        let world = paged_world(path, percent);
        check(render(&world, &params(threads), &|_| {}).unwrap(), &format!("{threads} threads, {percent} %"));
    }
}

#[test]
fn a_surface_under_the_sky() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(200).ply());
    folder.run("convert ring.ply -o ring.rsp --page-size 4K").done();
    check_all(&folder.path("ring.rsp"), Integrator::Path);
}

#[test]
fn a_closed_room_with_area_lights() {
    let folder = Folder::new();
    let scene = repository_file("scenes/cornell/scene.toml");
    folder.run_args(&["convert", scene.to_str().unwrap(), "-o", "cornell.rsp", "--page-size", "4K"]).done();
    check_all(&folder.path("cornell.rsp"), Integrator::Path);
    check_all(&folder.path("cornell.rsp"), Integrator::Photon);
}

#[test]
fn leaves_that_textures_cut_out() {
    let folder = Folder::new();
    let Mesh { vertices, triangles } = Mesh::hills(40);
    let mut text = "mtllib a.mtl\nusemtl a\n".to_owned();
    for [x, y, z] in &vertices {
        text += &format!("v {x} {y} {z}\nvt {x} {z}\nvn {x} 9 {z}\n");
    }
    for triangle in &triangles {
        let [a, b, c] = triangle.map(|v| v + 1);
        text += &format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\n");
    }
    folder.write("a.obj", text);
    folder.write("a.mtl", "newmtl a\nKd 1 1 1\nmap_Kd a.png\nmap_d a.png\nmap_Bump a.png\n");
    folder.write("a.png", quarters(512));
    folder.write("ground.ply", Mesh::hills(12).ply());
    folder.write("lamp.obj", "v 2 9 2\nv 9 9 2\nv 9 9 9\nv 2 9 9\nf 1 2 3 4\n");
    let scene = "material = [ { name = 'lamp', emission = [4.0, 4.0, 4.0] } ]\n\
                 light = [ { type = 'point', position = [4.0, 7.0, 4.0], intensity = [9.0, 9.0, 9.0] } ]\n\
                 model = [ { file = 'a.obj', translate = [0.0, 2.0, 0.0] }, { file = 'ground.ply' }, \
                 { file = 'lamp.obj', material = 'lamp' } ]";
    folder.write("scene.toml", scene);
    folder.run("convert scene.toml -o leaves.rsp --page-size 4K").done();
    check_all(&folder.path("leaves.rsp"), Integrator::Path);
}

#[test]
fn rings_that_are_instances() {
    let folder = Folder::new();
    rings(&folder);
    folder.run("convert rings.gltf -o rings.rsp --page-size 4K").done();
    check_all(&folder.path("rings.rsp"), Integrator::Path);
}

/// Strands that are partly opaque over a surface, with a lamp above.
#[test]
fn hair_on_the_ground() {
    let folder = Folder::new();
    folder.write("lawn.hair", lawn(12));
    folder.write("ground.ply", Mesh::hills(12).ply());
    folder.write("lamp.obj", "v 2 9 2\nv 9 9 2\nv 9 9 9\nv 2 9 9\nf 1 2 3 4\n");
    let scene = "material = [ { name = 'lamp', emission = [4.0, 4.0, 4.0] } ]\n\
                 model = [ { file = 'lawn.hair' }, { file = 'ground.ply' }, { file = 'lamp.obj', material = 'lamp' } ]";
    folder.write("scene.toml", scene);
    folder.run("convert scene.toml -o lawn.rsp --page-size 4K").done();
    check_all(&folder.path("lawn.rsp"), Integrator::Path);
    check_all(&folder.path("lawn.rsp"), Integrator::Photon);
}
