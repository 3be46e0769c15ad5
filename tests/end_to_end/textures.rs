//! Textures, normals and colors of vertices, from files to pictures.

use crate::pictures::Exr;
use crate::support::Folder;
use serde_json::{Value, json};

/// Codes of the four quarters of [`quarters`]: upper left, upper right, lower left, lower right.
const QUARTERS: [[u8; 4]; 4] = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [188, 188, 188, 0]];

/// A square PNG of four colors, of which the last one is transparent.
pub fn quarters(side: u32) -> Vec<u8> {
    image(side, |x, y| QUARTERS[(y * 2 / side * 2 + x * 2 / side) as usize])
}

/// A square PNG.
fn image(side: u32, texel: impl Fn(u32, u32) -> [u8; 4] + Copy) -> Vec<u8> {
    let texels = (0..side).flat_map(|y| (0..side).flat_map(move |x| texel(x, y)));
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&texels.collect::<Vec<u8>>()).unwrap();
    writer.finish().unwrap();
    bytes
}

/// A square of side 2 on the ground, seen from above with -z upwards.
const SQUARE: &str = "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                      usemtl a\nf 1/1 2/2 3/3 4/4\n";
const FROM_ABOVE: &str = "[camera]\nposition = [0.0, 20.0, 0.0]\ntarget = [0.0, 0.0, 0.0]\nup = [0.0, 0.0, -1.0]\n\
                          vertical_fov_degrees = 5.7\n[sky]\ncolor = [1.0, 1.0, 1.0]\n";

/// Albedo in the middle of the four quarters of a picture.
fn albedo(folder: &Folder, arguments: &str) -> [[f32; 3]; 4] {
    folder.run(&format!("render {arguments} -o a.exr --size 64x64 --spp 4 --bounces 1")).done();
    let exr = Exr::read(&folder.path("a.exr"));
    let at = |column: usize, row: usize| {
        ["albedo.R", "albedo.G", "albedo.B"].map(|name| exr.channels[name][row * 64 + column])
    };
    [at(16, 16), at(48, 16), at(16, 48), at(48, 48)]
}

#[track_caller]
fn assert_quarters(found: [[f32; 3]; 4], expected: [[f32; 3]; 4]) {
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 0.01, "{found} instead of {expected}");
    }
}

/// What [`QUARTERS`] are in linear light.
const COLORS: [[f32; 3]; 4] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.503, 0.503, 0.503]];

fn scene(folder: &Folder, model: &str) {
    folder.write("scene.toml", format!("{FROM_ABOVE}[[model]]\nfile = \"{model}\"\n"));
}

#[test]
fn the_first_row_of_a_texture_is_up_in_obj() {
    let folder = Folder::new();
    folder.write("a.obj", SQUARE);
    folder.write("a.png", quarters(128));
    folder.write("a.mtl", "newmtl a\nKd 1 1 1\nmap_Kd a.png\n");
    scene(&folder, "a.obj");
    let outcome = folder.run("convert scene.toml -o a.rsp").done();
    assert!(!outcome.stderr.contains("warning"), "{outcome:#?}");
    assert_quarters(albedo(&folder, "a.rsp"), COLORS);
    // In little memory, and without what is left out on demand.
    assert_quarters(albedo(&folder, "a.rsp --reorder queues"), COLORS);
    folder.run("convert scene.toml -o bare.rsp --bare").done();
    let bare = folder.run("info bare.rsp --json").json();
    let full = folder.run("info a.rsp --json").json();
    assert!(bare["bytes"]["attributes"] == 0 && bare["bytes"]["textures"] == 0, "{bare}");
    assert!(
        full["bytes"]["attributes"].as_u64() > Some(40) && full["bytes"]["textures"].as_u64() > Some(500)
    );
    assert_eq!(bare["bytes_per_triangle"], full["bytes_per_triangle"]);
}

/// The square of [`SQUARE`] as a.gltf, with one texture of an image. Corners are of the colors red, green, blue and white where
/// these are wanted.
struct Gltf<'a> {
    image: &'a [u8],
    texture: Value,
    material: Value,
    has_colors: bool,
    /// Of all corners, with their normals.
    tangent: Option<[f32; 4]>,
}

