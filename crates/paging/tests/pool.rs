//! Pages that come and go.
#![allow(clippy::unwrap_used, reason = "a test")]

#[path = "../../pack/tests/support/mod.rs"]
mod support;

use raystrips_extmem::BlockBuffer;
use raystrips_pack::{PackError, PageId};
use raystrips_paging::{PagePool, PageTable};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

fn sample() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.rsp");
    support::write_sample(&path, |_| {});
    (folder, path)
}

#[test]
fn pages_go_for_others_but_not_while_they_are_looked_at() {
    let (_folder, path) = sample();
    let all = PageTable::open(&path).unwrap();
    let directory = &all.pack().directory;
    assert!(directory.len() >= 2);
    // Room for the largest page alone.
    let largest = directory.iter().map(|page| u64::from(page.bytes)).max().unwrap();
    let pool = PagePool::open(&path, largest.next_multiple_of(4096), 1 << 20).unwrap();
    for id in 0..directory.len() as PageId {
        assert!(pool.visit().page(id).is_none());
        assert!(pool.load(&[id], &mut BlockBuffer::default()).unwrap());
        let visit = pool.visit();
        let page = visit.page(id).unwrap();
        assert_eq!(bytemuck::bytes_of(page.header()), bytemuck::bytes_of(all.page(id).header()));
        let other = (id + 1) % directory.len() as PageId;
        assert!(!pool.load(&[other], &mut BlockBuffer::default()).unwrap(), "the visit holds all memory");
        assert_eq!(visit.page(id).unwrap().strip_count(), all.page(id).strip_count());
    }
    let counts = pool.counts();
    assert_eq!((counts.read, counts.hits), (directory.len() as u64, directory.len() as u64));
    assert_eq!(counts.bytes_read, directory.iter().map(|page| u64::from(page.bytes)).sum::<u64>());
}

#[test]
fn damaged_and_missing_pages_are_named() {
    let (_folder, path) = sample();
    let pool = PagePool::open(&path, 1 << 20, 1 << 20).unwrap();
    let entry = pool.pack().directory[1];
    let mut bytes = fs::read(&path).unwrap();
    bytes[entry.offset as usize + 40] ^= 1;
    fs::write(&path, &bytes).unwrap();
    assert!(pool.load(&[0], &mut BlockBuffer::default()).unwrap());
    let error = pool.load(&[1], &mut BlockBuffer::default()).unwrap_err();
    assert!(matches!(error.source, PackError::CorruptPage { page: 1, .. }), "{error}");
    bytes.truncate(entry.offset as usize + 100);
    fs::write(&path, bytes).unwrap();
    let error = pool.load(&[1], &mut BlockBuffer::default()).unwrap_err();
    assert!(matches!(error.source, PackError::Io(_)) && error.path == path, "{error}");
}

#[test]
fn memory_is_lent_and_comes_back() {
    let (_folder, path) = sample();
    let pack = PageTable::open(&path).unwrap();
    let frame = PagePool::frame_bytes(pack.pack());
    let pool = PagePool::open(&path, 2 * frame, 1 << 20).unwrap();
    let load = |pages: &[PageId]| pool.load(pages, &mut BlockBuffer::default()).unwrap();
    assert!(load(&[0]) && load(&[1]) && pool.capacity() == 2);
    // A page goes for it, but none that is looked at.
    let visit = pool.visit();
    visit.page(1).unwrap();
    assert!(pool.lend(2 * frame + 1).is_none() && pool.lend(frame + 1).is_none());
    let mut loan = pool.lend(frame).unwrap();
    assert_eq!((loan.bytes(), pool.bytes(), pool.capacity()), (frame, frame, 1));
    assert!(visit.page(0).is_none() && !load(&[0]));
    drop(visit);
    loan.shrink(4096);
    assert_eq!((loan.bytes(), pool.bytes()), (4096, 2 * frame - 4096));
    drop(loan);
    assert!(load(&[0]) && load(&[1]) && pool.capacity() == 2);
    assert!(pool.visit().page(0).is_some());
}
