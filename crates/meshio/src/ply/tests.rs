//! PLY files as people have them: good, odd and hostile.

use crate::testing::{
    Collect, import_all_prefixes, import_bytes, import_path, import_with_any_memory, write_file,
};
use crate::{Import, ImportError, ImportOptions, Place};
use crate::{Survey, survey};
use raystrips_geom::Attributes;

fn read(bytes: &[u8]) -> (Import, Collect) {
    import_bytes("model.ply", bytes).unwrap()
}

fn error(bytes: &[u8]) -> ImportError {
    import_bytes("model.ply", bytes).unwrap_err()
}

const ASCII: &str = "ply\nformat ascii 1.0\ncomment c\nobj_info o\nelement vertex 4\nproperty float x\nproperty float y\n\
    property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

const SQUARE: [[[f64; 3]; 3]; 2] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
];

/// A square in binary, faces before vertices if asked, with things in it that do not matter.
fn binary(big_endian: bool, faces_first: bool) -> Vec<u8> {
    let name = if big_endian { "big" } else { "little" };
    let number =
        |bytes: &[u8]| if big_endian { bytes.iter().rev().copied().collect() } else { bytes.to_vec() };
    let mut vertices = Vec::new();
    for [z, x, y] in [[0.0f32, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]] {
        vertices.push(7);
        vertices.extend(number(&f64::from(z).to_le_bytes()));
        vertices.extend(number(&x.to_le_bytes()));
        vertices.extend(number(&y.to_le_bytes()));
    }
    let mut faces = vec![2, 9, 9, 4];
    for index in [0u16, 1, 2, 3] {
        faces.extend(number(&index.to_le_bytes()));
    }
    faces.push(1);
    let (vertex, face) = (
        "element vertex 4\r\nproperty uchar red\r\nproperty double z\r\nproperty float32 x\r\nproperty float y\r\n",
        "element face 1\r\nproperty list uint8 char flags\r\nproperty list uchar ushort vertex_index\r\nproperty int8 a\r\n",
    );
    let header = |elements: [&str; 3]| {
        format!("ply\r\nformat binary_{name}_endian 1.0\r\n{}end_header\r\n", elements.concat()).into_bytes()
    };
    let other = "element other 2\r\nproperty short s\r\n";
    if faces_first {
        [header([face, other, vertex]), faces, vec![0; 4], vertices].concat()
    } else {
        [header([other, vertex, face]), vec![0; 4], vertices, faces].concat()
    }
}

#[test]
fn all_encodings_hold_the_same_square() {
    let old_mac = ASCII.replace('\n', "\r").into_bytes();
    let windows = ASCII.replace('\n', "\r\n").into_bytes();
    let mut files = vec![ASCII.as_bytes().to_vec(), old_mac, windows];
    files.extend(
        [(false, false), (true, false), (false, true), (true, true)].map(|(big, first)| binary(big, first)),
    );
    for file in files {
        let (_, sink) = read(&file);
        let triangles: Vec<_> = sink.triangles().into_iter().map(|(_, triangle)| triangle).collect();
        assert_eq!(triangles, SQUARE, "{}", String::from_utf8_lossy(&file));
    }
}

#[test]
fn vertices_with_lists_are_read_row_by_row() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty list uchar uchar n\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let mut file = header.as_bytes().to_vec();
    for i in 0..3u8 {
        file.push(i);
        file.extend(vec![255; i.into()]);
        file.extend([f32::from(i), f32::from(i % 2), 0.0].map(f32::to_le_bytes).concat());
    }
    file.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    assert_eq!(read(&file).1.triangles(), [(0, [[0.0; 3], [1.0, 1.0, 0.0], [2.0, 0.0, 0.0]])]);
    import_all_prefixes("model.ply", &file);
}

/// A triangle whose vertices are a code of 188, no color, and half of that code, in text or binary, with rows all alike or not.
fn colored(format: &str, names: [&str; 3], is_float: bool, with_list: bool) -> Vec<u8> {
    let scalar = if is_float { "float" } else { "uchar" };
    let list = if with_list { "property list uchar uchar l\n" } else { "" };
    let colors = names.map(|name| format!("property {scalar} {name}\n")).concat();
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{list}{colors}\
         element face 1\nproperty list uchar uchar vertex_indices\nend_header\n"
    )
    .into_bytes();
    let is_text = format == "ascii";
    for (place, code) in
        [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into_iter().zip([188u8, 0, 94])
    {
        let number = |x: f32| match format {
            "ascii" => format!(" {x}").into_bytes(),
            "binary_big_endian" => x.to_be_bytes().to_vec(),
            _ => x.to_le_bytes().to_vec(),
        };
        let byte = |code: u8| if is_text { format!(" {code}").into_bytes() } else { vec![code] };
        bytes.extend(place.into_iter().flat_map(number));
        bytes.extend(if with_list { byte(0) } else { vec![] });
        for code in [code, code / 2, 255] {
            bytes.extend(if is_float { number(f32::from(code) / 255.0) } else { byte(code) });
        }
    }
    bytes.extend(if is_text { b"\n3 0 1 2\n".to_vec() } else { vec![3, 0, 1, 2] });
    bytes
}

