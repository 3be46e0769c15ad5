//! Meshes that are shown many times, from files to pictures.

use crate::models::Mesh;
use crate::pictures::Exr;
use crate::support::Folder;
use serde_json::{Value, json};

/// Nodes of [`rings`].
const SHOWN: usize = 27;

/// Writes `rings.gltf`: a ring turned, drawn out, mirrored and colored at 27 places, every third time one that glows.
pub fn rings(folder: &Folder) {
    let Mesh { vertices, triangles } = Mesh::ring(48);
    let mut bytes: Vec<u8> = vertices.iter().flatten().flat_map(|&x| (x as f32).to_le_bytes()).collect();
    let positions = bytes.len();
    bytes.extend(triangles.iter().flatten().flat_map(|index| index.to_le_bytes()));
    folder.write("rings.bin", &bytes);
    let node = |i: usize| {
        let angle = i as f64 * 0.7;
        let scale = [[1.0, 1.0, 1.0], [-1.0, 1.0, 0.6]][i % 2];
        let at = [i % 3, i / 3 % 3, i / 9].map(|k| 2.5 * k as f64);
        json!({
            "mesh": usize::from(i % 3 == 1),
            "translation": at,
            "rotation": [angle.sin(), 0.0, 0.0, angle.cos()],
            "scale": scale,
        })
    };
    let mesh = |material: u32| json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": material}]});
    let document = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": (0..SHOWN).collect::<Vec<_>>()}],
        "nodes": (0..SHOWN).map(node).collect::<Vec<_>>(),
        "meshes": [mesh(0), mesh(1)],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.5, 0.3, 1.0], "metallicFactor": 0.0}},
            {"emissiveFactor": [1.0, 0.9, 0.5]},
        ],
        "buffers": [{"uri": "rings.bin", "byteLength": bytes.len()}],
        "bufferViews": [
            {"buffer": 0, "byteLength": positions},
            {"buffer": 0, "byteOffset": positions, "byteLength": bytes.len() - positions},
        ],
        "accessors": [
            {"bufferView": 0, "type": "VEC3", "componentType": 5126, "count": vertices.len()},
            {"bufferView": 1, "type": "SCALAR", "componentType": 5125, "count": 3 * triangles.len()},
        ],
    });
    folder.write("rings.gltf", document.to_string());
}

fn count(told: &Value, key: &str) -> u64 {
    told[key].as_u64().unwrap()
}

#[test]
fn what_is_shown_often_is_stored_once() {
    let folder = Folder::new();
    rings(&folder);
    let once = folder.run("convert rings.gltf -o once.rsp --json").done().json();
    let often = folder.run("convert rings.gltf -o often.rsp --no-instances --json").done().json();
    assert_eq!((count(&once, "instances"), count(&often, "instances")), (27, 0));
    assert_eq!(count(&once, "triangles"), 2 * 4608);
    assert_eq!(count(&once, "shown"), count(&often, "triangles"));
    assert!(6 * count(&once["bytes"], "vertices") < count(&often["bytes"], "vertices"));
    assert!(folder.run("info once.rsp").done().stdout.contains("27 instances"));
    folder.run("verify once.rsp").done();
    let bounds = |told: &Value, i: usize| told["bounds"]["max"][i].as_f64().unwrap();
    (0..3).for_each(|i| assert!((bounds(&once, i) - bounds(&often, i)).abs() < 0.4));
}

#[test]
fn models_that_a_scene_file_shows_often_are_stored_once() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(64).ply());
    let camera = "[camera]\nposition = [9.0, 7.0, 11.0]\ntarget = [4.0, 1.0, 0.0]\n";
    let model = |i: i32| {
        let place =
            format!("translate = [{}, {}, 0]\nrotate_degrees = [{}, 0, 0]", 3 * (i % 4), i / 4 * 3, i * 25);
        format!("[[model]]\nfile = 'ring.ply'\n{place}\n")
    };
    folder.write("scene.toml", (0..12).map(model).fold(camera.to_owned(), |text, model| text + &model));
    let once = folder.run("convert scene.toml -o once.rsp --json").done().json();
    let often = folder.run("convert scene.toml -o often.rsp --no-instances --json").done().json();
    assert_eq!((count(&once, "instances"), count(&often, "instances")), (12, 0));
    assert_eq!(count(&once, "shown"), count(&often, "triangles"));
    assert_eq!(count(&often, "triangles"), 12 * count(&once, "triangles"));
    let pictures = ["once", "often"].map(|pack| {
        folder.run(&format!("render {pack}.rsp -o a.exr --size 64x48 --spp 16 --integrator ao")).done();
        Exr::read(&folder.path("a.exr")).channels["R"].clone()
    });
    let apart = pictures[0].iter().zip(&pictures[1]).filter(|(a, b)| (*a - *b).abs() > 0.02).count();
    assert!(apart < 64 * 48 / 100, "{apart}");
}

#[test]
fn the_pack_is_the_same_for_any_memory_and_threads() {
    let folder = Folder::new();
    rings(&folder);
    folder.run("convert rings.gltf -o a.rsp --threads 1").done();
    folder.run("convert rings.gltf -o b.rsp --threads 2 --memory 120M").done_with_notes();
    assert!(folder.read("a.rsp") == folder.read("b.rsp"));
}

/// Also where they glow: lamps are sampled wherever they are shown.
#[test]
fn instances_look_like_copies() {
    let folder = Folder::new();
    rings(&folder);
    // Boxes of what is turned are larger than those of copies, so a camera that shows all would stand elsewhere.
    let camera = "position = [9.0, 7.0, 11.0]\ntarget = [2.5, 2.5, 2.5]";
    let model = "file = \"rings.gltf\"\ntranslate = [0.5, 0.0, 0.0]";
    folder.write("scene.toml", format!("[camera]\n{camera}\n[[model]]\n{model}\n"));
    let mean = |convert: &str, integrator: &str| {
        folder.run(&format!("convert scene.toml -o a.rsp {convert}")).done();
        folder.run(&format!("render a.rsp -o a.exr --size 48x48 --spp 64 --integrator {integrator}")).done();
        let exr = Exr::read(&folder.path("a.exr"));
        ["R", "G", "B"].map(|name| exr.channels[name].iter().sum::<f32>() / (48.0 * 48.0))
    };
    for integrator in ["path", "photon"] {
        let (instances, copies) = (mean("", integrator), mean("--no-instances", integrator));
        for (a, b) in instances.iter().zip(copies) {
            assert!((a - b).abs() < 0.01 * b, "{integrator}: {instances:?} {copies:?}");
        }
    }
}
