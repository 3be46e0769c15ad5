//! Numbers that are lies, with checksums that are right.

use super::reseal::{parts, reseal};
use super::{error_of, sample, sample_with, walk::open_all};
use bytemuck::Pod;
use raystrips_pack::layout::{FOOTER_BYTES, Footer, MAX_PAGE_NODES, Section, SectionEntry};
use raystrips_pack::{Instance, Manifest, Pack, PageEntry, TopEntry, TopNode};
use std::io::{self, Cursor, Read, Seek, SeekFrom};

/// The sample with record `i` of a part changed and all checksums right.
pub fn with<T: Pod>(part: &str, i: usize, change: impl FnOnce(&mut T)) -> Vec<u8> {
    with_at(part, i * size_of::<T>(), change)
}

/// The sample with the record at byte `at` of a part changed and all checksums right.
pub fn with_at<T: Pod>(part: &str, at: usize, change: impl FnOnce(&mut T)) -> Vec<u8> {
    changed(sample(), part, at, change)
}

/// `file` with the record at byte `at` of a part changed and all checksums right.
pub fn changed<T: Pod>(mut file: Vec<u8>, part: &str, at: usize, change: impl FnOnce(&mut T)) -> Vec<u8> {
    let (_, range) = parts(&file).into_iter().find(|(name, _)| name == part).expect("there is such a part");
    let place = range.start + at..range.start + at + size_of::<T>();
    let mut record: T = bytemuck::pod_read_unaligned(&file[place.clone()]);
    change(&mut record);
    file[place].copy_from_slice(bytemuck::bytes_of(&record));
    reseal(&mut file);
    file
}

#[track_caller]
pub fn refused(file: &[u8], why: &str) {
    let error = error_of(file).to_string();
    assert!(error.contains(why), "{error}");
}

#[test]
fn directory_claims_are_checked() {
    let wrong = "page 1: its directory entry is wrong";
    let entry = |change: fn(&mut PageEntry)| with("section 1", 1, change);
    refused(&entry(|e| e.offset = 4096), wrong);
    refused(&entry(|e| e.offset += 4), wrong);
    refused(&entry(|e| e.offset = u64::MAX - 4095), wrong);
    refused(&entry(|e| e.bytes = u32::MAX), wrong);
    refused(&entry(|e| e.first_triangle += 1), wrong);
    refused(&entry(|e| e.node_count = MAX_PAGE_NODES as u32 + 1), wrong);
    let last = |change: fn(&mut PageEntry)| with("section 1", 2, change);
    refused(&last(|e| e.triangle_count += 1), "directory and manifest differ");
    refused(&entry(|e| e.node_count += 1), "not the page that the directory describes");
    refused(&with("section 3", 1, |e: &mut TopEntry| e.node = 1), "leads to no page");
    refused(&with("section 3", 1, |e: &mut TopEntry| e.page = 3), "leads to no page");
}

#[test]
fn section_claims_are_checked() {
    let entry = |change: fn(&mut SectionEntry)| with("section table", 3, change);
    refused(&entry(|s| s.kind = 9), "Emitters section is missing");
    refused(&entry(|s| s.kind = Section::Manifest as u32), "Manifest section is there twice");
    refused(&entry(|s| s.offset += 16), "is not aligned");
    refused(&entry(|s| s.bytes = u64::MAX), "beyond the end");
    refused(&entry(|s| s.bytes = 1 << 40), "beyond the end");
    refused(&entry(|s| s.bytes -= 1), "odd length");
    refused(&with("footer", 0, |f: &mut Footer| f.section_count = u32::MAX), "bad section table");
    refused(&with("footer", 0, |f: &mut Footer| f.sections_offset = u64::MAX), "bad section table");
}

