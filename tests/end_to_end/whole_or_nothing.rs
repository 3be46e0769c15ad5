//! Outputs appear whole or not at all.

use crate::models::Mesh;
use crate::rays;
use crate::support::{BINARY, Folder};
use std::process::Command;

/// Every verb that writes; the output goes to the folder `full`.
const WRITERS: [(&str, &str); 3] = [
    ("convert hills.ply -o full/a.rsp", "full/a.rsp"),
    ("trace hills.rsp --rays rays -o full/hits", "full/hits"),
    ("render hills.rsp -o full/a.exr --size 64x64 --spp 1 --integrator ao", "full/a.exr"),
];

fn folder_with_inputs() -> Folder {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(40).ply());
    folder.write("rays", rays::encode(&rays::onto(40, 4000)));
    folder.run("convert hills.ply -o hills.rsp").done();
    folder
}

/// Runs in a mount namespace of its own, where `full` is a disk of four pages, then lists it.
#[cfg(target_os = "linux")]
const ON_A_SMALL_DISK: &str =
    "mount -t tmpfs -o size=16k tmpfs full || exit 99; \"$@\"; code=$?; ls -A full; exit $code";

/// What gives a mount namespace here, if anything does: root itself, or a user who becomes root in it.
#[cfg(target_os = "linux")]
fn namespace() -> Option<&'static [&'static str]> {
    const WAYS: [&[&str]; 2] = [&["--mount"], &["--mount", "--map-root-user"]];
    let folder = Folder::new();
    std::fs::create_dir(folder.path("full")).unwrap();
    let works = |way: &&&[&str]| {
        let mut unshare = Command::new("unshare");
        unshare.args(**way).args(["sh", "-c", ON_A_SMALL_DISK, "sh", "true"]).current_dir(folder.path(""));
        unshare.output().is_ok_and(|output| output.status.success())
    };
    WAYS.iter().find(works).copied()
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_nothing() {
    let Some(namespace) = namespace() else {
        eprintln!("skipped: a small disk cannot be mounted here");
        return;
    };
    let folder = folder_with_inputs();
    std::fs::create_dir(folder.path("full")).unwrap();
    for (arguments, output) in WRITERS {
        let mut unshare = Command::new("unshare");
        unshare.args(namespace).args(["sh", "-c", ON_A_SMALL_DISK, "sh", BINARY]);
        // Standard output holds the list of what is on the disk: nothing.
        folder.run_command(unshare.args(arguments.split(' '))).failed(&[output, "space"]);
        assert!(folder.names("full").is_empty());
    }
}

#[test]
fn a_folder_that_does_not_exist_is_named() {
    let folder = folder_with_inputs();
    for (arguments, output) in WRITERS {
        folder.run(arguments).failed(&[output]);
    }
    assert!(!folder.path("full").exists());
}

#[test]
fn what_was_there_stays_when_a_run_fails() {
    let folder = folder_with_inputs();
    folder.write("full/a.rsp", "old");
    folder.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    folder.run("convert bad.obj -o full/a.rsp").failed(&["bad.obj"]);
    assert_eq!(folder.read("full/a.rsp"), b"old");
    WRITERS.into_iter().for_each(|(arguments, _)| drop(folder.run(arguments).done()));
    assert_eq!(folder.names("full"), ["a.exr", "a.rsp", "hits"]);
    assert!(folder.read("full/a.rsp") == folder.read("hills.rsp"));
}

#[test]
fn inputs_are_not_written_over() {
    let folder = folder_with_inputs();
    let before = ["hills.ply", "hills.rsp", "rays"].map(|name| (name, folder.read(name)));
    for arguments in [
        "convert hills.ply -o hills.ply",
        "trace hills.rsp --rays rays -o rays",
        "trace hills.rsp --rays rays -o ./hills.rsp",
        "render hills.rsp -o a.png --stats hills.rsp",
    ] {
        folder.run(arguments).failed(&["is an input too"]);
    }
    assert!(before.iter().all(|(name, bytes)| folder.read(name) == *bytes));
}
