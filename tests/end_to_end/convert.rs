//! `convert` and `info`: what they write and what they tell.

use crate::models::{Mesh, PAINTS};
use crate::support::{Folder, Outcome, assert_keys};
use serde_json::{Value, json};

/// Keys that other programs rely on.
const KEYS: &[&str] = &[
    "triangles",
    "vertices",
    "strips",
    "triangles_per_strip",
    "pages",
    "bytes.file",
    "bytes.vertices",
    "bytes.indices",
    "bytes.strip_trees",
    "bytes.nodes",
    "bytes.materials",
    "bytes.other",
    "bytes.proxy",
    "bytes_per_triangle",
    "proxy.triangles",
    "bounds.min",
    "bounds.max",
    "dropped.degenerate",
    "dropped.non_finite",
    "dropped.out_of_range",
];

/// Converts to `out.rsp`, and checks what `convert` and `info` say about it against each other and the file.
fn converted(folder: &Folder, arguments: &str) -> Value {
    let mut told = folder.run(&format!("convert {arguments} -o out.rsp --json")).done().json();
    assert_keys(&told, KEYS);
    assert_keys(&told, &["seconds.total", "peak_rss_bytes"]);
    let stages: f64 = sum(&told["seconds"], |key| key != "total");
    assert!((stages - told["seconds"]["total"].as_f64().unwrap()).abs() < 1e-9, "{told:#}");
    assert!(told["peak_rss_bytes"].as_u64().unwrap() > 1 << 20 || cfg!(not(target_os = "linux")));

    assert_eq!(told["bytes"]["file"], folder.read("out.rsp").len());
    assert_eq!(sum(&told["bytes"], |key| key != "file"), told["bytes"]["file"].as_f64().unwrap(), "{told:#}");
    let triangles = told["triangles"].as_f64().unwrap();
    let named = sum(&told["bytes"], |key| ["vertices", "indices", "strip_trees", "nodes"].contains(&key));
    let most = named + told["bytes"]["other"].as_f64().unwrap();
    let per_triangle = told["bytes_per_triangle"].as_f64().unwrap();
    assert!(named / triangles <= per_triangle && per_triangle <= most / triangles, "{told:#}");
    let per_strip = triangles / told["strips"].as_f64().unwrap();
    assert_eq!(told["triangles_per_strip"].as_f64(), Some(per_strip));

    let info = folder.run("info out.rsp --json").done().json();
    for key in ["seconds", "peak_rss_bytes"] {
        told.as_object_mut().unwrap().remove(key);
    }
    assert_eq!(info, told);
    assert!(told["bytes"]["vertices"].as_u64().unwrap() > 0);
    folder.run("verify out.rsp").done();
    told
}

fn sum(object: &Value, wanted: impl Fn(&str) -> bool) -> f64 {
    let values = object.as_object().unwrap().iter().filter(|(key, _)| wanted(key));
    values.map(|(_, value)| value.as_f64().unwrap()).sum()
}

fn assert_bounds(told: &Value, min: [f64; 3], max: [f64; 3]) {
    assert_eq!(told["bounds"], json!({"min": min, "max": max}));
}

#[test]
fn obj_with_materials() {
    let folder = Folder::new();
    folder.write("box.obj", Mesh::cuboid([1.0, 2.0, 3.0]).obj(&[(0, "red"), (6, "green")]));
    folder.write("paints.mtl", PAINTS);
    let told = converted(&folder, "box.obj");
    assert_eq!(told["triangles"], 12);
    assert_eq!(told["vertices"], 8);
    assert_eq!(told["pages"], 1);
    assert_eq!(told["geometries"], 2);
    assert_eq!(told["scene_offset"], json!([0.0, 0.0, 0.0]));
    assert_eq!(told["dropped"], json!({"degenerate": 0, "non_finite": 0, "out_of_range": 0}));
    assert_bounds(&told, [0.0; 3], [1.0, 2.0, 3.0]);
}

#[test]
fn binary_ply_of_many_pages() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(60).ply());
    let told = converted(&folder, "hills.ply --page-size 4K");
    assert_eq!(told["triangles"], 7200);
    assert!(told["pages"].as_u64().unwrap() > 10);
    assert!(told["triangles_per_strip"].as_f64().unwrap() > 4.0);
    assert_eq!(told["id_bytes"], 0);
    let with_ids = converted(&folder, "hills.ply --page-size 4K --keep-ids");
    assert_eq!(with_ids["id_bytes"], 4);
    let file = |told: &Value| told["bytes"]["file"].as_u64().unwrap();
    assert!(file(&with_ids) >= file(&told) + 4 * 7200 - 4096);
    assert_eq!(with_ids["bytes_per_triangle"], told["bytes_per_triangle"], "ids are not needed to trace");
}

