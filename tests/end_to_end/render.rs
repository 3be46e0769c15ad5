//! `render`: pictures, statistics, the cache of packs, cameras.

use crate::models::{Mesh, PAINTS};
use crate::pictures::{Exr, read_png};
use crate::support::{Folder, assert_keys, repository_file};
use serde_json::{Value, json};
use std::time::SystemTime;

/// Quick settings.
const QUICK: &str = "--size 24x16 --spp 4 --cache cache";

fn cornell() -> String {
    repository_file("scenes/cornell/scene.toml").to_str().unwrap().to_owned()
}

/// Renders, with the name of the scene apart as it may hold spaces.
fn render(folder: &Folder, scene: &str, arguments: &str) {
    let mut all = vec!["render", scene];
    all.extend(arguments.split_whitespace());
    let outcome = folder.run_args(&all).done();
    assert!(outcome.stdout.contains("samples a pixel"), "{outcome:#?}");
}

#[test]
fn the_cornell_box_as_png_and_exr_with_statistics() {
    let folder = Folder::new();
    render(&folder, &cornell(), &format!("-o a.png --stats stats.json {QUICK}"));
    render(&folder, &cornell(), &format!("-o a.exr {QUICK}"));
    let (width, height, bytes) = read_png(&folder.path("a.png"));
    assert_eq!((width, height), (24, 16));
    assert!(bytes.iter().max() > Some(&200) && bytes.iter().min() < Some(&60), "there is light and shadow");
    let exr = Exr::read(&folder.path("a.exr"));
    assert_eq!((exr.width, exr.height), (24, 16));
    let names =
        ["R", "G", "B", "depth.Z", "albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z"];
    assert!(names.iter().all(|name| exr.channels.contains_key(*name)), "{:?}", exr.channels.keys());

    let stats: Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
    let keys = "rays.primary rays.shadow rays.secondary seconds.total seconds.generate seconds.approximate \
                seconds.sort seconds.trace seconds.shade seconds.io_wait pages.read pages.bytes_read pages.hits \
                pages.evicted peak_rss_bytes ordering triangles";
    assert_keys(&stats, &keys.split(' ').collect::<Vec<_>>());
    assert_eq!(stats["rays"]["primary"], 24 * 16 * 4);
    assert!(stats["rays"]["shadow"].as_u64() > Some(0) && stats["rays"]["secondary"].as_u64() > Some(0));
    let faces = std::fs::read_to_string(repository_file("scenes/cornell/cornell.obj")).unwrap();
    let triangles: usize =
        faces.lines().filter(|l| l.starts_with("f ")).map(|l| l.split_whitespace().count() - 3).sum();
    assert_eq!(stats["triangles"], triangles);
}

#[test]
fn the_same_picture_for_any_number_of_threads_and_another_for_another_seed() {
    let folder = Folder::new();
    for ending in ["png", "exr"] {
        let picture = |name: &str, options: &str| {
            render(&folder, &cornell(), &format!("-o {name}.{ending} {QUICK} {options}"));
            folder.read(&format!("{name}.{ending}"))
        };
        let one = picture("one", "--threads 1");
        assert!(one == picture("two", "--threads 2"), "{ending}");
        assert!(one == picture("three", "--threads 3 --seed 0"), "{ending}");
        assert!(one != picture("other", "--threads 2 --seed 1"), "{ending}");
    }
}

#[test]
fn every_integrator_makes_a_picture_of_its_own() {
    let folder = Folder::new();
    let mut pictures = Vec::new();
    for integrator in ["path", "ao", "normal"] {
        render(&folder, &cornell(), &format!("-o a.png --integrator {integrator} {QUICK}"));
        let (_, _, picture) = read_png(&folder.path("a.png"));
        assert!(!pictures.contains(&picture), "{integrator}");
        pictures.push(picture);
    }
}

/// The pack in a cache folder and when it was written.
fn cached(folder: &Folder, cache: &str) -> (String, SystemTime) {
    let packs: Vec<String> = folder.names(cache).into_iter().filter(|name| name.ends_with(".rsp")).collect();
    assert_eq!(packs.len(), 1, "{packs:?}");
    let path = folder.path(cache).join(&packs[0]);
    (packs[0].clone(), path.metadata().unwrap().modified().unwrap())
}

#[test]
fn packs_are_kept_until_the_model_changes() {
    let folder = Folder::new();
    folder.write("a.obj", Mesh::cuboid([1.0; 3]).obj(&[]));
    let picture = || {
        render(&folder, "a.obj", &format!("-o a.png --integrator normal {QUICK}"));
        (folder.read("a.png"), cached(&folder, "cache"))
    };
    let (first, pack) = picture();
    let (second, same_pack) = picture();
    assert!(first == second);
    assert_eq!(pack, same_pack, "nothing was converted");
    folder.write("a.obj", Mesh::cuboid([1.0, 2.0, 7.0]).obj(&[]));
    let (third, new_pack) = picture();
    assert!(first != third);
    assert_eq!(new_pack.0, pack.0);
    assert_ne!(new_pack.1, pack.1);
    // A damaged list or a lost pack are made again.
    let pack_name = format!("cache/{}", pack.0);
    folder.write(&pack_name.replace(".rsp", ".json"), "nonsense");
    assert!(picture().0 == third);
    std::fs::remove_file(folder.path(&pack_name)).unwrap();
    assert!(picture().0 == third);
}

