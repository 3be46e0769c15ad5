//! Conversions within a budget of memory and disk.

use crate::models::Mesh;
use crate::support::Folder;

/// The least for meshes of several pieces, with some room.
const LITTLE: &str = "--memory 160M --threads 2";

/// Several pieces.
fn folder_with_hills() -> Folder {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(600).ply());
    folder
}

#[test]
fn the_same_bytes_for_any_memory_and_threads() {
    let folder = folder_with_hills();
    folder.run("convert hills.ply -o a.rsp --keep-ids").done();
    std::fs::create_dir(folder.path("scratch")).unwrap();
    for options in ["--threads 1", LITTLE, "--threads 3 --memory 180M --scratch scratch"] {
        let outcome = folder.run(&format!("convert hills.ply -o b.rsp --keep-ids --json {options}"));
        assert_eq!(outcome.code, Some(0), "{outcome:#?}");
        assert!(folder.read("a.rsp") == folder.read("b.rsp"), "{options}");
        assert_eq!(outcome.stderr.contains("scratch files in"), options.contains("--memory"), "{outcome:#?}");
    }
    assert_eq!(folder.names("scratch"), [""; 0]);
    assert_eq!(folder.names(""), ["a.rsp", "b.rsp", "hills.ply", "scratch"]);
}

#[test]
fn formats_and_their_order_do_not_matter_to_the_memory() {
    let folder = Folder::new();
    let hills = Mesh::hills(450);
    folder.write("hills.obj", hills.obj(&[]));
    // Faces before the vertices that they name.
    let (vertices, faces): (Vec<_>, Vec<_>) =
        hills.obj(&[]).lines().map(str::to_owned).partition(|line| line.starts_with('v'));
    folder.write("turned.obj", [faces, vertices].concat().join("\n"));
    for name in ["hills.obj", "turned.obj"] {
        folder.run(&format!("convert {name} -o a.rsp")).done();
        let outcome = folder.run(&format!("convert {name} -o b.rsp {LITTLE}"));
        assert_eq!(outcome.code, Some(0), "{outcome:#?}");
        assert!(folder.read("a.rsp") == folder.read("b.rsp"), "{name}");
    }
}

#[test]
fn materials_that_change_with_every_face_cost_no_memory() {
    let folder = Folder::new();
    let mut text = String::new();
    for (i, line) in Mesh::hills(400).obj(&[]).lines().enumerate() {
        if line.starts_with('f') {
            text += ["usemtl red\n", "usemtl green\n"][i % 2];
        }
        text += line;
        text.push('\n');
    }
    folder.write("hills.obj", text);
    let outcome = folder.run(&format!("convert hills.obj -o a.rsp --json {LITTLE}"));
    assert_eq!(outcome.code, Some(0), "{outcome:#?}");
    let told = outcome.json();
    assert_eq!((&told["triangles"], &told["geometries"]), (&320_000.into(), &2.into()));
    assert!(told["peak_rss_bytes"].as_u64().unwrap() <= 160 << 20, "{told}");
}

#[cfg(target_os = "linux")]
#[test]
fn the_process_keeps_to_its_budget() {
    let folder = folder_with_hills();
    let outcome = folder.run(&format!("convert hills.ply -o a.rsp --json {LITTLE}"));
    let peak = outcome.json()["peak_rss_bytes"].as_u64().unwrap();
    assert!((1 << 20..=160 << 20).contains(&peak), "{peak}");
}

/// Triangles in every cell of space, which share nothing.
#[cfg(target_os = "linux")]
#[test]
fn a_soup_keeps_to_its_budget() {
    let folder = Folder::new();
    folder.write("soup.ply", Mesh::soup(1_000_000).ply());
    let outcome = folder.run("convert soup.ply -o a.rsp --json --memory 280M --threads 2");
    assert_eq!(outcome.code, Some(0), "{outcome:#?}");
    let told = outcome.json();
    assert_eq!((&told["triangles"], &told["vertices"]), (&1_000_000.into(), &3_000_000.into()));
    assert!(told["peak_rss_bytes"].as_u64().unwrap() <= 280 << 20, "{told}");
}

#[test]
fn too_little_is_refused_with_what_would_do() {
    let folder = folder_with_hills();
    let outcome = folder.run("convert hills.ply -o a.rsp --memory 50M");
    let least =
        outcome.stderr.split("use --memory ").nth(1).expect("an option that would do").trim().to_owned();
    outcome.failed(&["a memory budget of 50 MiB is too little"]);
    assert_eq!(folder.names(""), ["hills.ply"]);
    let outcome = folder.run(&format!("convert hills.ply -o a.rsp --memory {least}"));
    assert_eq!(outcome.code, Some(0), "{outcome:#?}");
}

#[test]
fn vertices_of_several_pieces_are_counted_once() {
    let folder = folder_with_hills();
    let report = folder.run("convert hills.ply -o a.rsp --json").json();
    assert_eq!(report["vertices"], 601 * 601);
    assert_eq!(report["triangles"], 2 * 600 * 600);
}