#[test]
fn claims_above_the_pages_are_checked() {
    let top_byte = |i, value: u8| with("section 2", i, move |b: &mut u8| *b = value);
    let top_child = |slot: usize, value: u32| with("section 2", 16 + slot, move |c: &mut u32| *c = value);
    refused(&top_byte(15, 1), "node 0: bad grid");
    refused(&top_byte(12, 0x81), "node 0: bad grid");
    refused(&top_child(0, TopNode::EMPTY), "node 0: no children");
    refused(&top_child(5, TopNode::NODE | 1), "node 0: a child after an empty place");
    refused(&top_child(3, TopNode::NODE | 1), "node 0: bad child");
    refused(&top_child(0, TopNode::NODE), "node 0: bad child");
    refused(&top_child(0, TopNode::NODE | 3), "node 0: bad child");
    refused(&top_child(0, TopNode::NODE | 2), "an instance of what is no tree");
    refused(&top_child(0, TopNode::KIND), "leads to no page");
    refused(&top_child(0, 1), "leads to no page");
    refused(&top_child(0, TopNode::ENTRY), "not one tree");
    refused(&top_child(1, TopNode::ENTRY | 3), "leads to no page");
    refused(&top_child(1, TopNode::ENTRY), "an entry below two nodes");
    refused(&top_child(1, TopNode::INSTANCE | 2), "leads to no instance");
    refused(&top_child(1, TopNode::INSTANCE | 1), "an instance below two nodes");
    refused(
        &with("section 2", 2 * 24 + 16, |c: &mut u32| *c = TopNode::INSTANCE),
        "an instance in an instance",
    );
    refused(&with("section 4", 0, |x: &mut f32| *x = f32::NAN), "corner of an emitter is not finite");
    refused(&with("section 4", 9, |g: &mut u32| *g = 2), "an emitter has no geometry");
    refused(&with("section 5", 4, |id: &mut u8| *id |= 3), "triangle id 1 names a corner");
}

#[test]
fn instance_claims_are_checked() {
    let instance = |change: fn(&mut Instance)| with("section 14", 1, change);
    refused(&instance(|i| i.root = 0), "an instance of what is no tree");
    refused(&instance(|i| i.root = 1), "an instance of what is no tree");
    refused(&instance(|i| i.root = 3), "an instance of what is no tree");
    let no_way_back = "an instance that there is no way back from";
    refused(&instance(|i| i.world_from_local[1] = [0.0; 4]), no_way_back);
    refused(&instance(|i| i.world_from_local[0][0] = 1e-3), no_way_back);
    refused(&instance(|i| i.world_from_local[0][0] = f32::NAN), no_way_back);
    refused(&instance(|i| i.world_from_local[2][3] = f32::INFINITY), no_way_back);
    refused(&sample_with(|m| m.depth = 2), "too deep");
}

#[test]
fn manifest_claims_are_checked() {
    let altered = |alter: fn(&mut Manifest)| sample_with(alter);
    refused(&altered(|m| m.bounds_min[1] = f32::NAN), "bad bounds");
    refused(&altered(|m| m.bounds_max[2] = -1e9), "bad bounds");
    refused(&altered(|m| m.scene_offset[0] = f64::INFINITY), "bad scene offset");
    refused(&altered(|m| m.position_error = f64::NAN), "bad scene offset");
    refused(&altered(|m| m.depth = 129), "too deep");
    refused(&altered(|m| m.depth = 1), "too deep");
    refused(&altered(|m| m.clusters = 1 << 60), "more clusters than strips");
    refused(&altered(|m| m.bytes.vertices = u64::MAX), "byte counts");
    refused(&altered(|m| m.bytes.materials = 1 << 40), "byte counts");
    refused(&altered(|m| m.pages = 4), "directory and manifest differ");
    refused(&altered(|m| m.scene.geometries[1].material = 2), "a geometry has no material");
    refused(&altered(|m| m.scene.geometries.truncate(1)), "an emitter has no geometry");
}

/// Names and lists that claim to be long: refused before memory is taken.
#[test]
fn long_names_are_refused_by_their_length() {
    let length = |bytes: [u8; 9]| with("section 6", 0, move |start: &mut [u8; 9]| *start = bytes);
    refused(&length([252, 0, 0, 0, 0x20, 0, 0, 0, 0]), "LimitExceeded");
    refused(&length([253, 0, 0, 0, 0, 0, 0, 0, 0x10]), "LimitExceeded");
}

/// Numbers count up to eight times their bytes against bincode's limit; the greatest manifests must still pass.
#[test]
fn many_geometries_are_read() {
    for count in [0, 1000, 5000, 100_000] {
        let file = sample_with(|m| m.scene.geometries.resize(2 + count, Default::default()));
        assert_eq!(open_all(&file).unwrap().pack.manifest.scene.geometries.len(), 2 + count);
    }
}

/// A file that fails the test when more is asked of it than it has.
struct Strict(Cursor<Vec<u8>>);

impl Read for Strict {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        assert!(out.len() <= self.0.get_ref().len(), "memory for {} bytes", out.len());
        self.0.read(out)
    }
}

impl Seek for Strict {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn memory_is_bounded_by_the_length_of_the_file() {
    let file = sample();
    let table = file.len() - FOOTER_BYTES - 6 * size_of::<SectionEntry>();
    for i in table..file.len() {
        for bit in 0..8 {
            let mut file = file.clone();
            file[i] ^= 1 << bit;
            reseal(&mut file);
            let _ = Pack::open(&mut Strict(Cursor::new(file)));
        }
    }
}
