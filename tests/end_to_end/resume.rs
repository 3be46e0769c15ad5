//! Conversions that are killed and called again.

use crate::models::Mesh;
use crate::support::{Folder, Running};
use std::time::{Duration, Instant};

const CONVERT: &str = "convert hills.ply -o out/a.rsp --memory 160M --threads 2";

/// A folder with a mesh of several pieces, its pack, and the time that took.
fn converted() -> (Folder, Vec<u8>, Duration) {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(500).ply());
    std::fs::create_dir(folder.path("out")).unwrap();
    let begin = Instant::now();
    assert_eq!(folder.run(CONVERT).code, Some(0));
    let pack = folder.read("out/a.rsp");
    std::fs::remove_file(folder.path("out/a.rsp")).unwrap();
    (folder, pack, begin.elapsed())
}

/// Kills the process without a warning after `delay`; true if it was not done by then.
fn killed_after(mut running: Running, delay: Duration) -> bool {
    std::thread::sleep(delay);
    let killed = running.child.try_wait().unwrap().is_none();
    running.child.kill().unwrap();
    running.child.wait().unwrap();
    killed
}

/// Kills a conversion when there is something in the pack.
fn killed_in_the_pack(folder: &Folder) {
    if folder.read_if("out/a.rsp.partial/pack").is_empty() {
        killed_in_the_pack_of(folder, CONVERT);
    }
}

/// The same for any command.
fn killed_in_the_pack_of(folder: &Folder, command: &str) {
    killed_in_the_pack_beyond(folder, command, 1 << 20);
}

/// Starts conversions until one is killed when its pack is longer than `bytes` and it has noted something of that; some times at
/// most, since it may be over before that is seen.
fn killed_in_the_pack_beyond(folder: &Folder, command: &str, bytes: u64) {
    let length =
        |name: &str| folder.path(&format!("out/a.rsp.partial/{name}")).metadata().map_or(0, |f| f.len());
    let is_in_the_pack =
        || length("pack") > bytes && ["journal", "shared"].into_iter().all(|name| length(name) > 0);
    for _ in 0..20 {
        let mut running = folder.start(command);
        while !is_in_the_pack() && running.child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        let killed = killed_after(running, Duration::ZERO);
        _ = std::fs::remove_file(folder.path("out/a.rsp"));
        if killed && is_in_the_pack() {
            return;
        }
    }
}

/// Numbers in 0..1, the same ones at each call.
fn shares() -> impl Iterator<Item = f64> {
    (1u32..).map(|i| f64::from(i.wrapping_mul(2_654_435_769)) / f64::from(u32::MAX))
}

/// Kills conversions `kills` times at all moments. Whenever one comes to its end, the pack must be what it always is.
fn kill(kills: usize) {
    let (folder, pack, whole) = converted();
    let (mut killed, mut finished) = (0, 0);
    for share in shares() {
        if killed == kills {
            break;
        }
        if killed_after(folder.start(CONVERT), whole.mul_f64(share)) {
            killed += 1;
        }
        if folder.path("out/a.rsp").exists() {
            assert!(folder.read("out/a.rsp") == pack, "after {killed} kills");
            assert!(folder.names("out").len() == 1 || killed > 0);
            std::fs::remove_file(folder.path("out/a.rsp")).unwrap();
            finished += 1;
        }
    }
    assert_eq!(folder.run(CONVERT).code, Some(0));
    assert!(folder.read("out/a.rsp") == pack);
    assert_eq!(folder.names("out"), ["a.rsp"]);
    assert!(finished > 0, "none of the killed conversions came to its end: they do not go on");
}

#[test]
fn killed_at_any_moment_a_conversion_goes_on() {
    kill(20);
}

#[test]
#[ignore = "some ten minutes"]
fn killed_a_thousand_times() {
    kill(1000);
}

#[test]
fn another_input_or_other_parameters_begin_anew() {
    let (folder, _, _) = converted();
    for (change, command) in [
        (Some(Mesh::hills(400)), CONVERT.to_owned()),
        (None, format!("{CONVERT} --page-size 16K")),
        (None, format!("{CONVERT} --restart")),
    ] {
        killed_in_the_pack(&folder);
        if let Some(mesh) = change {
            folder.write("hills.ply", mesh.ply());
        }
        assert_eq!(folder.run(&command).code, Some(0));
        let pack = folder.read("out/a.rsp");
        assert_eq!(folder.run(&command.replace("out/a.rsp", "b.rsp")).code, Some(0));
        assert!(folder.read("b.rsp") == pack, "{command}");
        assert_eq!(folder.names("out"), ["a.rsp"]);
    }
}

