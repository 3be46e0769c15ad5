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
fn what_cannot_be_is_refused() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(100).ply());
    folder.run("proxy hills.ply -o a.stl").failed(&["a.stl", ".ply, .obj or .glb"]);
    folder.run("proxy hills.ply -o a.ply --memory 10M").failed(&["a memory budget of 10 MiB is too little"]);
    folder.run("proxy hills.ply -o hills.ply").failed(&["hills.ply", "is an input too"]);
    assert_eq!(folder.run("proxy hills.ply -o a.ply --ratio 2").code, Some(2));
    assert_eq!(folder.names(""), ["hills.ply"]);
}