#[test]
fn colors_of_vertices_are_linear_light() {
    let names = [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]];
    for (i, format) in ["ascii", "binary_little_endian", "binary_big_endian"].into_iter().enumerate() {
        for (is_float, with_list) in [(false, false), (false, true), (true, false)] {
            let bytes = colored(format, names[i], is_float, with_list);
            let (done, sink) = read(&bytes);
            let batch = &sink.0[0];
            let color = |vertex: usize| {
                let record = &batch.attributes[vertex * batch.streams.record_bytes()..];
                Attributes::decode(record, batch.streams).color.to_array()
            };
            let close = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-4);
            // The middle of gray is 188 of 255.
            assert!(close(color(0), [0.5029, 0.1119, 1.0, 1.0]), "{format}: {:?}", color(0));
            assert!(close(color(1), [0.0, 0.0, 1.0, 1.0]) && close(color(2), [0.1119, 0.0284, 1.0, 1.0]));
            assert_eq!(done.scene.materials[0].base_color, [1.0; 3]);
        }
    }
    let bare = ImportOptions { bare: true, ..ImportOptions::default() };
    let (_folder, path) = write_file("model.ply", &colored("ascii", names[0], false, false));
    let (done, sink) = import_path(&path, &bare).unwrap();
    assert!(sink.0[0].attributes.is_empty() && done.scene.materials[0].base_color != [1.0; 3]);
    assert_eq!(survey(&[path], &bare).unwrap().attributed_vertices, 0);
}

#[test]
fn strips_turn_every_other_triangle() {
    let text = ASCII.replace("face", "tristrips").replace("\n4 0 1 2 3", "\n9 0 1 3 2 -1 0 1 1 2");
    let (_, sink) = read(text.as_bytes());
    let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(sink.triangles(), [(0, [a, b, d]), (1, [d, b, c])]);
}

#[test]
fn every_beginning_of_a_file() {
    import_all_prefixes("model.ply", ASCII.trim_end().as_bytes());
    for (big_endian, faces_first) in [(false, false), (true, true)] {
        import_all_prefixes("model.ply", &binary(big_endian, faces_first));
    }
}

#[test]
fn huge_counts_are_refused_at_once() {
    for count in ["1152921504606846976", "18446744073709551615", "5"] {
        for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
            for element in ["vertex 4", "face 1"] {
                let name = element.split(' ').next().unwrap();
                let text = ASCII.replace("ascii", encoding).replace(element, &format!("{name} {count}"));
                assert!(matches!(error(text.as_bytes()), ImportError::Syntax { .. }));
            }
        }
    }
    // An element without properties has no bytes to compare with.
    let text = ASCII.replace("element face", "element nothing 18446744073709551615\nelement face");
    assert_eq!(read(text.as_bytes()).0.report.triangles, 2);
    let list = ASCII.replace("uchar int", "uint int").replace("\n4 0", "\n4294967295 0");
    assert!(matches!(error(list.as_bytes()), ImportError::Syntax { .. }));
}

#[test]
fn impossible_indices_are_errors_or_dropped() {
    for index in ["-1", "4", "4294967296"] {
        let text = ASCII.replace("\n4 0 1 2 3", &format!("\n4 0 1 2 {index}")).replace("face 1", "face 2")
            + "3 0 1 2";
        let ImportError::IndexOutOfRange { place: Place::Line(15), index: found, .. } =
            error(text.as_bytes())
        else {
            panic!("{index}");
        };
        assert_eq!(found.to_string(), index);
        let (_dir, path) = write_file("model.ply", text.as_bytes());
        let (done, sink) =
            import_path(&path, &ImportOptions { drop_out_of_range: true, ..ImportOptions::default() })
                .unwrap();
        assert_eq!(done.report.dropped.out_of_range, 2);
        assert_eq!(sink.triangles()[0].0, 2);
    }
}

#[test]
fn faces_of_a_million_corners_are_refused() {
    let corners = (1 << 20) + 1;
    let list = ASCII.replace("uchar int", "uint int").replace("\n4 0 1 2 3", &format!("\n{corners}"));
    let text = list + &" 0".repeat(corners);
    let error = error(text.as_bytes());
    assert!(matches!(error, ImportError::Unsupported { place: Place::Line(16), .. }), "{error}");
}

#[test]
fn broken_headers_are_named() {
    for (from, to) in [
        ("ply", "plx"),
        ("format ascii 1.0\n", ""),
        ("ascii", "utf8"),
        ("1.0", "2.0"),
        ("element vertex 4\n", ""),
        ("vertex 4", "vertex -4"),
        ("float x", "float16 x"),
        ("float x", "float w"),
        ("list uchar", "list float"),
        ("vertex_indices", "something"),
        ("end_header", "end"),
        ("0 0 0 1", "0 a 0 1"),
        ("4 0 1", "-4 0 1"),
        ("element face", "element vertex"),
    ] {
        let error = error(ASCII.replacen(from, to, 1).as_bytes());
        assert!(matches!(error, ImportError::Syntax { .. }), "{from} -> {to}: {error}");
    }
    let points = ASCII.replace("face 1", "face 0").replace("4 0 1 2 3\n", "");
    assert!(matches!(error(points.as_bytes()), ImportError::NoTriangles { .. }));
}

