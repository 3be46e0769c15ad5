//! glTF files as people have them: good, odd and hostile.

mod draco;
mod layers;

use crate::testing::{Collect, import_all_prefixes, import_bytes, import_path, write_file};
use crate::{Import, ImportError, ImportOptions};
use crate::{Survey, survey};
use raystrips_geom::scene::{LightKind, Projection};
use serde_json::{Value, json};
use std::f64::consts::FRAC_1_SQRT_2;

/// Positions of a unit square, then the indices of its two triangles.
fn square_bytes() -> Vec<u8> {
    let corners = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes = corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

fn document() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12}
        ],
        "buffers": [{"byteLength": 60}]
    })
}

fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let chunk = |kind: &[u8], data: &[u8]| [&(data.len() as u32).to_le_bytes(), kind, data].concat();
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", binary)].concat();
    [b"glTF\x02\0\0\0", &(chunks.len() as u32 + 12).to_le_bytes()[..], &chunks].concat()
}

/// Imports the square after `change`.
fn read(change: impl FnOnce(&mut Value, &mut Vec<u8>)) -> Result<(Import, Collect), ImportError> {
    let (mut document, mut binary) = (document(), square_bytes());
    change(&mut document, &mut binary);
    import_bytes("model.glb", &glb(&document, &binary))
}

const SQUARE: [[[f64; 3]; 3]; 2] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
];

fn triangles(sink: &Collect) -> Vec<[[f64; 3]; 3]> {
    sink.triangles().into_iter().map(|(_, triangle)| triangle).collect()
}

#[test]
fn a_square_in_a_binary_file() {
    let (done, sink) = read(|_, _| ()).unwrap();
    assert_eq!(triangles(&sink), SQUARE);
    assert_eq!(done.scene.materials[0].metallic, 1.0);
    assert!(done.report.warnings.is_empty());
}

#[test]
fn buffers_beside_and_inside_the_json() {
    let mut document = document();
    document["buffers"][0]["uri"] = json!("a%20b.bin");
    let (dir, path) = write_file("model.gltf", format!("\u{feff}{document}").as_bytes());
    let missing = import_path(&path, &ImportOptions::default()).unwrap_err().to_string();
    assert!(missing.contains("buffers[0]") && missing.contains("a%20b.bin"), "{missing}");
    std::fs::write(dir.path().join("a b.bin"), square_bytes()).unwrap();
    assert_eq!(triangles(&import_path(&path, &ImportOptions::default()).unwrap().1), SQUARE);

    document["buffers"] = json!([{"byteLength": 12, "uri": "data:application/octet-stream;base64,AAABAAIAAAACAAMA"}, {
        "byteLength": 48, "uri": "a b.bin"
    }]);
    document["bufferViews"] = json!([{"buffer": 1, "byteLength": 48}, {"buffer": 0, "byteLength": 12}]);
    std::fs::write(&path, document.to_string()).unwrap();
    assert_eq!(triangles(&import_path(&path, &ImportOptions::default()).unwrap().1), SQUARE);
}

#[test]
fn buffers_elsewhere_are_refused() {
    for uri in ["../a.bin", "/dev/zero", "https://host/a.bin", "%2e%2e/a.bin", "data:text/plain,abc"] {
        let error = read(|document, _| document["buffers"][0]["uri"] = json!(uri)).unwrap_err().to_string();
        assert!(error.contains("buffers[0]"), "{error}");
    }
}

#[test]
fn strips_and_fans_keep_their_winding() {
    for (mode, indices) in [(5, [0u16, 1, 3, 2, 2, 2]), (6, [0, 1, 2, 3, 0, 0])] {
        let (_, sink) = read(|document, binary| {
            document["meshes"][0]["primitives"][0]["mode"] = json!(mode);
            document["accessors"][1]["count"] = json!(4);
            binary.splice(48.., indices.iter().flat_map(|i| i.to_le_bytes()));
        })
        .unwrap();
        for [a, b, c] in triangles(&sink) {
            let turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert_eq!(turn, 1.0, "mode {mode}");
        }
        assert_eq!(sink.triangles().len(), 2);
    }
}