impl Gltf<'_> {
    fn write(&self, folder: &Folder) {
        let corners: [([f32; 3], [f32; 2], [f32; 3]); 4] = [
            ([-1.0, 0.0, 1.0], [0.0, 1.0], [0.0, 0.0, 1.0]),
            ([1.0, 0.0, 1.0], [1.0, 1.0], [1.0, 1.0, 1.0]),
            ([1.0, 0.0, -1.0], [1.0, 0.0], [0.0, 1.0, 0.0]),
            ([-1.0, 0.0, -1.0], [0.0, 0.0], [1.0, 0.0, 0.0]),
        ];
        let mut binary: Vec<u8> = corners.iter().flat_map(|c| c.0).flat_map(f32::to_le_bytes).collect();
        binary.extend(corners.iter().flat_map(|c| c.1).flat_map(f32::to_le_bytes));
        binary.extend(corners.iter().flat_map(|c| c.2).flat_map(f32::to_le_bytes));
        binary.extend([[0.0f32, 1.0, 0.0]; 4].as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        let tangents = [self.tangent.unwrap_or_default(); 4];
        binary.extend(tangents.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        binary.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
        binary.extend(self.image);
        folder.write("a.bin", &binary);
        let mut attributes = json!({"POSITION": 0, "TEXCOORD_0": 1});
        if self.has_colors {
            attributes["COLOR_0"] = json!(2);
        }
        if self.tangent.is_some() {
            (attributes["NORMAL"], attributes["TANGENT"]) = (json!(4), json!(5));
        }
        let document = json!({
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": attributes, "indices": 3, "material": 0}]}],
            "materials": [self.material],
            "textures": [self.texture],
            "images": [{"bufferView": 4, "mimeType": "image/png"}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC3"},
                {"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"},
                {"bufferView": 5, "componentType": 5126, "count": 4, "type": "VEC3"},
                {"bufferView": 6, "componentType": 5126, "count": 4, "type": "VEC4"}
            ],
            "bufferViews": [
                {"buffer": 0, "byteLength": 48},
                {"buffer": 0, "byteOffset": 48, "byteLength": 32},
                {"buffer": 0, "byteOffset": 80, "byteLength": 48},
                {"buffer": 0, "byteOffset": 240, "byteLength": 12},
                {"buffer": 0, "byteOffset": 252, "byteLength": self.image.len()},
                {"buffer": 0, "byteOffset": 128, "byteLength": 48},
                {"buffer": 0, "byteOffset": 176, "byteLength": 64}
            ],
            "buffers": [{"byteLength": binary.len(), "uri": "a.bin"}]
        });
        folder.write("a.gltf", document.to_string());
        scene(folder, "a.gltf");
    }
}

#[test]
fn the_first_row_of_a_texture_is_where_v_is_0_in_gltf() {
    let folder = Folder::new();
    let image = quarters(64);
    let write = |image: &[u8], texture: Value, info: Value| {
        let material = json!({"pbrMetallicRoughness": {"baseColorTexture": info, "metallicFactor": 0.0}});
        Gltf { image, texture, material, has_colors: false, tangent: None }.write(&folder);
    };
    write(&image, json!({"source": 0}), json!({"index": 0}));
    assert_quarters(albedo(&folder, "scene.toml --cache cache"), COLORS);

    // Moved by half of its width: the left and the right half change their places.
    let moved = json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.0]}}});
    write(&image, json!({"source": 0}), moved);
    let [a, b, c, d] = COLORS;
    assert_quarters(albedo(&folder, "scene.toml --cache cache"), [b, a, d, c]);

    // One clear line each, and a picture without the texture.
    for (texture, what) in [(json!({"source": 7}), "is not there"), (json!({}), "names no image")] {
        write(&image, texture, json!({"index": 0}));
        let outcome = folder.run("convert a.gltf -o b.rsp").done_with_notes();
        assert!(outcome.stderr.contains("textures[0]") && outcome.stderr.contains(what), "{outcome:#?}");
    }
}

/// An image that cannot be read takes away what it says, and is not white.
#[test]
fn damaged_textures_are_left_out() {
    let folder = Folder::new();
    let mut image = quarters(64);
    image[60..].fill(0);
    let info = json!({"index": 0});
    let material = json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicRoughnessTexture": info},
        "normalTexture": info, "emissiveTexture": info, "emissiveFactor": [9, 9, 9]
    });
    Gltf { image: &image, texture: json!({"source": 0}), material, has_colors: false, tangent: None }
        .write(&folder);
    let outcome = folder.run("render scene.toml -o a.exr --cache cache --size 16x16 --spp 64 --bounces 1");
    assert!(outcome.done_with_notes().stderr.contains("materials are without it"));
    let exr = Exr::read(&folder.path("a.exr"));
    // White would glow, be a metal, and lean.
    let normal = ["normal.X", "normal.Y", "normal.Z"].map(|name| exr.channels[name][8 * 16 + 8]);
    assert!((normal[1] - 1.0).abs() < 1e-3, "{normal:?}");
    let [light, ..] = exr.rgb(8, 8);
    assert!((light - 0.5).abs() < 0.05, "{light}");
}