#[test]
fn a_grid_is_smaller_and_says_how_far_vertices_moved() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(60).ply());
    let exact = converted(&folder, "hills.ply");
    assert_eq!(exact["position_error"], 0.0);
    let grid = converted(&folder, "hills.ply --positions grid");
    let coarse = converted(&folder, "hills.ply --positions grid:8");
    let vertices = |told: &Value| told["bytes"]["vertices"].as_u64().unwrap();
    assert!(vertices(&coarse) < vertices(&grid) && vertices(&grid) < vertices(&exact));
    let size = (0..3).map(|i| {
        let at = |corner: &str| exact["bounds"][corner][i].as_f64().unwrap();
        at("max") - at("min")
    });
    let size = size.fold(0.0, f64::max);
    for (told, bits) in [(&grid, 16), (&coarse, 8)] {
        let error = told["position_error"].as_f64().unwrap();
        assert!(error > 0.0 && error <= size / f64::from(1 << bits), "{error}");
    }
}

#[test]
fn glb_stands_where_its_node_says() {
    let folder = Folder::new();
    let node = json!({"translation": [10.0, 20.0, 30.0], "scale": [2.0, 2.0, 2.0]});
    let cameras = json!({"cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]});
    folder.write("box.glb", Mesh::cuboid([1.0, 2.0, 3.0]).glb(node, &[json!({"camera": 0})], cameras));
    let told = converted(&folder, "box.glb");
    assert_eq!(told["triangles"], 12);
    assert_eq!(told["cameras"], 1);
    assert_bounds(&told, [10.0, 20.0, 30.0], [12.0, 24.0, 36.0]);
}

#[test]
fn several_inputs_are_one_scene() {
    let folder = Folder::new();
    folder.write("a.obj", Mesh::cuboid([1.0; 3]).obj(&[]));
    folder.write("b.ply", Mesh::cuboid([5.0, 0.5, 0.5]).ply());
    let told = converted(&folder, "a.obj b.ply");
    assert_eq!(told["triangles"], 24);
    assert_bounds(&told, [0.0; 3], [5.0, 1.0, 1.0]);
}

#[test]
fn what_is_left_out_is_counted_and_told() {
    let folder = Folder::new();
    let mut mesh = Mesh::cuboid([1.0; 3]);
    mesh.triangles.push([0, 1, 1]);
    folder.write("box.obj", format!("{}v nan 0 0\nf 1 2 9\nf 1 2 99\n", mesh.obj(&[])));
    let refused = "box.obj, line 24";
    folder.run("convert box.obj -o out.rsp").failed(&[refused, "99", "--drop-out-of-range"]);
    let outcome = folder.run("convert box.obj -o out.rsp --json --drop-out-of-range");
    assert_eq!(outcome.code, Some(0), "{outcome:#?}");
    assert_eq!(outcome.json()["dropped"], json!({"degenerate": 1, "non_finite": 1, "out_of_range": 1}));
    assert_eq!(outcome.json()["triangles"], 12);
    assert!(outcome.stderr.contains("1 without area, 1 not finite, 1 out of range"), "{outcome:#?}");
}

#[test]
fn without_json_there_is_text() {
    let folder = Folder::new();
    folder.write("box.obj", Mesh::cuboid([1.0; 3]).obj(&[]));
    let says = |outcome: Outcome, words: &[&str]| {
        let outcome = outcome.done();
        assert!(!outcome.stdout.starts_with('{'), "{outcome:#?}");
        assert!(words.iter().all(|word| outcome.stdout.contains(word)), "{words:?}: {outcome:#?}");
    };
    says(folder.run("convert box.obj -o out.rsp"), &["out.rsp", "12 triangles"]);
    says(folder.run("info out.rsp"), &["triangles  12", "bytes/triangle", "bounds"]);
    says(folder.run("verify out.rsp"), &["out.rsp", "good", "12 triangles"]);
}

#[test]
fn threads_change_no_byte() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(100).ply());
    for (name, threads) in [("one.rsp", 1), ("two.rsp", 2), ("again.rsp", 2), ("all.rsp", 0)] {
        folder.run(&format!("convert hills.ply --keep-ids --threads {threads} -o {name}")).done();
        assert!(folder.read(name) == folder.read("one.rsp"), "{name} differs");
    }
}
