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
        let left = |name: &str| ["a.rsp.partial", "a.exr.unfinished"].contains(&name);
        assert!(
            names.len() == usize::from(promised) && names.iter().all(|n| left(n)),
            "{names:?} {outcome:#?}"
        );
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
fn an_interrupted_picture_is_gone_on_with() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(100).ply());
    folder.run("convert ring.ply -o ring.rsp --page-size 4K").done();
    std::fs::create_dir(folder.path("out")).unwrap();
    let mut kept_any = false;
    for order in ["none", "queues", "hph"] {
        let render = format!("render ring.rsp --size 160x96 --spp 256 --reorder {order}");
        let begin = Instant::now();
        folder.run(&format!("{render} -o whole.exr")).done();
        let whole = begin.elapsed();
        let arguments = format!("{render} -o out/a.exr --keep-every 0");
        let code = interrupted(&folder, &arguments, "-INT", whole.mul_f64(0.3));
        assert!([Some(0), Some(130)].contains(&code), "{code:?}");
        // Killed without a warning too.
        let mut running = folder.start(&arguments);
        std::thread::sleep(whole.mul_f64(0.3));
        running.child.kill().unwrap();
        running.child.wait().unwrap();
        let kept = folder.path("out/a.exr.unfinished").exists();
        kept_any |= kept;
        let outcome = folder.run(&format!("{render} -o out/a.exr"));
        assert_eq!(outcome.stderr.contains("going on from"), kept, "{outcome:#?}");
        assert!(folder.read("out/a.exr") == folder.read("whole.exr"), "{order}");
        // Killed while it wrote, it leaves a temporary file.
        let names = folder.names("out");
        assert!(names.iter().all(|n| n == "a.exr" || n.ends_with(".partial")), "{names:?}");
        names.iter().for_each(|name| std::fs::remove_file(folder.path("out").join(name)).unwrap());
    }
    assert!(kept_any, "no order was killed between its beginning and its end");
}

#[test]
fn what_is_kept_of_another_picture_is_not_gone_on_with() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(20).ply());
    folder.run("convert ring.ply -o ring.rsp").done();
    folder.write("a.exr.unfinished", b"not a picture");
    let outcome = folder.run("render ring.rsp -o a.exr --size 16x16 --spp 1");
    assert!(outcome.code == Some(0) && outcome.stderr.contains("beginning anew"), "{outcome:#?}");
    assert!(!folder.path("a.exr.unfinished").exists());
}
