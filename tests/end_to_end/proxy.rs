//! Meshes of fewer triangles.

use crate::models::Mesh;
use crate::support::Folder;

#[test]
fn the_asked_count_in_every_format() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(100).ply());
    for (arguments, triangles) in [
        ("-o a.ply", 400),
        ("-o a.obj --ratio 0.1", 2000),
        ("-o a.glb --triangles 1K", 1000),
        ("-o b.ply --ratio 1", 20_000),
    ] {
        let told = folder.run(&format!("proxy hills.ply {arguments} --measure --json")).done().json();
        let count = told["triangles"].as_f64().unwrap();
        assert!((count / f64::from(triangles) - 1.0).abs() < 0.02, "{arguments}: {told}");
        assert_eq!(told["input"]["triangles"], 20_000);
        let mean = told["distance"]["percent"]["mean"].as_f64().unwrap();
        assert!((0.0..1.0).contains(&mean), "{told}");
        let name = arguments.split(' ').nth(1).unwrap();
        let read = folder.run(&format!("convert {name} -o a.rsp --json")).done().json();
        assert_eq!(read["triangles"], told["triangles"], "{arguments}");
    }
}

#[test]
fn the_same_bytes_again_and_a_place_far_away() {
    let folder = Folder::new();
    let far = |i, j| [5e6 + f64::from(i), 0.25 * f64::from(i * j % 7), f64::from(j)];
    folder.write("far.ply", Mesh::height_field(50, far).ply_f64());
    for name in ["a.ply", "b.ply"] {
        folder.run(&format!("proxy far.ply -o {name} --ratio 0.2 --threads 2")).done();
    }
    assert!(folder.read("a.ply") == folder.read("b.ply"));
    let told = folder.run("convert a.ply -o a.rsp --json").done().json();
    let offset = told["scene_offset"][0].as_f64().unwrap();
    let min = told["bounds"]["min"][0].as_f64().unwrap();
    assert!((min + offset - 5e6).abs() < 1.0, "{told}");
}

#[test]
fn in_pieces_a_closed_mesh_stays_closed_and_memory_and_threads_change_no_byte() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(600).ply());
    std::fs::create_dir(folder.path("scratch")).unwrap();
    let proxy =
        |options: &str| folder.run(&format!("proxy ring.ply --json {options}")).done_with_notes().json();
    let told = proxy("-o a.obj --measure");
    assert!(told["input"]["pieces"].as_u64().unwrap() > 1, "{told}");
    assert!((14_112..=14_688).contains(&told["triangles"].as_u64().unwrap()), "{told}");
    assert!(told["distance"]["percent"]["max"].as_f64().unwrap() < 0.5, "{told}");
    let text = String::from_utf8(folder.read("a.obj")).unwrap();
    let read = Mesh::of_obj(&text);
    assert_eq!((read.open_edges(), read.triangles.len() as u64), (0, told["triangles"].as_u64().unwrap()));
    for options in ["--threads 1", "--memory 160M --threads 2", "--threads 3 --memory 180M --scratch scratch"]
    {
        let told = proxy(&format!("-o b.obj {options}"));
        assert!(folder.read("a.obj") == folder.read("b.obj"), "{options}");
        let budget = options
            .split(' ')
            .find_map(|word| word.strip_suffix('M'))
            .map_or(u64::MAX, |megabytes| megabytes.parse::<u64>().unwrap() << 20);
        assert!(told["peak_rss_bytes"].as_u64().unwrap() <= budget, "{options}: {told}");
    }
    assert_eq!(folder.names("scratch"), [""; 0]);
    assert_eq!(folder.names(""), ["a.obj", "b.obj", "ring.ply", "scratch"]);
}

#[test]
fn what_is_no_surface_has_the_asked_count_too() {
    let folder = Folder::new();
    folder.write("soup.ply", Mesh::soup(50_000).ply());
    for (method, keeps_area) in [("auto", true), ("stochastic", true), ("quadric", false)] {
        let told =
            folder.run(&format!("proxy soup.ply -o {method}.obj --method {method} --json")).done().json();
        assert!((980..=1020).contains(&told["triangles"].as_u64().unwrap()), "{method}: {told}");
        let text = String::from_utf8(folder.read(&format!("{method}.obj"))).unwrap();
        let part = Mesh::of_obj(&text).area() / Mesh::soup(50_000).area();
        assert_eq!((part - 1.0).abs() < 0.1, keeps_area, "{method}: {part} of the area");
    }
    assert!(folder.read("auto.obj") == folder.read("stochastic.obj"));
}

#[test]
fn an_interrupted_one_leaves_nothing_that_would_not_go_on() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(500).ply());
    folder.run("proxy ring.ply -o whole.ply").done();
    for milliseconds in [20, 100, 200, 300] {
        let mut running = folder.start("proxy ring.ply -o a.ply --memory 160M");
        std::thread::sleep(std::time::Duration::from_millis(milliseconds));
        running.child.kill().unwrap();
        running.child.wait().unwrap();
    }
    assert_eq!(folder.run("proxy ring.ply -o a.ply --memory 160M").code, Some(0));
    assert!(folder.read("a.ply") == folder.read("whole.ply"));
    assert_eq!(folder.names(""), ["a.ply", "ring.ply", "whole.ply"]);
}

/// What `info` tells about proxies: triangles of the fine and of the coarse one, and their bytes.
fn proxies(folder: &Folder, pack: &str) -> [u64; 3] {
    let told = folder.run(&format!("info {pack} --json")).done().json();
    let numbers = [&told["proxy"]["triangles"], &told["proxy"]["coarse_triangles"], &told["bytes"]["proxy"]];
    numbers.map(|number| number.as_u64().unwrap())
}

#[test]
fn packs_have_proxies_as_large_as_was_asked_for() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(300).ply());
    folder.write("hills.ply", Mesh::hills(50).ply());
    let convert = |options: &str| {
        folder.run(&format!("convert {options} -o a.rsp")).done();
        folder.run("verify a.rsp").done();
        proxies(&folder, "a.rsp")
    };
    let near = |count: u64, wanted: u64| (count as f64 / wanted as f64 - 1.0).abs() < 0.02;
    let [fine, coarse, bytes] = convert("ring.ply");
    assert!(near(fine, 3600) && coarse == 0 && bytes > 10 * fine, "{fine} {coarse} {bytes}");
    let [fine, coarse, _] = convert("ring.ply --proxy-ratio 0.2");
    assert!(near(fine, 36_000) && near(coarse, 20_000), "{fine} {coarse}");
    let [fine, _, bytes] = convert("ring.ply --proxy-ratio 0.2 --proxy-memory 100K");
    assert!(fine > 2000 && (50 << 10..=100 << 10).contains(&bytes), "{fine} {bytes}");
    assert_eq!(convert("ring.ply --no-proxy"), [0; 3]);
    assert_eq!(convert("hills.ply"), [0; 3], "a small scene is its own proxy");
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(100).ply());
    folder.run("proxy hills.ply -o a.stl").failed(&["a.stl", ".ply, .obj, .glb or .hair"]);
    folder.run("proxy hills.ply -o a.ply --memory 10M").failed(&["a memory budget of 10 MiB is too little"]);
    folder.run("proxy hills.ply -o hills.ply").failed(&["hills.ply", "is an input too"]);
    assert_eq!(folder.run("proxy hills.ply -o a.ply --ratio 2").code, Some(2));
    assert_eq!(folder.names(""), ["hills.ply"]);
}
