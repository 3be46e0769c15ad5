//! Ctrl-C while the binary works.

#![cfg(unix)]

use crate::models::Mesh;
use crate::support::Folder;
use std::process::Command;
use std::time::{Duration, Instant};

/// Far more than the program may still take once it was asked to stop.
const PATIENCE: Duration = Duration::from_secs(30);

/// Runs `arguments` in `folder`, sends `signal` after `delay`, and gives the exit status. Whatever is in the
/// folder `out` is expected to be gone or whole, but for what the next run can go on from.
fn interrupted(folder: &Folder, arguments: &str, signal: &str, delay: Duration) -> Option<i32> {
    let running = folder.start(arguments);
    std::thread::sleep(delay);
    // It may have ended before; its number is not given to another while we have not waited for it.
    let kill = Command::new("kill").args([signal, &running.child.id().to_string()]).output().unwrap();
    assert!(kill.status.success(), "{kill:?}");
    let outcome = running.wait(PATIENCE);
    let names = folder.names("out");
    if outcome.code == Some(0) {
        assert_eq!(names.len(), 1, "{outcome:#?}");
        std::fs::remove_file(folder.path("out").join(&names[0])).unwrap();
    } else {
        let promised = outcome.stderr.contains("goes on from here");
        let left: &[&str] = if promised { &["a.rsp.partial"] } else { &[] };
        assert_eq!(names, left, "{outcome:#?}");
        // Before the program could say how it wants to be ended, the signal alone ends it.
        let lines = outcome.stderr.lines().count();
        assert!(lines <= 1 && !outcome.stderr.contains("panic"), "{outcome:#?}");
    }
    outcome.code
}

#[test]
fn an_interrupted_conversion_leaves_what_it_can_go_on_from() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(500).ply());
    let begin = Instant::now();
    folder.run("convert hills.ply -o hills.rsp").done();
    let whole = begin.elapsed();
    std::fs::create_dir(folder.path("out")).unwrap();
    let mut codes = Vec::new();
    for (i, share) in [0.1, 0.25, 0.4, 0.55, 0.7].into_iter().enumerate() {
        let signal = ["-INT", "-TERM"][i % 2];
        codes.push(interrupted(&folder, "convert hills.ply -o out/a.rsp", signal, whole.mul_f64(share)));
    }
    assert!(codes.contains(&Some(1)), "no run noticed: {codes:?}");
    folder.run("convert hills.ply -o out/a.rsp").done();
    assert!(folder.read("out/a.rsp") == folder.read("hills.rsp"));
    assert_eq!(folder.names("out"), ["a.rsp"]);
}

#[test]
fn an_interrupted_picture_leaves_nothing() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(40).ply());
    folder.run("convert hills.ply -o hills.rsp").done();
    std::fs::create_dir(folder.path("out")).unwrap();
    // Many minutes of work.
    let arguments = "render hills.rsp -o out/a.exr --size 1000x1000 --spp 1024";
    let code = interrupted(&folder, arguments, "-INT", Duration::from_millis(500));
    assert_eq!(code, Some(130));
}
