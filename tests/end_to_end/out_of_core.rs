//! Pictures of packs of which only some pages are in memory.

use crate::models::Mesh;
use crate::support::Folder;
use serde_json::Value;

/// A folder with a pack of some hundred pages, and the picture of it with all of them in memory.
fn ring(options: &str) -> (Folder, Vec<u8>) {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(300).ply());
    folder.run(&format!("convert ring.ply -o ring.rsp --page-size 4K --no-proxy {options}")).done();
    folder.run(&format!("{RENDER} -o whole.exr --reorder none")).done();
    let picture = folder.read("whole.exr");
    (folder, picture)
}

const RENDER: &str = "render ring.rsp --size 96x64 --spp 8";

/// The least memory, in MiB, for a picture by so many threads.
fn least(folder: &Folder, order: &str, threads: usize) -> u64 {
    let outcome = folder.run(&format!("{RENDER} -o a.exr --reorder {order} --threads {threads} --memory 1M"));
    let least = outcome.stderr.split("use --memory ").nth(1).and_then(|rest| rest.trim().strip_suffix('M'));
    let least = least.expect("an option that would do").parse().unwrap();
    outcome.failed(&["ring.rsp", "1.0 MiB of memory is too little"]);
    least
}

#[test]
fn the_same_picture_for_any_memory_and_threads() {
    let (folder, whole) = ring("");
    for (threads, more) in [(1, 0), (2, 0), (2, 1), (3, 0), (2, 1000)] {
        let memory = least(&folder, "queues", threads) + more;
        let options = format!("--reorder queues --threads {threads} --memory {memory}M --stats stats.json");
        folder.run(&format!("{RENDER} -o a.exr {options}")).done();
        assert!(folder.read("a.exr") == whole, "{options}");
        let stats: Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
        assert_eq!(stats["ordering"], "queues");
        assert!(stats["peak_rss_bytes"].as_u64().unwrap() <= memory << 20, "{options}: {stats}");
    }
}

#[test]
fn every_integrator_and_packs_with_ids() {
    let (folder, whole) = ring("--keep-ids");
    let memory = least(&folder, "queues", 2);
    for integrator in ["path", "ao", "normal"] {
        let render = |name: &str, options: &str| {
            folder.run(&format!("{RENDER} --integrator {integrator} --threads 2 -o {name} {options}")).done();
            folder.read(name)
        };
        let resident = render("a.exr", "--reorder none");
        assert!(render("b.exr", &format!("--reorder queues --memory {memory}M")) == resident, "{integrator}");
        assert_eq!(resident == whole, integrator == "path");
    }
}

#[test]
fn every_order_of_the_command_line() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(300).ply());
    folder.run("convert ring.ply -o ring.rsp --page-size 4K").done();
    folder.run(&format!("{RENDER} -o whole.exr --reorder none")).done();
    for order in ["none", "origin", "origin-dir", "hph", "hph-dir", "hph-origin --curve hilbert", "chunks"] {
        for memory in [least(&folder, order, 2), 1000] {
            let options = format!("--reorder {order} --threads 2 --memory {memory}M --stats stats.json");
            folder.run(&format!("{RENDER} -o a.exr {options}")).done();
            assert!(folder.read("a.exr") == folder.read("whole.exr"), "{options}");
            let stats: Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
            assert_eq!(Some(stats["ordering"].as_str().unwrap()), order.split(' ').next());
            assert!(stats["peak_rss_bytes"].as_u64().unwrap() <= memory << 20, "{options}: {stats}");
        }
    }
}

#[test]
fn a_damaged_page_ends_it_with_its_name_and_no_picture() {
    let (folder, _) = ring("");
    let mut bytes = folder.read("ring.rsp");
    // Most of the pages, which are most of the file: which of them are read depends on the camera.
    let pages = bytes.len() / 8..bytes.len() / 8 * 7;
    bytes[pages].iter_mut().step_by(1000).for_each(|byte| *byte ^= 1);
    folder.write("ring.rsp", &bytes);
    folder.run(&format!("{RENDER} -o a.exr --reorder queues")).failed(&["ring.rsp", "page", "checksum"]);
    assert!(!folder.path("a.exr").exists());
}

#[test]
fn what_was_done_before_a_page_was_damaged_is_kept() {
    let (folder, whole) = ring("");
    let pack = folder.read("ring.rsp");
    let arguments = "render ring.rsp --size 96x64 --spp 8 -o a.exr --reorder queues --keep-every 0";
    // A picture of some part: killed as soon as something is kept, which is once more begun if it was too late.
    for _ in 0..100 {
        let mut running = folder.start(arguments);
        while !folder.path("a.exr.unfinished").exists() && running.child.try_wait().unwrap().is_none() {}
        running.child.kill().unwrap();
        running.child.wait().unwrap();
        if folder.path("a.exr.unfinished").exists() {
            break;
        }
    }
    let mut damaged = pack.clone();
    let pages = damaged.len() / 8..damaged.len() / 8 * 7;
    damaged[pages].iter_mut().step_by(1000).for_each(|byte| *byte ^= 1);
    folder.write("ring.rsp", &damaged);
    let outcome = folder.run(arguments);
    let words = ["ring.rsp", "checksum", "what was done is in a.exr.unfinished", "goes on from there"];
    assert!(outcome.code == Some(1) && words.iter().all(|w| outcome.stderr.contains(w)), "{outcome:#?}");
    folder.write("ring.rsp", &pack);
    let outcome = folder.run(arguments);
    assert!(outcome.stderr.contains("going on from"), "{outcome:#?}");
    assert!(folder.read("a.exr") == whole);
}

#[test]
fn a_missing_scratch_folder_is_named() {
    let (folder, _) = ring("");
    folder
        .run(&format!("{RENDER} -o a.exr --reorder origin --scratch nowhere"))
        .failed(&["nowhere", "no such folder"]);
}
