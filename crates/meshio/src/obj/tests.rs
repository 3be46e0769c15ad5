//! OBJ files as people have them: good, odd and hostile.

use crate::testing::{
    Collect, import_all_prefixes, import_bytes, import_path, import_with_any_memory, write_file,
};
use raystrips_geom::{Attributes, Streams};

use crate::{Dropped, Import, ImportError, ImportOptions, Place, survey};

fn read(text: &str) -> (Import, Collect) {
    import_bytes("model.obj", text.as_bytes()).unwrap()
}

fn error(text: &[u8]) -> ImportError {
    import_bytes("model.obj", text).unwrap_err()
}

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const TRIANGLE: [[f64; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];

#[test]
fn all_ways_to_write_a_face() {
    for face in
        ["f 1 2 3", "f 1/1 2/2 3/3", "f 1//1 2//2 3//3", "f 1/1/1 2/2/2 3/3/3", "f -4 -3 -2", "f 1/ 2/ 3/"]
    {
        let (_, sink) = read(&format!("{CORNERS}{face}"));
        assert_eq!(sink.triangles(), [(0, TRIANGLE)], "{face}");
    }
}

#[test]
fn odd_white_space() {
    let texts = [
        "\u{feff}v 0 0 0\r\nv  1\t0 0 \r\n  v 1 1 0 1.0 0.5 0.5\r\n\tf 1  2\t3 # c\r\n",
        "v 0 0 0\rv 1 0 0\rv 1 1 0\rf 1 2 3",
        "v 0 \\\n0 0\nv 1 0 0\n# c \\\nv 1 1 0\nf 1 \\\r\n 2 \\\r\n 3",
    ];
    for text in texts {
        assert_eq!(read(text).1.triangles(), [(0, TRIANGLE)], "{text:?}");
    }
}

#[test]
fn colors_behind_positions_are_linear_light() {
    // The first vertex has a weight; the second and those after it a color, but for the last one. The middle of gray is 188.
    let text = "f 2 3 4\nv 9 9 9 1\nv 0 0 0 1 0 0\nv 1 0 0 0.7372549 2 -1\nv 1 1 0 0 1 0 1\nv 0 1 0\n\
                f 2 3 4 5\nf 1 2 3\n";
    let (done, sink) = read(text);
    let of = |batch: usize, vertex: usize| {
        let batch = &sink.0[batch];
        let record = &batch.attributes[vertex * batch.streams.record_bytes()..];
        Attributes::decode(record, batch.streams).color.to_array()
    };
    let has_colors: Vec<bool> = sink.0.iter().map(|batch| batch.streams.has(Streams::COLORS)).collect();
    assert_eq!(has_colors, [true, false, true]);
    assert_eq!(of(0, 0), [1.0, 0.0, 0.0, 1.0]);
    assert!((of(0, 1)[0] - 0.5029).abs() < 2e-4 && of(0, 1)[1..] == [1.0, 0.0, 1.0], "{:?}", of(0, 1));
    assert_eq!(of(0, 3), [1.0; 4]);
    // A face before its vertices has their colors, too.
    assert_eq!(of(2, 2), [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(done.scene.materials.iter().map(|m| m.base_color).collect::<Vec<_>>(), [[0.8; 3]]);
    let (done, _) = read(text.split_once('\n').unwrap().1);
    assert_eq!(done.scene.materials.iter().map(|m| m.base_color).collect::<Vec<_>>(), [[1.0; 3]]);
    let bare = ImportOptions { bare: true, ..ImportOptions::default() };
    let (_folder, path) = write_file("model.obj", text.as_bytes());
    assert!(import_path(&path, &bare).unwrap().1.0.iter().all(|batch| batch.attributes.is_empty()));
}

#[test]
fn polygons_are_cut_and_numbered() {
    let (done, sink) = read(&format!("{CORNERS}f 1 2 3 4\nf 1 2 3\nf 1 2\nl 1 2\n"));
    let ids: Vec<_> = sink.triangles().iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, [0, 1, 2]);
    assert_eq!(sink.0[0].positions.len(), 4);
    assert_eq!(done.report.warnings.len(), 2, "{:?}", done.report.warnings);
}

#[test]
fn vertices_may_come_after_their_faces() {
    let (_, sink) = read(&format!("f 1 2 3\n{CORNERS}f 1 2 4\n"));
    assert_eq!(sink.triangles().len(), 2);
    assert_eq!(sink.triangles()[0], (0, TRIANGLE));
}

#[test]
fn a_geometry_for_each_material() {
    let mtl = b"newmtl red one\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n";
    let (dir, _keep) = write_file("my colors.mtl", mtl);
    let path = dir.path().join("model.obj");
    let faces =
        "f 1 2 3\nusemtl red one\nf 1 2 3\nusemtl none\nf 1 2 3\nusemtl red one\nf 1 2 3\nusemtl unused";
    std::fs::write(&path, format!("{CORNERS}mtllib missing.mtl my colors.mtl\n{faces}")).unwrap();
    let (done, sink) = import_path(&path, &ImportOptions::default()).unwrap();
    let names: Vec<_> = done.scene.geometries.iter().map(|g| g.name.as_str()).collect();
    assert_eq!(names, ["", "red one", "none"]);
    assert_eq!(done.scene.materials[1].base_color, [1.0, 0.0, 0.0]);
    assert_eq!(
        sink.0.iter().map(|b| (b.geometry, b.first_triangle_id)).collect::<Vec<_>>(),
        [(0, 0), (1, 1), (2, 2), (1, 3)]
    );
    assert_eq!(done.report.warnings.len(), 2, "{:?}", done.report.warnings);
}

#[test]
fn libraries_outside_the_folder_are_not_read() {
    for name in ["../a.mtl", "/etc/passwd", "http://host/a.mtl", "C:\\a.mtl"] {
        let (done, _) = read(&format!("mtllib {name}\n{CORNERS}f 1 2 3\n"));
        assert!(done.report.warnings[0].contains("is not read"), "{:?}", done.report.warnings);
    }
}

#[test]
fn impossible_indices_are_errors_or_dropped() {
    for (face, index) in [("1 2 0", 0), ("1 2 9", 9), ("-1 -2 -5", -5), ("1 2 3 99999999999", 99999999999)] {
        let text = format!("{CORNERS}f 1 2 3\nf {face}\nf 1 2 3\n");
        match error(text.as_bytes()) {
            ImportError::IndexOutOfRange { place: Place::Line(6), index: found, vertex_count: 4, .. } => {
                assert_eq!(found, index);
            }
            other => panic!("{other:?}"),
        }
        let (_dir, path) = write_file("model.obj", text.as_bytes());
        let (done, sink) =
            import_path(&path, &ImportOptions { drop_out_of_range: true, ..ImportOptions::default() })
                .unwrap();
        let lost = face.split(' ').count() as u64 - 2;
        assert_eq!(done.report.dropped, Dropped { non_finite: 0, out_of_range: lost });
        assert_eq!(sink.triangles().iter().map(|(id, _)| *id).collect::<Vec<_>>(), [0, 1 + lost]);
    }
}

#[test]
fn triangles_at_infinity_are_dropped() {
    let (done, sink) = read(&format!("{CORNERS}v nan 0 0\nv 1e19 0 0\nf 1 2 3\nf 1 2 5\nf 6 2 3\nf 1 2 3\n"));
    assert_eq!(done.report.dropped, Dropped { non_finite: 1, out_of_range: 1 });
    assert_eq!(sink.triangles(), [(0, TRIANGLE), (3, TRIANGLE)]);
    assert_eq!(sink.0.iter().map(|b| b.positions.len()).collect::<Vec<_>>(), [3, 3]);
}

#[test]
fn broken_lines_are_named() {
    for text in ["v 0 0 0\nv 1 x 0\n", "v 0 0 0\nv 1\n", "v 0 0 0\nf 1 1 a\n"] {
        assert!(error(text.as_bytes()).to_string().contains("line 2"), "{text}");
    }
    assert!(error(b"\xff\xfev\0 \x000\0").to_string().contains("UTF-8"));
    assert!(error(b"v\0 \x000\0").to_string().contains("UTF-8"));
    assert!(matches!(error(b"v 0 0 0\np 1\n"), ImportError::NoTriangles { .. }));
    assert!(matches!(error(b""), ImportError::NoTriangles { .. }));
    assert!(matches!(error(b"v nan 0 0\nf 1 1 1"), ImportError::NoTriangles { .. }));
}

#[test]
fn every_beginning_of_a_file() {
    import_all_prefixes(
        "model.obj",
        b"mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\\\n\nv 1 1 0\nf 1/1 2//3 -1\nf 1 2 3",
    );
}

#[test]
fn large_files_come_in_full_batches() {
    let mut text = String::new();
    for i in 0..100_000 {
        text += &format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1\nf -3 -2 -1\n");
    }
    let (done, sink) = read(&text);
    assert_eq!(done.report.triangles, 100_000);
    assert!(sink.0.len() <= 5 && sink.0.iter().all(|b| b.positions.len() == 3 * b.triangles.len()));
    assert_eq!(sink.triangles()[99_999].1[0], [99_999.0, 0.0, 0.0]);
}

#[test]
fn memory_changes_nothing() {
    use std::fmt::Write;
    let count = 1_100_000u32;
    let mut text = String::new();
    for i in 1..=count {
        writeln!(text, "v {i} 0 0.{i}").unwrap();
        // Backwards by a little and by much, then forwards.
        match i % 9 {
            0 => writeln!(text, "f -1 -2 -3").unwrap(),
            3 => writeln!(text, "f {i} {} {}", i / 2 + 1, i / 3 + 1).unwrap(),
            6 => writeln!(text, "f {i} {} 2 1", count - i / 2).unwrap(),
            _ => {}
        }
    }
    let triangles = import_with_any_memory("model.obj", text.as_bytes());
    assert_eq!(triangles.len() as u32, count / 9 * 4);
    for (at, group) in (0..).step_by(9).zip(triangles.chunks(4)) {
        let numbers = |i: usize| group[i].1.map(|corner| corner[0] as u32);
        assert_eq!(numbers(0), [at + 3, (at + 3) / 2 + 1, (at + 3) / 3 + 1]);
        assert!(
            [1, 2]
                .iter()
                .all(|&i| numbers(i).iter().all(|x| [at + 6, count - (at + 6) / 2, 2, 1].contains(x)))
        );
        assert_eq!(numbers(3), [at + 9, at + 8, at + 7]);
    }
}

#[test]
fn surveys_are_close_wherever_the_faces_are() {
    let vertices = "v 0.25 0.5 0.75\n".repeat(200_000);
    let faces = "f 1/1 2/2 3/3 4/4\nf 1 2 3\n".repeat(60_000);
    for text in [format!("{vertices}{faces}"), format!("{faces}{vertices}").replace('\n', "\r")] {
        let (_dir, path) = write_file("model.obj", text.as_bytes());
        let found = survey(&[path], &ImportOptions::default()).unwrap();
        let near = |count: u64, expected: u64| count.abs_diff(expected) < expected / 10;
        assert!(near(found.vertices, 200_000) && near(found.triangles, 180_000), "{found:?}");
        assert!(found.kept_vertices == found.vertices && !found.is_exact);
    }
    for text in ["", "v", "#", "\n", &"x".repeat(3 << 20)] {
        let (_dir, path) = write_file("model.obj", text.as_bytes());
        assert_eq!(survey(&[path], &ImportOptions::default()).unwrap().triangles, 0);
    }
}

/// A number that only says that there is a texture is none without it.
#[test]
fn a_lost_texture_neither_glows_nor_makes_metal() {
    let (folder, path) =
        write_file("a.obj", format!("mtllib a.mtl\n{CORNERS}usemtl a\nf 1 2 3\n").as_bytes());
    let mtl = "newmtl a\nKd 0.5 0.5 0.5\nmap_Ke lost.png\nmap_Pm lost.png\nnorm lost.png\n";
    std::fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    for bare in [false, true] {
        let (done, _) = import_path(&path, &ImportOptions { bare, ..ImportOptions::default() }).unwrap();
        let material = &done.scene.materials[0];
        assert_eq!((material.emission, material.metallic, material.base_color), ([0.0; 3], 0.0, [0.5; 3]));
        assert_eq!(material.textures.all().count(), 0);
        assert_eq!(done.report.warnings.len(), if bare { 0 } else { 1 }, "{:?}", done.report.warnings);
    }
}