#[test]
fn quantized_interleaved_and_sparse_positions() {
    let (_, sink) = read(|document, binary| {
        // Normalized bytes, four apart, of which the last is replaced.
        *binary = vec![0, 0, 0, 9, 127, 0, 0, 9, 127, 127, 0, 9, 5, 5, 5];
        binary.extend([3, 0, 129, 127, 0]);
        document["accessors"][0] = json!({
            "bufferView": 0, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3",
            "sparse": {
                "count": 1,
                "indices": {"bufferView": 1, "componentType": 5121},
                "values": {"bufferView": 1, "byteOffset": 2}
            }
        });
        document["bufferViews"] = json!([
            {"buffer": 0, "byteLength": 15, "byteStride": 4},
            {"buffer": 0, "byteOffset": 15, "byteLength": 5}
        ]);
        document["buffers"][0]["byteLength"] = json!(20);
        document["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        document["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "mode": 6});
    })
    .unwrap();
    let ([a, b, c], d) = (SQUARE[0], [-1.0, 1.0, 0.0]);
    assert_eq!(triangles(&sink), [[b, c, a], [c, d, a]]);
}

#[test]
fn nodes_multiply_and_mirror() {
    let (done, sink) = read(|document, _| {
        document["scenes"][0]["nodes"] = json!([0, 2]);
        document["nodes"] = json!([
            {"translation": [4500000.25, 0, 0], "scale": [2, 2, 2], "children": [1]},
            {"mesh": 0, "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2]},
            {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]}
        ]);
    })
    .unwrap();
    assert_eq!((done.report.triangles, done.scene.geometries.len()), (4, 1));
    let all = triangles(&sink);
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(near(all[0][1], [4500000.25, 2.0, 0.0]), "{all:?}");
    // Mirrored: the other way round, so that the front stays the front.
    assert_eq!(all[2], [[0.0, 0.0, 5.0], [-1.0, 1.0, 5.0], [-1.0, 0.0, 5.0]]);
}

