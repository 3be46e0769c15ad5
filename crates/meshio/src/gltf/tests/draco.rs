//! Primitives that Draco has compressed.

use super::{SQUARE, document, glb, square_bytes, triangles};
use crate::testing::{Collect, import_bytes, import_path, write_file};
use crate::{Import, ImportError, ImportOptions};
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute, PointIndex,
};
use serde_json::{Value, json};

/// A mesh of these positions and triangles, compressed one triangle after the other, or along their edges.
fn compressed(positions: &[u8], faces: &[[u32; 3]], along_edges: bool) -> Vec<u8> {
    let count = positions.len() / 12;
    let mut mesh = Mesh::new();
    mesh.set_num_points(count);
    let mut attribute = PointAttribute::new();
    attribute.init(GeometryAttributeType::Position, 3, DataType::Float32, false, count);
    attribute.buffer_mut().update(positions, Some(0));
    mesh.add_attribute(attribute);
    for (i, face) in (0..).zip(faces) {
        mesh.set_face(FaceIndex(i), face.map(PointIndex));
    }
    let (mut encoder, mut bytes) = (MeshEncoder::new(), EncoderBuffer::new());
    encoder.set_mesh(mesh);
    let mut options = EncoderOptions::new();
    options.set_encoding_method(along_edges.into());
    encoder.encode(&options, &mut bytes).unwrap();
    bytes.data().to_vec()
}

fn square(along_edges: bool) -> Vec<u8> {
    compressed(&square_bytes()[..48], &[[0, 1, 2], [0, 2, 3]], along_edges)
}

/// A document whose only primitive is compressed into `length` bytes.
fn compressed_document(length: usize) -> Value {
    let mut document = document();
    for accessor in document["accessors"].as_array_mut().unwrap() {
        accessor.as_object_mut().unwrap().remove("bufferView");
    }
    document["buffers"] = json!([{"byteLength": length}]);
    document["bufferViews"] = json!([{"buffer": 0, "byteLength": length}]);
    document["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    document["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    document["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
    document
}

fn read(bytes: &[u8], change: impl FnOnce(&mut Value)) -> Result<(Import, Collect), ImportError> {
    let mut document = compressed_document(bytes.len());
    change(&mut document["meshes"][0]["primitives"][0]);
    import_bytes("model.glb", &glb(&document, bytes))
}

#[test]
fn primitives_are_read_however_they_are_compressed() {
    for along_edges in [false, true] {
        let (_, sink) = read(&square(along_edges), |_| ()).unwrap();
        // The codec may begin triangles with another corner, and list them in another order.
        let from_least = |mut triangle: [[f64; 3]; 3]| {
            let least = (0..3).min_by(|&a, &b| triangle[a].partial_cmp(&triangle[b]).unwrap()).unwrap();
            triangle.rotate_left(least);
            triangle
        };
        let mut found: Vec<_> = triangles(&sink).into_iter().map(from_least).collect();
        found.sort_by(|a, b| a[1][1].total_cmp(&b[1][1]));
        assert_eq!(found, SQUARE, "{along_edges}");
    }
}

#[test]
fn compressed_primitives_without_positions_are_refused() {
    let bytes = square(false);
    let wrong = |change: fn(&mut Value)| read(&bytes, change).unwrap_err().to_string();
    let error = wrong(|primitive| primitive["attributes"] = json!({}));
    assert!(error.contains("primitives[0].attributes.POSITION"), "{error}");
    let in_extension = |change: fn(&mut Value)| {
        let extension = |p: &mut Value| change(&mut p["extensions"]["KHR_draco_mesh_compression"]);
        read(&bytes, extension).unwrap_err().to_string()
    };
    let error = in_extension(|extension| extension["attributes"] = json!({}));
    assert!(error.contains("KHR_draco_mesh_compression.attributes.POSITION: is not there"), "{error}");
    let error = in_extension(|extension| extension["attributes"]["POSITION"] = json!(9));
    assert!(error.contains("no attribute 9"), "{error}");
    let error = in_extension(|extension| extension["bufferView"] = json!(7));
    assert!(error.contains("primitives[0]"), "{error}");
}

#[test]
fn damage_costs_one_line() {
    for along_edges in [false, true] {
        let bytes = square(along_edges);
        for i in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[i] ^= 0x55;
            let _ = read(&damaged, |_| ());
            assert!(read(&bytes[..i], |_| ()).is_err(), "{i}");
        }
    }
}

#[test]
fn meshes_that_take_too_much_memory_are_refused() {
    // A fan whose corners are all the same: few bytes, many triangles.
    let faces = vec![[0, 1, 2]; 600_000];
    let bytes = compressed(&[0; 36], &faces, false);
    let (_dir, path) = write_file("model.glb", &glb(&compressed_document(bytes.len()), &bytes));
    let with = |kept_bytes| import_path(&path, &ImportOptions { kept_bytes, ..ImportOptions::default() });
    let error = with(0).unwrap_err().to_string();
    assert!(error.contains("128 MiB") && error.contains("give more memory"), "{error}");
    assert!(with(1 << 30).is_ok());
}