#[test]
fn unlit_surfaces_are_of_the_color_of_their_texture_and_vertices() {
    let folder = Folder::new();
    let image = image(4, |_, _| [188, 188, 188, 255]);
    let material = json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 1, 0.5, 1]},
        "extensions": {"KHR_materials_unlit": {}}
    });
    Gltf { image: &image, texture: json!({"source": 0}), material, has_colors: true, tangent: None }
        .write(&folder);
    folder.run("render scene.toml -o a.exr --cache cache --size 64x64 --spp 1").done();
    let exr = Exr::read(&folder.path("a.exr"));
    for (place, of_vertices) in [((0, 0), [1.0, 0.0, 0.0]), ((63, 63), [1.0, 1.0, 1.0])] {
        let found = exr.rgb(place.0, place.1);
        for (channel, factor) in [0.503, 0.503, 0.2515].into_iter().enumerate() {
            assert!((found[channel] - factor * of_vertices[channel]).abs() < 0.03, "{found:?}");
        }
    }
}

#[test]
fn slopes_lean_along_tangents_where_a_file_has_them() {
    let folder = Folder::new();
    // To the right of the image.
    let image = image(4, |_, _| [218, 128, 218, 255]);
    let lean = |tangent, node: Value| {
        let material =
            json!({"normalTexture": {"index": 0}, "pbrMetallicRoughness": {"metallicFactor": 0.0}});
        Gltf { image: &image, texture: json!({"source": 0}), material, has_colors: false, tangent }
            .write(&folder);
        let mut document: Value = serde_json::from_slice(&folder.read("a.gltf")).unwrap();
        document["nodes"] = json!([node]);
        folder.write("a.gltf", document.to_string());
        folder.run("render scene.toml -o a.exr --cache cache --size 16x16 --spp 1").done();
        let exr = Exr::read(&folder.path("a.exr"));
        ["normal.X", "normal.Y", "normal.Z"].map(|name| exr.channels[name][8 * 16 + 8])
    };
    let half = 0.5f32.sqrt();
    let plain = json!({"mesh": 0});
    let mirrored = json!({"mesh": 0, "scale": [-1, 1, 1]});
    for (tangent, node, expected) in [
        (None, &plain, [half, half, 0.0]),
        (Some([1.0, 0.0, 0.0, 1.0]), &plain, [half, half, 0.0]),
        (Some([0.6, 0.0, 0.8, 1.0]), &plain, [0.6 * half, half, 0.8 * half]),
        (Some([0.6, 0.0, 0.8, 1.0]), &mirrored, [-0.6 * half, half, 0.8 * half]),
    ] {
        let found = lean(tangent, node.clone());
        let is_close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.01);
        assert!(is_close, "{tangent:?} {node}: {found:?} instead of {expected:?}");
    }
}

/// Far away a mean of what is cut out and what is left would be all there, or all gone.
#[test]
fn masks_are_cut_out_at_any_distance() {
    let folder = Folder::new();
    let image = image(256, |x, y| [255, 255, 255, if x % 2 == 0 && y % 2 == 0 { 0 } else { 255 }]);
    let material = json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0},
        "alphaMode": "MASK", "alphaCutoff": 0.5, "emissiveFactor": [1, 1, 1]
    });
    Gltf { image: &image, texture: json!({"source": 0}), material, has_colors: false, tangent: None }
        .write(&folder);
    let black_sky = FROM_ABOVE.replace("color = [1.0, 1.0, 1.0]", "color = [0.0, 0.0, 0.0]");
    folder.write("scene.toml", format!("{black_sky}[[model]]\nfile = \"a.gltf\"\n"));
    folder.run("render scene.toml -o a.exr --cache cache --size 8x8 --spp 256 --bounces 0").done();
    let exr = Exr::read(&folder.path("a.exr"));
    let all: f64 = (0..64).map(|i| exr.rgb(i % 8, i / 8)[0]).sum();
    // Between texels, a quarter of which are clear, opacity is x + y - x y: at least a half but for a part of (1 - ln 2) / 2.
    let share = 1.0 - (1.0 - f64::ln(2.0)) / 2.0;
    assert!((all / 64.0 - share).abs() < 0.01, "{} instead of {share}", all / 64.0);
}

