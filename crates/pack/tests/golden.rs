//! The bytes of one pack, for ever.
#![allow(clippy::unwrap_used, reason = "a test")]

mod support;

use raystrips_pack::layout::FORMAT_VERSION;

/// These numbers may change only together with `FORMAT_VERSION` (and FORMAT.md), or because the sample itself is
/// changed on purpose: packs that people have must stay readable, and the same scene gives the same bytes.
#[test]
fn bytes_stay_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.rsp");
    support::write_sample(&path, |_| {});
    let file = std::fs::read(path).unwrap();
    assert_eq!((FORMAT_VERSION, file.len(), crc32c::crc32c(&file)), (8, 61_736, 987_566_049));
}
