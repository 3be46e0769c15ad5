//! Inputs that cannot be read as they are meant: one line that names the file, and nothing left behind.

use crate::models::Mesh;
use crate::support::Folder;
use serde_json::json;

/// Converts one file and expects a line that holds its name and `words`.
#[track_caller]
fn refused(name: &str, content: impl AsRef<[u8]>, words: &[&str]) {
    let folder = Folder::new();
    folder.write(name, content);
    folder.write("out/other", "stays");
    let outcome = folder.run_args(&["convert", name, "-o", "out/a.rsp"]);
    outcome.failed(&[&[name], words].concat());
    assert_eq!(folder.names("out"), ["other"]);
}

#[test]
fn broken_obj() {
    refused("a.obj", "v 0 0 0\nv 1 0 zero\nv 0 1 0\nf 1 2 3\n", &["line 2", "zero"]);
    refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", &["line 4", "4"]);
    refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", &["line 4", "-4"]);
    refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", &["no triangles"]);
    refused("a.obj", "", &["no triangles"]);
    refused("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", &["area"]);
    refused("a.obj", "v nan 0 0\nv 1 0 0\nv 2 0 1\nf 1 2 3\n", &["not finite"]);
}

#[test]
fn broken_ply() {
    let ply = Mesh::cuboid([1.0; 3]).ply();
    refused("a.ply", &ply[..ply.len() - 1], &[]);
    refused("a.ply", &ply[..100], &[]);
    refused("a.ply", "ply\nformat binary_middle_endian 1.0\nend_header\n", &["line 2"]);
    let mut wild = ply.clone();
    let last = wild.len() - 4;
    wild[last..].copy_from_slice(&77u32.to_le_bytes());
    refused("a.ply", &wild, &["77"]);
    let text = String::from_utf8_lossy(&ply).replace("element face 12", "element face 4000000000000");
    refused("a.ply", text, &[]);
}

#[test]
fn broken_gltf() {
    let glb = Mesh::cuboid([1.0; 3]).glb(json!({}), &[], json!({}));
    refused("a.glb", &glb[..glb.len() - 1], &[]);
    refused("a.glb", &glb[..16], &[]);
    refused("a.gltf", "{\"asset\": {\"version\": \"2.0\"}", &[]);
    let elsewhere =
        Mesh::cuboid([1.0; 3]).glb(json!({}), &[], json!({"buffers": [{"byteLength": 240, "uri": "b.bin"}]}));
    refused("a.glb", elsewhere, &["b.bin"]);
    let outside = Mesh::cuboid([1.0; 3]).glb(
        json!({}),
        &[],
        json!({"buffers": [{"byteLength": 240, "uri": "../../b.bin"}]}),
    );
    refused("a.glb", outside, &["../../b.bin"]);
}

#[test]
fn broken_scene_files() {
    refused("scene.toml", "[[model]]\nfile = \n", &["line 2"]);
    refused("scene.toml", "[camera]\nposition = [0, 0, 0]\ntarget = [0, 0, 1]\n", &["[[model]]"]);
    refused("scene.toml", "[[model]]\nfile = 'a.obj'\ncolour = 'red'\n", &["colour"]);
    let folder = Folder::new();
    folder.write("scene.toml", "[[model]]\nfile = 'gone.obj'\n");
    folder.run("convert scene.toml -o a.rsp").failed(&["gone.obj"]);
}

#[test]
fn no_model_at_all() {
    refused("a.stl", "solid a\nendsolid a\n", &[".obj"]);
    refused("a.ply.gz", "\x1f\u{8b}", &["decompress"]);
    let folder = Folder::new();
    folder.write("folder.obj/a", "");
    folder.write("line\nbreak.obj", "");
    folder.run_args(&["convert", "line\nbreak.obj", "-o", "a.rsp"]).failed(&["line break.obj"]);
    folder.run("convert missing.obj -o a.rsp").failed(&["missing.obj"]);
    folder.run("convert folder.obj -o a.rsp").failed(&["folder.obj"]);
    folder.run("render missing.obj -o a.png").failed(&["missing.obj"]);
}
