//! Packs that are damaged, cut or something else.

use crate::models::Mesh;
use crate::rays;
use crate::support::Folder;

/// Every verb that reads pages.
const VERBS: [&str; 3] =
    ["verify bad.rsp", "trace bad.rsp --rays rays -o out", "render bad.rsp -o out.png --size 8x8 --spp 1"];

/// A folder with rays, and the bytes of a good pack of many pages.
fn good_pack() -> (Folder, Vec<u8>) {
    let folder = Folder::new();
    folder.write("hills.ply", Mesh::hills(40).ply());
    folder.write("rays", rays::encode(&rays::onto(40, 10)));
    folder.run("convert hills.ply -o good.rsp --keep-ids --page-size 4K").done();
    let bytes = folder.read("good.rsp");
    (folder, bytes)
}

fn number(bytes: &[u8], at: usize, width: usize) -> usize {
    bytes[at..at + width].iter().rev().fold(0, |n, byte| n << 8 | usize::from(*byte))
}

/// Offset and length of every page, read by FORMAT.md: footer, section table, page directory.
fn pages(pack: &[u8]) -> Vec<(usize, usize)> {
    let footer = pack.len() - 32;
    let (table, count) = (number(pack, footer, 8), number(pack, footer + 8, 4));
    let mut entries = (0..count).map(|i| table + 24 * i);
    let directory = entries.find(|&at| number(pack, at, 4) == 1).unwrap();
    let (offset, bytes) = (number(pack, directory + 8, 8), number(pack, directory + 16, 8));
    (offset..offset + bytes).step_by(32).map(|at| (number(pack, at, 8), number(pack, at + 16, 4))).collect()
}

/// Every verb refuses `bytes` with one line that holds `words`, and writes nothing.
fn all_refuse(folder: &Folder, bytes: &[u8], words: &[&str]) {
    folder.write("bad.rsp", bytes);
    for verb in VERBS {
        folder.run(verb).failed(&[&["bad.rsp"], words].concat());
    }
    assert!(!folder.path("out").exists() && !folder.path("out.png").exists());
}

#[test]
fn the_good_pack_is_good() {
    let (folder, good) = good_pack();
    assert!(pages(&good).len() > 4);
    folder.write("bad.rsp", &good);
    VERBS.into_iter().for_each(|verb| drop(folder.run(verb).done()));
}

#[test]
fn a_flipped_byte_is_found_and_its_page_named() {
    let (folder, good) = good_pack();
    let pages = pages(&good);
    for page in [0, 1, pages.len() / 2, pages.len() - 1] {
        let (offset, bytes) = pages[page];
        for at in [offset, offset + bytes / 2, offset + bytes - 1] {
            let mut bad = good.clone();
            bad[at] ^= 0x40;
            all_refuse(&folder, &bad, &[&format!("page {page}:")]);
        }
    }
    // What is in it can still be told.
    folder.run("info bad.rsp --json").done();
}

#[test]
fn damage_outside_of_pages_is_found() {
    let (folder, good) = good_pack();
    let end = good.len();
    let (last_page, last_bytes) = *pages(&good).last().unwrap();
    let sections = (last_page + last_bytes).next_multiple_of(4096);
    for at in [0, 8, 12, sections, sections + 40, end - 33, end - 32, end - 16, end - 1] {
        let mut bad = good.clone();
        bad[at] ^= 1;
        all_refuse(&folder, &bad, &[]);
        folder.run("info bad.rsp").failed(&["bad.rsp"]);
    }
}

#[test]
fn cut_and_lengthened_packs() {
    let (folder, good) = good_pack();
    for bytes in [0, 1, 15, 16, 4096, good.len() / 2, good.len() - 1] {
        all_refuse(&folder, &good[..bytes], &[]);
        folder.run("info bad.rsp").failed(&["bad.rsp"]);
    }
    all_refuse(&folder, &[&good[..], b"x"].concat(), &[]);
}

#[test]
fn no_pack_at_all() {
    let (folder, good) = good_pack();
    all_refuse(&folder, &Mesh::cuboid([1.0; 3]).ply(), &["not a raystrips pack"]);
    let mut newer = good;
    newer[8] = 77;
    all_refuse(&folder, &newer, &["77", "convert the model again"]);
    for verb in VERBS.into_iter().chain(["info bad.rsp"]) {
        folder.run(&verb.replace("bad.rsp", "missing.rsp")).failed(&["missing.rsp"]);
        folder.run(&verb.replace("bad.rsp", ".")).failed(&[]);
    }
}

#[test]
fn verify_tells_by_its_exit_status() {
    let (folder, mut bytes) = good_pack();
    let good = folder.run("verify good.rsp").done();
    assert_eq!(good.code, Some(0));
    let (at, _) = pages(&bytes)[2];
    bytes[at] ^= 1;
    folder.write("bad.rsp", &bytes);
    let bad = folder.run("verify bad.rsp");
    assert_eq!(bad.code, Some(1));
    bad.failed(&["page 2"]);
}

#[test]
fn damage_in_a_proxy_is_found() {
    let folder = Folder::new();
    folder.write("ring.ply", Mesh::ring(300).ply());
    folder.run("convert ring.ply -o good.rsp --proxy-ratio 0.2").done();
    let good = folder.read("good.rsp");
    let footer = good.len() - 32;
    let (table, count) = (number(&good, footer, 8), number(&good, footer + 8, 4));
    let sections = (0..count)
        .map(|i| [0, 8, 16].map(|at| number(&good, table + 24 * i + at, if at == 0 { 4 } else { 8 })));
    let proxies: Vec<_> = sections.filter(|[kind, ..]| matches!(kind, 8 | 9)).collect();
    assert_eq!(proxies.len(), 2);
    for [_, offset, bytes] in proxies {
        for at in [0, bytes / 3, bytes - 1] {
            let mut bad = good.clone();
            bad[offset + at] ^= 4;
            folder.write("bad.rsp", &bad);
            folder.run("verify bad.rsp").failed(&["bad.rsp", "proxy"]);
        }
    }
}
