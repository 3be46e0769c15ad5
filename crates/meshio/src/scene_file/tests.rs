//! Scene files: every key, and what is refused.

use crate::testing::{Collect, import_path};
use crate::{Import, ImportError, ImportOptions, Progress, TriangleBatch, TriangleSink, import, survey};
use raystrips_geom::scene::{Projection, Sky};
use std::io;

const MODEL: &str = "mtllib m.mtl\nusemtl wall\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn read(scene: &str) -> Result<(Import, Collect), ImportError> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("scenes")).unwrap();
    std::fs::write(dir.path().join("model.obj"), MODEL).unwrap();
    std::fs::write(dir.path().join("m.mtl"), "newmtl wall\nKd 1 0 0\n").unwrap();
    let path = dir.path().join("scenes/scene.toml");
    std::fs::write(&path, scene).unwrap();
    import_path(&path, &ImportOptions::default())
}

const PLACED: &str = "[[model]]\nfile = '../model.obj'\n";

#[test]
fn the_example_of_the_documentation() {
    let text = include_str!("../scene_file.rs").split("```").nth(1).unwrap();
    let text = text.trim_start_matches("toml").replace("//!", "").replace("box.obj", "../model.obj");
    let (done, sink) = read(&text).unwrap();
    assert_eq!(done.scene.materials[done.scene.geometries[0].material as usize].base_color, [0.8; 3]);
    assert!(matches!(done.scene.sky, Some(Sky::Gradient { .. })));
    assert_eq!((done.scene.lights.len(), done.scene.cameras.len()), (1, 1));
    // Doubled, then x turns to -z, then moved.
    let corner = sink.triangles()[0].1[1];
    assert!((corner[0] - 1.0).abs() < 1e-9 && (corner[2] + 2.0).abs() < 1e-9, "{corner:?}");
}

#[test]
fn placements_materials_and_cameras() {
    let matrix = "matrix = [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]\n";
    let other =
        "[[material]]\nname = 'other'\nmetallic = 1\n[[material]]\nname = 'wall'\nemission = [1, 1, 1]\n";
    let camera = "[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\n[sky]\ncolor = [1, 1, 1]\n";
    let text =
        format!("\u{feff}{PLACED}{PLACED}material = 'other'\n{matrix}{other}{camera}").replace('\n', "\r\n");
    let (done, sink) = read(&text).unwrap();
    assert_eq!(sink.triangles()[0].1, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(sink.triangles()[1].1, [[5.0, 0.0, 0.0], [5.0, 1.0, 0.0], [6.0, 0.0, 0.0]]);
    let material = |i: usize| &done.scene.materials[done.scene.geometries[i].material as usize];
    assert_eq!((material(0).base_color, material(0).emission), ([1.0, 0.0, 0.0], [1.0; 3]));
    assert_eq!((material(1).name.as_str(), material(1).metallic), ("other", 1.0));
    let camera = &done.scene.cameras[0];
    assert_eq!((camera.forward, camera.up), ([0.0, 0.0, -1.0], [0.0, 1.0, 0.0]));
    assert_eq!(camera.projection, Projection::Perspective { vertical_fov: 40f32.to_radians() });
    assert_eq!(done.scene.sky, Some(Sky::Constant([1.0; 3])));
    assert!(done.report.warnings.is_empty(), "{:?}", done.report.warnings);
}

/// A sheet of 20,000 triangles.
fn sheet() -> String {
    let vertices = (0..=100).flat_map(|y| (0..=100).map(move |x| format!("v {x} {y} {}\n", x * y % 7)));
    let faces = (0..100).flat_map(|y| {
        (1..=100).map(move |x| {
            let i = 101 * y + x;
            format!("f {i} {} {}\nf {i} {} {}\n", i + 1, i + 102, i + 102, i + 101)
        })
    });
    vertices.chain(faces).collect()
}

#[test]
fn a_model_that_stands_often_is_read_once() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("sheet.obj"), sheet()).unwrap();
    let place = |keys: &str| format!("[[model]]\nfile = 'sheet.obj'\n{keys}\n");
    let places = ["", "translate = [5, 0, 0]", "scale = -2.0", "material = 'other'", "scale = [1e3, 1, 1]"];
    let path = dir.path().join("scene.toml");
    let text = places.map(place).concat() + "[[material]]\nname = 'other'\n";
    std::fs::write(&path, text).unwrap();

    let all = |instances| ImportOptions { instances, ..ImportOptions::default() };
    let (done, sink) = import_path(&path, &all(true)).unwrap();
    // Another material is another model; what is drawn out too much is repeated.
    assert_eq!((done.report.triangles, sink.triangles().len()), (60_000, 60_000));
    assert_eq!(done.instances.iter().map(|instance| instance.part).collect::<Vec<_>>(), [1, 1, 1]);
    let at = |i: usize| done.instances[i].world_from_local.transform_point3(glam::DVec3::ONE).to_array();
    assert_eq!([at(0), at(1), at(2)], [[1.0; 3], [6.0, 1.0, 1.0], [-2.0; 3]]);
    assert_eq!(sink.triangles()[20_000].1[0], [0.0; 3]);
    let told = survey(std::slice::from_ref(&path), &all(true)).unwrap();
    assert_eq!((told.triangles, told.instances), (60_000, 3));

    let (done, sink) = import_path(&path, &all(false)).unwrap();
    assert_eq!((done.instances.len(), sink.triangles().len()), (0, 100_000));
    assert_eq!(sink.triangles()[20_000].1[0], [5.0, 0.0, 0.0]);
}

