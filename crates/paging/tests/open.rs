//! Opening packs, sound and damaged.
#![allow(clippy::unwrap_used, reason = "a test")]

#[path = "../../pack/tests/support/mod.rs"]
mod support;

use raystrips_pack::{Pack, PackError};
use raystrips_paging::{OpenError, PageTable};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder with a sound pack.
fn sample() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.rsp");
    support::write_sample(&path, |_| {});
    (folder, path)
}

#[track_caller]
fn error_of(path: &Path) -> OpenError {
    let error = PageTable::open(path).map(|_| ()).expect_err("opens");
    let line = error.to_string();
    assert!(line.starts_with(&format!("{}: ", path.display())), "{line}");
    assert!(!line.contains('\n'), "{line}");
    error
}

/// Flips a bit of the file.
fn damage(path: &Path, at: u64) {
    let mut bytes = fs::read(path).unwrap();
    bytes[at as usize] ^= 0x10;
    fs::write(path, bytes).unwrap();
}

#[test]
fn pages_are_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.rsp");
    let (written, manifest) = support::write_sample(&path, |_| {});
    let table = PageTable::open(&path).unwrap();
    assert_eq!(table.pack().manifest, manifest);
    assert_eq!(table.pack().directory.len(), written.len());
    let file = fs::read(&path).unwrap();
    for ((id, page), entry) in (0..).zip(&written).zip(&table.pack().directory) {
        assert!(file[entry.offset as usize..][..entry.bytes as usize] == page.bytes, "page {id}");
        let view = table.page(id);
        assert_eq!(view.nodes().len() as u32, page.node_count);
        assert_eq!(view.cluster_count() as u64, page.cluster_count);
        assert_eq!(view.strip_count() as u64, page.strip_count);
    }
    let ids = table.triangle_ids().chunks_exact(4).map(|id| u32::from_le_bytes(id.try_into().unwrap()));
    assert!(ids.eq((0..manifest.primitives as u32).map(|i| i * 4 + i % 3)));
}

#[test]
fn a_damaged_page_is_named() {
    let (_folder, path) = sample();
    let entry = Pack::open(&mut File::open(&path).unwrap()).unwrap().directory[1];
    for at in [0, 20, entry.bytes as u64 / 2, entry.bytes as u64 - 1] {
        damage(&path, entry.offset + at);
        let error = error_of(&path);
        assert!(error.to_string().contains("page 1"), "{error}");
        assert!(matches!(error.source, PackError::CorruptPage { page: 1, .. }));
        damage(&path, entry.offset + at);
    }
    PageTable::open(&path).map(|_| ()).expect("it is repaired");
}

#[test]
fn of_several_damaged_pages_the_first_is_named() {
    let (_folder, path) = sample();
    let directory = Pack::open(&mut File::open(&path).unwrap()).unwrap().directory;
    directory.iter().for_each(|entry| damage(&path, entry.offset));
    assert!(error_of(&path).to_string().contains("page 0"));
}

#[test]
fn damaged_ids_are_found() {
    let (_folder, path) = sample();
    let (offset, bytes) = Pack::open(&mut File::open(&path).unwrap()).unwrap().triangle_ids();
    damage(&path, offset + bytes - 1);
    assert!(error_of(&path).to_string().contains("TriangleIds"));
}

#[test]
fn what_is_no_pack_is_named_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.rsp");
    let PackError::Io(error) = error_of(&missing).source else { panic!("other error") };
    assert_eq!(error.kind(), std::io::ErrorKind::NotFound);
    error_of(folder.path());
    let path = folder.path().join("file");
    for content in ["", "v 0 0 0\n"] {
        fs::write(&path, content).unwrap();
        assert!(matches!(error_of(&path).source, PackError::NotAPack));
    }
}

#[test]
fn a_cut_pack_is_refused() {
    let (_folder, path) = sample();
    let file = File::options().write(true).open(&path).unwrap();
    for length in (1..file.metadata().unwrap().len()).rev().step_by(997) {
        file.set_len(length).unwrap();
        assert!(matches!(error_of(&path).source, PackError::Corrupt(_)));
    }
}

/// A pack is a file like any other: readable by others where the umask lets them.
#[cfg(unix)]
#[test]
fn a_pack_has_the_permissions_of_other_files() {
    use std::os::unix::fs::PermissionsExt;
    let (folder, path) = sample();
    let other = folder.path().join("other");
    fs::write(&other, "").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&path), mode(&other));
}