#[test]
fn files_that_a_scene_names_count_too() {
    let folder = Folder::new();
    folder.write("models/a.obj", Mesh::cuboid([1.0; 3]).obj(&[(0, "red")]));
    folder.write("models/paints.mtl", PAINTS);
    folder.write("scene.toml", "[[model]]\nfile = 'models/a.obj'\n");
    let picture = || {
        render(&folder, "scene.toml", &format!("-o a.png {QUICK}"));
        folder.read("a.png")
    };
    let red = picture();
    folder.write("models/paints.mtl", PAINTS.replace("0.9 0.1", "0.1 0.95"));
    assert!(picture() != red);
    folder.write("models/paints.mtl", PAINTS);
    assert!(picture() == red);
}

#[test]
fn a_file_that_was_missing_counts_when_it_comes() {
    let folder = Folder::new();
    folder.write("a.obj", Mesh::cuboid([1.0; 3]).obj(&[(0, "red")]));
    let picture = || {
        let outcome = folder.run(&format!("render a.obj -o a.png {QUICK}")).done_with_notes();
        assert!(outcome.stderr.contains("paints.mtl"), "{outcome:#?}");
        folder.read("a.png")
    };
    // What was told is told again.
    let gray = picture();
    let (_, written) = cached(&folder, "cache");
    assert!(picture() == gray);
    assert_eq!(cached(&folder, "cache").1, written);
    folder.write("paints.mtl", PAINTS);
    render(&folder, "a.obj", &format!("-o a.png {QUICK}"));
    assert!(folder.read("a.png") != gray);
}

#[test]
fn without_a_cache_folder_it_is_the_users() {
    let folder = Folder::new();
    folder.write("a.obj", Mesh::cuboid([1.0; 3]).obj(&[]));
    render(&folder, "a.obj", "-o a.png --size 8x8 --spp 1");
    cached(&folder, "user-cache/raystrips");
}

#[test]
fn a_picture_of_another_kind_is_refused_before_any_work() {
    let folder = Folder::new();
    folder.write("a.obj", Mesh::cuboid([1.0; 3]).obj(&[]));
    for name in ["a.jpg", "a", "png"] {
        folder.run(&format!("render a.obj -o {name} {QUICK}")).failed(&[name, ".exr", ".png"]);
    }
    assert_eq!(folder.names(""), ["a.obj"]);
    render(&folder, "a.obj", &format!("-o A.PNG {QUICK}"));
}

#[test]
fn cameras_by_name_number_and_numbers() {
    let folder = Folder::new();
    let camera =
        |name: &str| json!({"name": name, "type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}});
    let node = |number: u32, name: &str, x: f64| json!({"name": name, "camera": number, "translation": [x, 0.5, 6.0]});
    let cameras = json!({"cameras": [camera("left"), camera("right")]});
    let nodes = [node(0, "left", 0.0), node(1, "right", 1.0)];
    folder.write("a.glb", Mesh::cuboid([1.0; 3]).glb(json!({}), &nodes, cameras));
    folder.run("convert a.glb -o a.rsp").done();
    let picture = |camera: &str| {
        render(&folder, "a.rsp", &format!("-o a.png --integrator normal {QUICK} {camera}"));
        folder.read("a.png")
    };
    let (left, right) = (picture("--camera left"), picture("--camera right"));
    assert!(left != right);
    assert!(picture("") == left && picture("--camera 0") == left && picture("--camera 1") == right);
    let fov = 0.7f64.to_degrees();
    assert!(picture(&format!("--camera 0,0.5,6,0,0.5,0,{fov}")) == left);
    let refused = |camera: &str, words: &[&str]| {
        folder.run(&format!("render a.rsp -o b.png {QUICK} --camera {camera}")).failed(words);
    };
    refused("middle", &["middle", "left, right"]);
    refused("2", &["2 cameras"]);
    refused("1,2,3", &["1,2,3"]);
    refused("1,2,3,1,2,3", &["same"]);
    assert!(!folder.path("b.png").exists());
}

#[test]
fn photons_find_the_light_that_paths_find() {
    let folder = Folder::new();
    let mean = |options: &str| {
        render(&folder, &cornell(), &format!("-o a.exr --size 24x16 --spp 64 --cache cache {options}"));
        let exr = Exr::read(&folder.path("a.exr"));
        exr.channels["G"].iter().map(|&g| f64::from(g)).sum::<f64>() / (24.0 * 16.0)
    };
    let (path, photon) = (mean(""), mean("--integrator photon --photons 50000 --photon-passes 2"));
    assert!((photon / path - 1.0).abs() < 0.02, "path {path}, photon {photon}");
    // What photons need is taken from the memory that is given.
    let options = "--integrator photon --photons 10000000 --memory 500M";
    let scene = cornell();
    let mut all = vec!["render", scene.as_str(), "-o", "b.exr", "--cache", "cache"];
    all.extend(options.split(' '));
    folder.run_args(&all).failed(&["too little", "--memory"]);
}