#[test]
fn mistakes_are_named() {
    for (text, part) in [
        ("", "[[model]]"),
        ("[[model]]\nfile = 'x.toml'", "scene file"),
        ("[[model]]\nfile = 'missing.obj'", "missing.obj"),
        ("[[model]]\nfile = 'x.obj'\nscael = 1", "line 3"),
        ("[[model]]\nfile = 'x.obj'\nscale = 'a'", "line 3"),
        ("[[model]]\nfile = 'x.obj'\nscale = 0", "model[0]"),
        ("[[model]]\nfile = 'x.obj'\nscale = nan", "model[0]"),
        ("[[model]]\nfile = 'x.obj'\nmatrix = [1]", "line 3"),
        ("[[model]]\nfile = 'x.obj'\nmaterial = 'm'", "'m'"),
        ("[[model]]\nfile = 'x.obj'\n[camera]\nposition = [0,0,0]\ntarget = [0,0,0]", "camera.target"),
        ("[[model]]\nfile = 'x.obj'\n[camera]\nposition = [0,1,0]\ntarget = [0,0,0]", "camera.up"),
        ("[[model]]\nfile = 'x.obj'\n[sky]\nzenith = [0,0,0]", "sky"),
        ("[[model]]\nfile = 'x.obj'\n[[light]]\ntype = 'point'\nintensity = [1,1,1]", "position"),
        ("[[model]]\nfile = 'x.obj'\n[[light]]\ntype = 'area'", "area"),
        ("[[model]]\nfile = 'x.obj'\n[[material]]\nname = 'a'\nalpha = 2", "material[0].alpha"),
        ("[[model]\n", "line 1"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scene.toml");
        std::fs::write(&path, text).unwrap();
        let error = import(std::slice::from_ref(&path), &ImportOptions::default(), &mut Collect::default())
            .unwrap_err()
            .to_string();
        assert!(!error.contains('\n') && error.contains(part), "{part}: {error}");
        assert_eq!(survey(&[path], &ImportOptions::default()).unwrap_err().to_string(), error);
    }
    let unused = read(&format!("{PLACED}[[material]]\nname = 'a'")).unwrap().0;
    assert!(unused.report.warnings[0].contains("'a'"));
}

#[test]
fn several_inputs_share_a_scene() {
    let dir = tempfile::tempdir().unwrap();
    let paths = ["a.obj", "b.obj"].map(|name| dir.path().join(name));
    for path in &paths {
        std::fs::write(path, MODEL).unwrap();
    }
    let mut sink = Collect::default();
    let done = import(&paths, &ImportOptions::default(), &mut sink).unwrap();
    assert_eq!(
        sink.0.iter().map(|b| (b.first_triangle_id, b.geometry)).collect::<Vec<_>>(),
        [(0, 0), (1, 1)]
    );
    assert_eq!(done.scene.materials.len(), 2);
    for (name, part) in
        [("missing.obj", "No such file"), ("a.xyz", "no known format"), ("", "not a regular file")]
    {
        std::fs::write(dir.path().join("a.xyz"), "x").unwrap();
        let path = dir.path().join(name);
        let error = import(&[path], &ImportOptions::default(), &mut sink).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_survey_counts_each_placement() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scene.toml");
    std::fs::write(dir.path().join("model.obj"), MODEL).unwrap();
    std::fs::write(&path, "[[model]]\nfile = 'model.obj'\n".repeat(3)).unwrap();
    let found = survey(&[path], &ImportOptions::default()).unwrap();
    assert_eq!((found.triangles, found.vertices, found.kept_vertices), (3, 9, 9));
    assert_eq!((found.bytes, found.is_exact), (3 * MODEL.len() as u64, false));
}

/// Refuses everything, and keeps the last report of progress.
struct Full(Option<Progress>, bool);

impl TriangleSink for Full {
    fn batch(&mut self, _: TriangleBatch) -> io::Result<()> {
        if self.1 { Err(io::Error::other("disk\nfull")) } else { Ok(()) }
    }

    fn progress(&mut self, progress: Progress) {
        self.0 = Some(progress);
    }
}

#[test]
fn sinks_may_fail_and_see_progress() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    std::fs::write(&path, MODEL).unwrap();
    let error =
        import(std::slice::from_ref(&path), &ImportOptions::default(), &mut Full(None, true)).unwrap_err();
    assert_eq!(error.to_string(), "triangles cannot be stored: disk full");
    let mut sink = Full(None, false);
    import(&[path], &ImportOptions::default(), &mut sink).unwrap();
    let bytes = MODEL.len() as u64;
    assert_eq!(sink.0, Some(Progress { bytes_done: bytes, bytes_total: bytes }));
}