#[test]
fn cameras_lights_and_materials() {
    let (done, _) = read(|document, _| {
        document["scenes"][0]["nodes"] = json!([0, 1, 2]);
        document["nodes"] = json!([
            {"mesh": 0},
            {"camera": 0, "translation": [0, 0, 3], "scale": [2, 2, 2]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [-FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2]}
        ]);
        document["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 1.5}}]);
        document["extensions"] = json!({"KHR_lights_punctual": {"lights": [
            {"type": "spot", "intensity": 3, "color": [1, 0.5, 0], "spot": {"outerConeAngle": 0.4}}
        ]}});
        document["meshes"][0]["primitives"][0]["material"] = json!(0);
        document["materials"] = json!([{
            "name": "lamp",
            "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 0.5], "metallicFactor": 0, "baseColorTexture": {"index": 0}},
            "emissiveFactor": [1, 1, 0],
            "extensions": {
                "KHR_materials_emissive_strength": {"emissiveStrength": 5},
                "KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_ior": {"ior": 1.33}
            }
        }]);
    })
    .unwrap();
    let camera = &done.scene.cameras[0];
    assert_eq!(
        (camera.position, camera.forward, camera.up),
        ([0.0, 0.0, 3.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0])
    );
    assert_eq!(
        (camera.projection, camera.aspect),
        (Projection::Perspective { vertical_fov: 0.5 }, Some(1.5))
    );
    assert_eq!(done.scene.lights[0].intensity, [3.0, 1.5, 0.0]);
    match done.scene.lights[0].kind {
        LightKind::Spot { direction, outer_angle, .. } => {
            assert!((direction[1] + 1.0).abs() < 1e-6 && outer_angle == 0.4, "{direction:?}");
        }
        ref other => panic!("{other:?}"),
    }
    let material = &done.scene.materials[0];
    assert_eq!((material.alpha, material.emission), (1.0, [5.0, 5.0, 0.0]));
    assert_eq!((material.transmission, material.ior, material.name.as_str()), (1.0, 1.33, "lamp"));
    assert_eq!(done.report.warnings.len(), 1, "{:?}", done.report.warnings);
}

/// Each change, and what the message must say.
#[test]
fn broken_documents_are_named() {
    type Change = fn(&mut Value);
    let changes: [(Change, &str); 18] = [
        (|d| d["asset"]["version"] = json!("1.0"), "asset.version"),
        (|d| *d = json!({"asset": {"version": "1.1"}, "meshes": {}}), "asset.version"),
        (|d| d["meshes"] = json!({}), "line 1"),
        (|d| d["extensionsRequired"] = json!(["ABC_unknown"]), "extensionsRequired[0]"),
        (|d| d["scene"] = json!(7), "scene"),
        (|d| d["scenes"][0]["nodes"] = json!([7]), "scenes[0].nodes[0]"),
        (|d| d["nodes"][0]["children"] = json!([0]), "nodes[0].children[0]"),
        (|d| d["nodes"][0]["mesh"] = json!(7), "nodes[0].mesh"),
        (
            |d| d["nodes"][0]["matrix"] = json!([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]),
            "nodes[0].matrix",
        ),
        (|d| d["meshes"][0]["primitives"][0]["indices"] = json!(7), "meshes[0].primitives[0].indices"),
        (|d| d["meshes"][0]["primitives"][0]["indices"] = json!(0), "accessors[0].type"),
        (|d| d["meshes"][0]["primitives"][0]["material"] = json!(0), "meshes[0].primitives[0].material"),
        (|d| d["meshes"][0]["primitives"][0]["mode"] = json!(9), "meshes[0].primitives[0].mode"),
        (|d| d["accessors"][0]["count"] = json!(u64::MAX), "accessors[0]"),
        (|d| d["accessors"][0]["byteOffset"] = json!(u64::MAX), "accessors[0]"),
        (
            |d| d["accessors"][0] = json!({"componentType": 5126, "count": 1u64 << 32, "type": "VEC3"}),
            "accessors[0]",
        ),
        (|d| d["bufferViews"][0]["byteOffset"] = json!(u64::MAX), "bufferViews[0]"),
        (|d| d["bufferViews"][0]["byteStride"] = json!(4), "accessors[0]"),
    ];
    for (change, place) in changes {
        let error = read(|document, _| change(document)).unwrap_err().to_string();
        assert!(error.contains(place), "{place}: {error}");
    }
    let cut = read(|document, _| document["buffers"][0]["byteLength"] = json!(64)).unwrap_err().to_string();
    assert!(cut.contains("buffers[0]"), "{cut}");
    let points = read(|document, _| document["meshes"][0]["primitives"][0]["mode"] = json!(0)).unwrap_err();
    assert!(matches!(points, ImportError::NoTriangles { .. }));
}

#[test]
fn impossible_indices_are_errors_or_dropped() {
    let mut binary = square_bytes();
    binary[48] = 4;
    let file = glb(&document(), &binary);
    let error = import_bytes("model.glb", &file).unwrap_err().to_string();
    assert!(error.contains("meshes[0].primitives[0].indices: vertex index 4"), "{error}");
    let (_dir, path) = write_file("model.glb", &file);
    let (done, sink) =
        import_path(&path, &ImportOptions { drop_out_of_range: true, ..ImportOptions::default() }).unwrap();
    assert_eq!((done.report.dropped.out_of_range, sink.triangles()), (1, vec![(1, SQUARE[1])]));
}

#[test]
fn deep_trees_do_not_overflow() {
    let (done, _) = read(|document, _| {
        let count = 100_000;
        let mut nodes: Vec<_> = (1..count).map(|i| json!({"children": [i]})).collect();
        nodes.push(json!({"mesh": 0}));
        document["nodes"] = json!(nodes);
    })
    .unwrap();
    assert_eq!(done.report.triangles, 2);
    let nested = format!("{{\"asset\": {{\"version\": \"2.0\"}}, \"extras\": {}", "[".repeat(100_000));
    assert!(import_bytes("model.gltf", nested.as_bytes()).is_err());
}

#[test]
fn every_beginning_of_a_file() {
    import_all_prefixes("model.glb", &glb(&document(), &square_bytes()));
}

#[test]
fn buffers_beyond_four_gibibytes() {
    use std::io::{Seek, SeekFrom, Write};
    let (view, offset) = ((1u64 << 32) + 4, (1u64 << 32) + 8);
    let mut document = document();
    document["buffers"] = json!([{"byteLength": view + offset + 60, "uri": "a.bin"}]);
    document["bufferViews"] = json!([
        {"buffer": 0, "byteOffset": view, "byteLength": offset + 48},
        {"buffer": 0, "byteOffset": view + offset + 48, "byteLength": 12}
    ]);
    document["accessors"][0]["byteOffset"] = json!(offset);
    document["nodes"] = json!([{"mesh": 0, "children": [1]}, {"mesh": 0}]);
    let (dir, path) = write_file("model.gltf", document.to_string().as_bytes());
    let mut file = std::fs::File::create(dir.path().join("a.bin")).unwrap();
    file.seek(SeekFrom::Start(view + offset)).unwrap();
    file.write_all(&square_bytes()).unwrap();
    assert_eq!(
        triangles(&import_path(&path, &ImportOptions::default()).unwrap().1),
        [SQUARE, SQUARE].concat()
    );
    let bytes = document.to_string().len() as u64;
    let expected = Survey {
        bytes,
        triangles: 4,
        vertices: 8,
        instances: 0,
        kept_vertices: 0,
        attributed_vertices: 0,
        is_exact: true,
    };
    assert_eq!(survey(std::slice::from_ref(&path), &ImportOptions::default()).unwrap(), expected);
    file.set_len(view + offset + 59).unwrap();
    assert_eq!(
        survey(std::slice::from_ref(&path), &ImportOptions::default()).unwrap_err().to_string(),
        import_path(&path, &ImportOptions::default()).unwrap_err().to_string()
    );
}

/// Adds an accessor over `values` to the buffer; gives its number.
fn add(document: &mut Value, binary: &mut Vec<u8>, kind: &str, width: usize, values: &[f32]) -> usize {
    let offset = binary.len();
    binary.extend(values.iter().flat_map(|x| x.to_le_bytes()));
    let bytes = binary.len() - offset;
    let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes});
    document["bufferViews"].as_array_mut().unwrap().push(view);
    document["buffers"][0]["byteLength"] = json!(binary.len());
    let view = document["bufferViews"].as_array().unwrap().len() - 1;
    let accessor =
        json!({"bufferView": view, "componentType": 5126, "count": values.len() / width, "type": kind});
    document["accessors"].as_array_mut().unwrap().push(accessor);
    document["accessors"].as_array().unwrap().len() - 1
}