#[test]
fn a_changed_model_of_a_scene_is_not_mixed_with_the_old_one() {
    let (folder, _, _) = converted();
    folder.write("scene.toml", "[[model]]\nfile = 'hills.ply'\n");
    // The scene file is the same, what it names is not; with little memory and with much.
    for memory in ["--memory 160M", ""] {
        let command = CONVERT.replace("hills.ply", "scene.toml").replace("--memory 160M", memory);
        folder.write("hills.ply", Mesh::hills(500).ply());
        killed_in_the_pack_of(&folder, &command);
        folder.write("hills.ply", Mesh::hills(470).ply());
        assert_eq!(folder.run(&command).code, Some(0));
        let pack = folder.read("out/a.rsp");
        assert_eq!(folder.run(&command.replace("out/a.rsp", "b.rsp")).code, Some(0));
        assert!(folder.read("b.rsp") == pack, "{command}");
        std::fs::remove_file(folder.path("out/a.rsp")).unwrap();
    }
}

#[test]
fn what_is_damaged_is_done_again() {
    let (folder, pack, _) = converted();
    let flip = |at: fn(usize) -> usize| {
        move |bytes: &mut Vec<u8>| {
            let at = at(bytes.len());
            bytes[at] ^= 1;
        }
    };
    type Damage<'a> = (&'a str, &'a dyn Fn(&mut Vec<u8>));
    let damages: [Damage; 8] = [
        ("pack", &flip(|_| 0)),
        ("pack", &flip(|length| length - 1)),
        ("pack", &Vec::clear),
        ("shared", &flip(|length| length - 1)),
        ("shared", &Vec::clear),
        ("journal", &flip(|length| length - 1)),
        ("journal", &flip(|length| length / 2)),
        ("gathered", &Vec::clear),
    ];
    for (name, damage) in damages {
        killed_in_the_pack(&folder);
        let file = format!("out/a.rsp.partial/{name}");
        let mut bytes = folder.read(&file);
        damage(&mut bytes);
        folder.write(&file, bytes);
        assert_eq!(folder.run(CONVERT).code, Some(0), "{name}");
        assert!(folder.read("out/a.rsp") == pack, "{name}");
        std::fs::remove_file(folder.path("out/a.rsp")).unwrap();
    }
}

#[test]
fn damaged_scratch_files_are_told_and_done_again() {
    let (folder, pack, _) = converted();
    killed_in_the_pack(&folder);
    let mut bytes = folder.read("out/a.rsp.partial/gathered");
    bytes.iter_mut().skip(7).step_by(4096).for_each(|byte| *byte ^= 4);
    folder.write("out/a.rsp.partial/gathered", bytes);
    let outcome = folder.run(CONVERT);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("a scratch file is damaged"), "{outcome:#?}");
    assert_eq!(folder.run(CONVERT).code, Some(0));
    assert!(folder.read("out/a.rsp") == pack);
}

#[test]
fn scratch_files_elsewhere_are_removed_whenever_they_move() {
    let (folder, pack, _) = converted();
    for name in ["first", "second"] {
        std::fs::create_dir(folder.path(name)).unwrap();
    }
    for scratch in ["--scratch first", "--scratch second", ""] {
        killed_in_the_pack_of(&folder, &format!("{CONVERT} {scratch}"));
    }
    assert_eq!(folder.run(&format!("{CONVERT} --scratch first")).code, Some(0));
    assert!(folder.read("out/a.rsp") == pack);
    for name in ["first", "second"] {
        assert_eq!(folder.names(name), [""; 0]);
    }
}

#[test]
fn incoherent_input_goes_on_too() {
    // A piece of a soup takes more memory, but all of it together still more than that.
    let convert = &CONVERT.replace("160M", "300M");
    let folder = Folder::new();
    std::fs::create_dir(folder.path("out")).unwrap();
    folder.write("hills.ply", Mesh::soup(600_000).ply());
    assert_eq!(folder.run(convert).code, Some(0));
    let pack = folder.read("out/a.rsp");
    std::fs::remove_file(folder.path("out/a.rsp")).unwrap();
    let mut finished = 0;
    for _ in 0..2 {
        finished = finished.max(folder.read_if("out/a.rsp.partial/pack").len());
        killed_in_the_pack_beyond(&folder, convert, finished as u64 + (1 << 20));
    }
    assert_eq!(folder.run(convert).code, Some(0));
    assert!(folder.read("out/a.rsp") == pack);
}

#[test]
fn two_at_once_to_the_same_output_are_refused() {
    let (folder, pack, _) = converted();
    let first = folder.start(CONVERT);
    while !folder.path("out/a.rsp.partial").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    // The lock comes right after the folder.
    std::thread::sleep(Duration::from_millis(20));
    let second = folder.run(&CONVERT.replace("--memory 160M", ""));
    let first = first.wait(Duration::from_secs(60));
    assert_eq!(first.code, Some(0), "{first:#?}");
    second.failed(&["out/a.rsp.partial", "another conversion to this output is running"]);
    assert!(folder.read("out/a.rsp") == pack);
}

#[test]
fn a_folder_of_somebody_else_is_left_alone() {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(40).ply());
    folder.write("a.rsp.partial/letter", "dear");
    folder.run("convert hills.ply -o a.rsp").failed(&["a.rsp.partial", "is there already"]);
    assert_eq!(folder.read("a.rsp.partial/letter"), b"dear");
}