#[test]
fn memory_changes_nothing() {
    use std::fmt::Write;
    let count = 1_100_000u32;
    let (vertices, faces) = (format!("vertex {count}"), format!("face {}", count / 3));
    let mut text = ASCII.replace("vertex 4", &vertices).replace("face 1", &faces);
    text.truncate(text.find("end_header\n").unwrap() + "end_header\n".len());
    (0..count).for_each(|i| writeln!(text, "{i} 0 0.{i}").unwrap());
    (0..count / 3).for_each(|i| writeln!(text, "3 {i} {} {}", 2 * i, 3 * i).unwrap());
    let triangles = import_with_any_memory("model.ply", text.as_bytes());
    assert_eq!(triangles.len() as u32, count / 3);
    for (id, triangle) in triangles {
        assert_eq!(triangle.map(|corner| corner[0]), [1.0, 2.0, 3.0].map(|i| i * id as f64));
    }
}

#[test]
fn files_beyond_four_gibibytes() {
    use std::io::{Seek, SeekFrom, Write};
    let count = 400_000_000u32;
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
         property float z\nelement face 1\nproperty list uchar uint vertex_indices\nend_header\n"
    );
    let (_dir, path) = write_file("model.ply", header.as_bytes());
    let mut file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
    let end = header.len() as u64 + 12 * u64::from(count);
    file.seek(SeekFrom::Start(end - 24)).unwrap();
    file.write_all(&[1.0f32, 0.0, 0.0, 1.0, 1.0, 0.0].map(f32::to_le_bytes).concat()).unwrap();
    file.write_all(&[&[3][..], &[0, count - 2, count - 1].map(u32::to_le_bytes).concat()].concat()).unwrap();
    let (_, sink) = import_path(&path, &ImportOptions::default()).unwrap();
    assert_eq!(sink.triangles(), [(0, SQUARE[0])]);
    let expected = Survey {
        instances: 0,
        bytes: end + 13,
        triangles: 1,
        vertices: count.into(),
        kept_vertices: 0,
        attributed_vertices: 0,
        is_exact: true,
    };
    assert_eq!(survey(&[path], &ImportOptions::default()).unwrap(), expected);
}

#[test]
fn vertices_without_order_in_little_memory() {
    // Of these twenty megabytes four are in memory at a time.
    let count = 2_000_000u32;
    let mut file =
        ASCII.replace("ascii", "binary_little_endian").replace("vertex 4", &format!("vertex {count}"));
    file = file.replace("face 1", "face 100000").replace("uchar int", "uchar uint");
    file.truncate(file.find("0 0 0 1").unwrap());
    let mut file = file.into_bytes();
    (0..count).for_each(|i| file.extend([i as f32, 0.5, (count - i) as f32].map(f32::to_le_bytes).concat()));
    let corners = |i: u32| [0, 1, 2].map(|corner| (3 * i + corner).wrapping_mul(0x9e37_79b1) % count);
    (0..100_000).for_each(|i| {
        file.push(3);
        file.extend(corners(i).map(u32::to_le_bytes).concat());
    });
    let (_dir, path) = write_file("model.ply", &file);
    let (_, sink) = import_path(&path, &ImportOptions { kept_bytes: 0, ..ImportOptions::default() }).unwrap();
    let expected = (0..100_000).map(|i| corners(i).map(|v| [f64::from(v), 0.5, f64::from(count - v)]));
    assert!(sink.triangles().iter().map(|(_, triangle)| *triangle).eq(expected));
}

#[test]
fn polygons_are_surveyed() {
    let estimate = |bytes: &[u8]| {
        let (_dir, path) = write_file("model.ply", bytes);
        survey(&[path], &ImportOptions::default())
            .map(|found| (found.triangles, found.vertices, found.kept_vertices, found.is_exact))
    };
    assert_eq!(estimate(&binary(true, true)).unwrap(), (1, 4, 0, false));
    let one_list = ASCII.replace("ascii", "binary_little_endian");
    let (header, _) = one_list.split_at(one_list.find("0 0 0 1").unwrap());
    let quad = [header.as_bytes(), &[0; 48], &[4], &[0; 16]].concat();
    assert_eq!(estimate(&quad).unwrap(), (2, 4, 0, false));
    let faces: String = ASCII.to_owned() + &"4 0 1 2 3\n".repeat(9);
    assert_eq!(estimate(faces.replace("face 1", "face 10").as_bytes()).unwrap(), (20, 4, 4, false));
    for length in 0..quad.len() {
        let _ = estimate(&quad[..length]);
    }
    for count in ["18446744073709551615", "1152921504606846976"] {
        assert!(estimate(ASCII.replace("vertex 4", &format!("vertex {count}")).as_bytes()).is_err());
        let nothing = format!("element nothing {count}\nelement face");
        assert!(estimate(ASCII.replace("element face", &nothing).as_bytes()).is_ok());
    }
}