/// The square with its corners moved.
fn moved(by: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<[[f64; 3]; 3]> {
    SQUARE.iter().map(|triangle| triangle.map(&by)).collect()
}

#[test]
fn morph_targets_move_vertices_by_their_weights() {
    let morphed = |weights: fn(&mut Value)| {
        let (_, sink) = read(|document, binary| {
            let up = add(document, binary, "VEC3", 3, &[0.0, 0.0, 2.0].repeat(4));
            let right = add(document, binary, "VEC3", 3, &[1.0, 0.0, 0.0].repeat(4));
            document["meshes"][0]["primitives"][0]["targets"] =
                json!([{"POSITION": up}, {"NORMAL": up}, {"POSITION": right}]);
            weights(document);
        })
        .unwrap();
        triangles(&sink)
    };
    assert_eq!(morphed(|_| {}), SQUARE);
    let of_mesh: fn(&mut Value) = |d| d["meshes"][0]["weights"] = json!([0.5, 1.0, 0.25]);
    assert_eq!(morphed(of_mesh), moved(|[x, y, z]| [x + 0.25, y, z + 1.0]));
    // Those of the node win.
    assert_eq!(
        morphed(|d| {
            d["meshes"][0]["weights"] = json!([0.5, 0.0, 0.0]);
            d["nodes"][0]["weights"] = json!([0.0, 0.0, -1.0]);
        }),
        moved(|[x, y, z]| [x - 1.0, y, z])
    );
}

#[test]
fn joints_put_vertices_where_they_belong() {
    let skinned = |change: fn(&mut Value)| {
        read(|document, binary| {
            let weights = add(document, binary, "VEC4", 4, &[0.75, 0.25, 0.0, 0.0].repeat(4));
            let joints = add(document, binary, "VEC4", 4, &[0.0; 16]);
            // Four bytes for each vertex, in place of floats.
            let offset = binary.len() - 64;
            binary[offset..offset + 16].copy_from_slice(&[0, 1, 0, 0].repeat(4));
            document["accessors"][joints]["componentType"] = json!(5121);
            let matrix =
                |x: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, 0.0, 0.0, 1.0];
            let inverse = add(document, binary, "MAT4", 16, &[matrix(-10.0), matrix(0.0)].concat());
            let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
            (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(joints), json!(weights));
            // Where the node of the mesh stands does not matter; one joint stands where its matrix says, one does not.
            document["nodes"] = json!([
                {"mesh": 0, "skin": 0, "translation": [100.0, 0.0, 0.0]},
                {"translation": [10.0, 0.0, 0.0], "children": [2]},
                {"translation": [0.0, 0.0, 4.0]}
            ]);
            document["scenes"][0]["nodes"] = json!([0, 1]);
            document["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": inverse}]);
            change(document);
        })
    };
    let (done, sink) = skinned(|_| {}).unwrap();
    assert!(done.report.warnings.is_empty(), "{:?}", done.report.warnings);
    assert_eq!(triangles(&sink), moved(|[x, y, z]| [x + 2.5, y, z + 1.0]));
    for (change, place) in [
        ((|d| d["nodes"][0]["skin"] = json!(3)) as fn(&mut Value), "nodes[0].skin"),
        (|d| d["skins"][0]["joints"] = json!([1]), "JOINTS_0"),
        (|d| d["skins"][0]["joints"] = json!([1, 9]), "skins[0].joints[1]"),
        (|d| d["skins"][0]["joints"] = json!([1, 2, 1]), "inverseBindMatrices"),
        (|d| d["skins"][0]["inverseBindMatrices"] = json!(0), "accessors[0].type"),
    ] {
        let error = skinned(change).unwrap_err().to_string();
        assert!(error.contains(place), "{place}: {error}");
    }
}