#[test]
fn light_falls_through_what_a_texture_cuts_out() {
    let folder = Folder::new();
    folder.write("a.obj", SQUARE);
    folder.write("a.png", quarters(64));
    folder.write("a.mtl", "newmtl a\nKd 0 0 0\nmap_Kd a.png\nmap_d a.png\n");
    folder.write("floor.obj", "v -9 -1 9\nv 9 -1 9\nv 9 -1 -9\nv -9 -1 -9\nf 1 2 3 4\n");
    // Along the diagonal, so that shadows lie beside what casts them: two units to the right.
    let scene = "[camera]\nposition = [2.0, 20.0, 0.0]\ntarget = [2.0, 0.0, 0.0]\nup = [0.0, 0.0, -1.0]\n\
                 vertical_fov_degrees = 5.7\n\
                 [[light]]\ntype = \"directional\"\ndirection = [2.0, -1.0, 0.0]\nintensity = [1.0, 1.0, 1.0]\n\
                 [[model]]\nfile = \"a.obj\"\n[[model]]\nfile = \"floor.obj\"\n";
    folder.write("scene.toml", scene);
    folder.run("render scene.toml -o a.exr --cache cache --size 64x64 --spp 16 --bounces 1").done();
    let exr = Exr::read(&folder.path("a.exr"));
    let [upper_left, upper_right, lower_left, lower_right] =
        [(16, 16), (48, 16), (16, 48), (48, 48)].map(|(x, y)| exr.rgb(x, y)[0]);
    assert_eq!([upper_left, upper_right, lower_left], [0.0; 3], "in the shadow");
    let lit = 0.8 / std::f64::consts::PI / 5f64.sqrt();
    assert!((lower_right - lit).abs() < 0.01 * lit, "{lower_right} instead of {lit}");
}

#[test]
fn slopes_of_a_texture_lean_to_its_right_and_upwards() {
    let folder = Folder::new();
    folder.write("a.obj", SQUARE);
    folder.write("a.mtl", "newmtl a\nKd 0.5 0.5 0.5\nnorm a.png\n");
    scene(&folder, "a.obj");
    // A quarter leans to the right, which is +x, one upwards, which is -z, one both ways; the last one not at all.
    let [flat, steep] = [128, 218];
    folder.write(
        "a.png",
        image(32, |x, y| [if x < 16 { steep } else { flat }, if y < 16 { steep } else { flat }, steep, 255]),
    );
    folder.run("render scene.toml -o a.exr --cache cache --size 64x64 --spp 4 --bounces 1").done();
    let exr = Exr::read(&folder.path("a.exr"));
    let side = 0.5f32.sqrt();
    let both = (1.0f32 / 3.0).sqrt();
    for (place, expected) in [
        ((48, 16), [0.0, side, -side]),
        ((16, 48), [side, side, 0.0]),
        ((16, 16), [both, both, -both]),
        ((48, 48), [0.0, 1.0, 0.0]),
    ] {
        let (column, row) = place;
        let found = ["normal.X", "normal.Y", "normal.Z"].map(|name| exr.channels[name][row * 64 + column]);
        let is_near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 0.02);
        assert!(is_near, "{place:?}: {found:?} instead of {expected:?}");
    }
}

#[test]
fn normals_of_corners_make_a_flat_thing_round() {
    let folder = Folder::new();
    // The normals lean outwards; the one of the last vertex is broken, and no normal.
    let text = "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvn -1 1 0\nvn 1 1 0\nf 1//1 2//2 3//2 4//1\n";
    folder.write("a.obj", text);
    scene(&folder, "a.obj");
    folder.run("render scene.toml -o a.exr --cache cache --size 64x64 --spp 4 --bounces 1").done();
    let exr = Exr::read(&folder.path("a.exr"));
    let normal =
        |column: usize| ["normal.X", "normal.Y", "normal.Z"].map(|name| exr.channels[name][32 * 64 + column]);
    let [x, y, z] = normal(2);
    assert!((x + y).abs() < 0.1 && y > 0.6 && z.abs() < 1e-3, "{x} {y} {z}");
    assert!(normal(32)[1] > 0.99 && normal(61)[0] > 0.6);
}