#[test]
fn a_mesh_is_shown_wherever_its_instances_are() {
    let instanced = |change: fn(&mut Value)| {
        read(|document, binary| {
            let places = add(document, binary, "VEC3", 3, &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
            let scales = add(document, binary, "VEC3", 3, &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
            document["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
            document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] =
                json!({"TRANSLATION": places, "SCALE": scales});
            change(document);
        })
    };
    let (_, sink) = instanced(|_| {}).unwrap();
    let second = moved(|[x, y, z]| [2.0 * x + 5.0, 2.0 * y, 2.0 * z]);
    assert_eq!(triangles(&sink), [SQUARE.to_vec(), second].concat());
    let error = instanced(|d| d["accessors"][3]["count"] = json!(1)).unwrap_err().to_string();
    assert!(error.contains("another number of instances"), "{error}");
    let error = instanced(|d| d["accessors"][2]["count"] = json!(1u64 << 60)).unwrap_err().to_string();
    assert!(error.contains("accessors[2]"), "{error}");
}

#[test]
fn compressed_views_are_read_as_others() {
    use meshoptimizer_rs::codec::{IndexEncoding, VertexEncoding, encode_index_buffer, encode_vertex_buffer};
    use meshoptimizer_rs::{Limits, Workspace};
    let mut workspace = Workspace::new(Limits { max_bytes: 1 << 20, max_work: 1 << 20 });
    let (mut document, plain) = (document(), square_bytes());
    let indices: Vec<u32> = vec![0, 1, 2, 0, 2, 3];
    let positions = encode_vertex_buffer(&plain[..48], 4, 12, VertexEncoding::DEFAULT, &mut workspace);
    let indices = encode_index_buffer(&indices, IndexEncoding::DEFAULT, &mut workspace);
    let (positions, indices) = (positions.unwrap(), indices.unwrap());
    let binary = [&positions[..], &indices[..]].concat();
    for (view, (offset, length, stride, count, mode)) in
        [(0, positions.len(), 12, 4, "ATTRIBUTES"), (positions.len(), indices.len(), 2, 6, "TRIANGLES")]
            .into_iter()
            .enumerate()
    {
        document["bufferViews"][view]["buffer"] = json!(1);
        document["bufferViews"][view]["extensions"]["EXT_meshopt_compression"] = json!({
            "buffer": 0, "byteOffset": offset, "byteLength": length, "byteStride": stride, "count": count,
            "mode": mode
        });
    }
    // The second one stands for what is decoded, and has no bytes.
    document["buffers"] = json!([
        {"byteLength": binary.len()},
        {"byteLength": 60, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}
    ]);
    document["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    let read = |document: &Value, binary: &[u8]| import_bytes("model.glb", &glb(document, binary));
    assert_eq!(triangles(&read(&document, &binary).unwrap().1), SQUARE);
    // Whatever is cut off or changed: a square, another one, or one line.
    for i in 0..binary.len() {
        let mut damaged = binary.clone();
        damaged[i] ^= 0x55;
        let _ = read(&document, &damaged);
        assert!(read(&document, &binary[..i]).is_err());
    }
    let with = |change: fn(&mut Value)| {
        let mut document = document.clone();
        change(&mut document["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]);
        read(&document, &binary).unwrap_err().to_string()
    };
    for (change, what) in [
        ((|e| e["mode"] = json!("HUH")) as fn(&mut Value), "mode"),
        (|e| e["filter"] = json!("HUH"), "filter"),
        (|e| e["byteStride"] = json!(7), "7 bytes"),
        (|e| e["count"] = json!(1u64 << 62), "bufferViews[0]"),
        (|e| e["byteLength"] = json!(3), "bufferViews[0]"),
    ] {
        let error = with(change);
        assert!(error.contains(what), "{what}: {error}");
    }
}
