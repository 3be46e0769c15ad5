//! Lies in pages, with checksums that are right.

use super::claims::{refused, with, with_at};
use super::sample;
use super::walk::{aligned, open_all};
use raystrips_pack::layout::{
    ClusterHeader, GeometryRun, MAX_PAGE_CLUSTERS, MAX_PAGE_STRIPS, PageHeader, WideNode,
};
use raystrips_pack::{PackError, PageEntry, PageView, STRAND_RECORD_BYTES, StrandCode, check_page};

// Where things are in page 0 of the sample, which has two clusters, three nodes and three strips.
const CLUSTERS: usize = size_of::<PageHeader>();
const PLACES: usize = CLUSTERS + 2 * size_of::<ClusterHeader>();
/// The first strip has five windows: a count, four splits, then heads, then 30 refs.
const STRIP: usize = PLACES + 3 * 4;
const SPLITS: usize = STRIP + 1;
const HEADS: usize = SPLITS + 4 * 4;
const REFS: usize = HEADS + 5;
/// Of cluster 0, after its second strip of five bytes: 35 vertices of two bytes.
const VERTICES: usize = (REFS + 30 + 5).next_multiple_of(4);
const RUNS: usize = VERTICES + 72;
/// Of cluster 1: a strip of 19 bytes, 12 vertices, one run.
const LAST_VERTICES: usize = (RUNS + 2 * size_of::<GeometryRun>() + 19).next_multiple_of(4);
const NODES: usize = (LAST_VERTICES + 24 + size_of::<GeometryRun>()).next_multiple_of(64);

// Where things are in page 1, which has one cluster of vertices of five bytes, one node and three strips of one window.
const ONLY_STRIPS: usize = (CLUSTERS + size_of::<ClusterHeader>()).next_multiple_of(9);
const ONLY_VERTICES: usize = (ONLY_STRIPS + 3 * 9).next_multiple_of(4);

// Where things are in page 2, which has one cluster, one node and three windows of strands, the last one after the first.
const WINDOWS: usize = CLUSTERS + size_of::<ClusterHeader>();
const STRANDS: usize = (WINDOWS + 3 * STRAND_RECORD_BYTES).next_multiple_of(4);
const PAIRS: usize = STRANDS + size_of::<StrandCode>();

/// The sample with byte `at` of page 0 changed.
fn byte(at: usize, value: u8) -> Vec<u8> {
    with("page 0", at, move |b: &mut u8| *b = value)
}

/// The sample with the window of a strand with this number changed.
fn window(number: usize, change: fn(&mut [u8; STRAND_RECORD_BYTES])) -> Vec<u8> {
    with_at("page 2", WINDOWS + number * STRAND_RECORD_BYTES, change)
}

/// The sample with byte `at` of page 1 changed.
fn byte_of_1(at: usize, value: u8) -> Vec<u8> {
    with("page 1", at, move |b: &mut u8| *b = value)
}

#[test]
fn parts_are_where_these_tests_think() {
    let opened = open_all(&sample()).unwrap();
    let pages = opened.pages();
    let offset =
        |page: &PageView, part: &[u8]| part.as_ptr().addr() - std::ptr::from_ref(page.header()).addr();
    let places = [
        offset(&pages[0], pages[0].cluster(0).vertex_bytes()),
        offset(&pages[0], bytemuck::cast_slice(pages[0].cluster(0).runs())),
        offset(&pages[0], pages[0].cluster(1).vertex_bytes()),
        offset(&pages[0], bytemuck::cast_slice(pages[0].nodes())),
        offset(&pages[0], pages[0].strip(0).heads()),
        offset(&pages[0], pages[0].strip(0).refs()),
        offset(&pages[1], pages[1].cluster(0).vertex_bytes()),
        offset(&pages[1], pages[1].strip(ONLY_STRIPS / 9).heads()),
        offset(&pages[2], pages[2].strip(0).heads()),
        offset(&pages[2], pages[2].cluster(0).vertex_bytes()),
        offset(&pages[2], pages[2].cluster(0).pair_bytes()),
    ];
    let expected = [
        VERTICES,
        RUNS,
        LAST_VERTICES,
        NODES,
        HEADS,
        REFS,
        ONLY_VERTICES,
        ONLY_STRIPS,
        WINDOWS,
        STRANDS,
        PAIRS,
    ];
    assert_eq!(places, expected);
}

#[test]
fn page_headers_are_checked() {
    let page = |change: fn(&mut PageHeader)| with("page 0", 0, change);
    refused(&page(|p| p.last_node -= 1), "not the page that the directory describes");
    refused(&page(|p| p.last_node = u16::MAX), "shorter than its nodes");
    refused(&page(|p| p.triangle_count += 1), "not the page that the directory describes");
    refused(&page(|p| p.first_triangle += 1), "not the page that the directory describes");
    refused(&page(|p| p.cluster_count -= 1), "strip 0 is not where");
    refused(&page(|p| p.cluster_count = 257), "shorter than its cluster table");
    refused(&page(|p| p.grid_origin[1] = f32::NAN), "bad grid");
    refused(&page(|p| p.grid_exponent[2] = -127), "bad grid");
    refused(&page(|p| p.grid_exponent[2] = 127), "bad grid");
    refused(&page(|p| p.max_windows = 0), "cluster 0: bad header");
    refused(&with("page 1", 0, |p: &mut PageHeader| p.max_windows = 0), "cluster 0: wrong number");
    refused(&with("page 2", 0, |p: &mut PageHeader| p.max_windows = 1), "cluster 0: wrong number");
    refused(&with("page 2", 0, |p: &mut PageHeader| p.max_windows = 2), "strip 0 is not where");
    refused(&page(|p| p.max_windows = 1), "cluster 0: wrong number");
    refused(&page(|p| p.max_windows = 4), "strip 0 is longer than its page says");
    refused(&with("page 1", 0, |p: &mut PageHeader| p.max_windows = 2), "cluster 0: wrong number");
    refused(&page(|p| p.strip_count -= 1), "strip 0 is not where");
    refused(&page(|p| p.strip_count = u32::MAX), "more clusters or strips");
    refused(&with("page 1", 0, |p: &mut PageHeader| p.strip_count += 1), "clusters and page differ");
    refused(
        &with("page 1", 0, |p: &mut PageHeader| p.strip_count -= 1),
        "strips that the page does not have",
    );
    refused(&page(|p| p.nodes_offset += 4), "not aligned in memory");
    refused(&page(|p| p.nodes_offset -= 64), "bytes left over");
    refused(&page(|p| p.nodes_offset = 0), "bytes left over");
    refused(&page(|p| p.nodes_offset = u32::MAX), "shorter than its nodes");
    refused(&page(|p| p.turn[3] = 0.5), "bad header");
    refused(&page(|p| p.turn[0] = f32::NAN), "bad header");
    refused(&page(|p| p.turn[1] = f32::INFINITY), "bad header");
}

/// Lengths that differ from what the parts of a page need.
#[test]
fn lengths_are_checked() {
    let length = |change: fn(&mut u32)| with("section 1", 0, move |e: &mut PageEntry| change(&mut e.bytes));
    refused(&length(|b| *b += 1), "page 0: bytes left over");
    // All parts are there, but not all that may be loaded with the last vertex.
    refused(&length(|b| *b -= 1), "cluster 1: cut off");
    refused(&length(|b| *b = NODES as u32), "shorter than its nodes");
    refused(
        &length(|b| *b = (CLUSTERS + 2 * size_of::<ClusterHeader>()) as u32 - 1),
        "shorter than its cluster table",
    );
    refused(&length(|b| *b = 63), "shorter than its header");
    refused(&length(|b| *b = 0), "shorter than its header");
}

#[test]
fn cluster_headers_are_checked() {
    let first = |change: fn(&mut ClusterHeader)| with_at("page 0", CLUSTERS, change);
    refused(&first(|c| c.offset += 4), "cluster 0: bad header");
    refused(&first(|c| c.offset += 1), "cluster 0: cut off");
    refused(&first(|c| c.offset = u32::MAX - 3), "cluster 0: cut off");
    refused(&first(|c| c.first_triangle = 1), "cluster 0: wrong number");
    refused(&first(|c| c.first_strip = 1), "cluster 0: wrong number");
    refused(&first(|c| c.triangle_count -= 1), "cluster 0: strips do not add up");
    refused(&first(|c| c.strip_count = 0), "cluster 0: bad header");
    refused(&first(|c| c.strip_count = u16::MAX), "cluster 0: strips that the page does not have");
    refused(&first(|c| c.run_count = 0), "cluster 0: geometry runs do not add up");
    refused(&first(|c| c.run_count += 1), "cluster 0: bad geometry run");
    refused(&first(|c| c.run_count = u16::MAX), "cluster 0: cut off");
    let only = |change: fn(&mut ClusterHeader)| with_at("page 1", CLUSTERS, change);
    refused(&only(|c| c.first_strip += 1), "cluster 0: wrong number");
    refused(&only(|c| c.strip_count += 1), "cluster 0: strips that the page does not have");
    let last =
        |change: fn(&mut ClusterHeader)| with_at("page 0", CLUSTERS + size_of::<ClusterHeader>(), change);
    refused(&last(|c| c.first_strip -= 1), "cluster 1: wrong number");
    refused(&last(|c| c.strip_count += 1), "cluster 1: strips that the page does not have");
    refused(&last(|c| c.code.last -= 1), "refers to a vertex");
    refused(&last(|c| c.code.last += 1), "cluster 1: bad geometry run");
    refused(&last(|c| c.code.last = 255), "cluster 1: bad geometry run");
}

#[test]
fn codes_of_vertices_are_checked() {
    let bad = |change: fn(&mut ClusterHeader)| {
        refused(&with_at("page 0", CLUSTERS, change), "cluster 0: bad code of vertices");
        refused(&with_at("page 1", CLUSTERS, change), "cluster 0: bad code of vertices");
    };
    bad(|c| c.code.bits[2] = 31);
    bad(|c| c.code.bits = [255; 3]);
    bad(|c| c.code.stride += 1);
    bad(|c| c.code.stride = 0);
    bad(|c| c.code.exponent[0] = 97);
    bad(|c| c.code.exponent[0] = -127);
    bad(|c| c.code.exponent[0] = -128);
    bad(|c| c.code.anchor[0] = i32::MAX);
    let float = |change: fn(&mut ClusterHeader)| with_at("page 1", CLUSTERS, change);
    refused(&float(|c| c.code.anchor[2] = 1), "bad code of vertices");
    refused(&float(|c| c.code.exponent[2] = 0), "bad code of vertices");
    let nan = with_at("page 1", ONLY_VERTICES, |vertex: &mut [u8; 5]| *vertex = [255; 5]);
    refused(&nan, "a vertex is not finite");
}

#[test]
fn runs_are_checked() {
    refused(&byte(RUNS, 2), "cluster 0: bad geometry run");
    refused(&byte(RUNS + 4, 0), "cluster 0: bad geometry run");
    refused(&byte(RUNS + 12, 40), "cluster 0: geometry runs do not add up");
}

#[test]
fn strips_are_checked() {
    refused(&byte(PLACES, 0), "strip 0 is not where");
    refused(&byte(PLACES, 13), "strip 0 is not where");
    refused(&byte(PLACES + 7, 0xFF), "strip 1 is not where");
    refused(&byte(STRIP, 0), "strip 0 cut off");
    refused(&byte(STRIP, 4), "strip 1 is not where");
    refused(&byte(STRIP, 6), "strip 0 is longer");
    refused(&byte(STRIP, 255), "strip 0 is longer");
    refused(&byte(SPLITS, 3), "strip 0: bad split");
    refused(&byte(SPLITS + 4 * 3 + 3, 0x80), "strip 0: bad split");
    refused(&byte(HEADS, 0x00), "strip 0: bad number of triangles");
    refused(&byte(HEADS, 0xC0), "strip 0: bad number of triangles");
    refused(&byte(HEADS + 4, 0xE0), "strip 1 is not where");
    refused(&byte(REFS, 35), "strip 0: refers to a vertex");
}

#[test]
fn strips_of_one_window_are_checked() {
    refused(&byte_of_1(ONLY_STRIPS, 0x80), "strips do not add up");
    refused(&byte_of_1(ONLY_STRIPS, 0xC0), "strip 12: bad number of triangles");
    refused(&byte_of_1(ONLY_STRIPS + 9, 0xE0), "strip 13: bad number of triangles");
    refused(&byte_of_1(ONLY_STRIPS + 1, 20), "strip 12: refers to a vertex");
    // The last one of a short strip, which no triangle uses.
    refused(&byte_of_1(ONLY_STRIPS + 3 * 9 - 1, 20), "strip 14: refers to a vertex");
}

#[test]
fn nodes_are_checked() {
    let node =
        |i: usize, change: fn(&mut WideNode)| with_at("page 0", NODES + i * size_of::<WideNode>(), change);
    refused(&node(0, |n| n.exponent[0] = -127), "node 0: bad grid");
    refused(&node(0, |n| n.exponent[1] = 127), "node 0: bad grid");
    refused(&node(0, |n| n.reserved = 1), "node 0: bad grid");
    refused(&node(0, |n| n.reserved_too = 1), "node 0: bad grid");
    refused(&node(0, |n| n.count = 0), "node 0: bad number of children");
    refused(&node(0, |n| n.count = 9), "node 0: bad number of children");
    refused(&node(1, |n| n.count = WideNode::STRIPS), "node 1: bad number of children");
    refused(&node(1, |n| n.count = 255), "node 1: bad number of children");
    refused(&node(0, |n| n.first = 0), "node 0: bad child");
    refused(&node(0, |n| n.first = 2), "node 0: bad child");
    refused(&node(0, |n| n.first = u16::MAX), "node 0: bad child");
    refused(&node(1, |n| n.count = 1), "node 1: bad child");
    refused(&node(0, |n| n.cluster = 1), "node 0: names a cluster");
    refused(&node(1, |n| n.cluster = 2), "node 1: no such cluster");
    refused(&node(1, |n| n.cluster = 1), "node 1: a strip that is not of its cluster");
    refused(&node(1, |n| n.first = 1), "node 1: a strip that is not of its cluster");
    refused(&node(2, |n| n.first = u16::MAX), "node 2: a strip that is not of its cluster");
    refused(&node(2, |n| n.count += 1), "node 2: a strip that is not of its cluster");
}

#[test]
fn pages_with_more_than_can_be_named_are_refused() {
    let header = PageHeader { max_windows: 1, nodes_offset: 1 << 20, ..bytemuck::Zeroable::zeroed() };
    let many = [
        PageHeader { cluster_count: MAX_PAGE_CLUSTERS as u16 + 1, ..header },
        PageHeader { strip_count: MAX_PAGE_STRIPS as u32 + 1, ..header },
    ];
    for header in many {
        let mut bytes = vec![0; 1 << 21];
        bytes[..size_of::<PageHeader>()].copy_from_slice(bytemuck::bytes_of(&header));
        let entry = PageEntry {
            offset: 4096,
            first_triangle: 0,
            bytes: bytes.len() as u32,
            checksum: crc32c::crc32c(&bytes),
            triangle_count: 0,
            node_count: 1,
        };
        let memory = aligned(&bytes);
        let bytes = &bytemuck::cast_slice(&memory)[..bytes.len()];
        let error = check_page(bytes, 0, &entry, 1, 128).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("page 0: more clusters or strips"), "{error}");
    }
}

#[test]
fn pages_not_aligned_in_memory_are_refused() {
    let file = sample();
    let entry = open_all(&file).unwrap().pack.directory[0];
    let page = &file[entry.offset as usize..][..entry.bytes as usize];
    for shift in [1, 4, 8, 32] {
        let memory = aligned(&[&vec![0; shift], page].concat());
        let moved = &bytemuck::cast_slice(&memory)[shift..shift + page.len()];
        let error = check_page(moved, 0, &entry, 2, 4).map(|_| ()).unwrap_err();
        assert!(matches!(error, PackError::CorruptPage { page: 0, .. }), "{error}");
    }
}

#[test]
fn windows_of_strands_are_checked() {
    refused(&window(0, |w| w[0] = 0x83), "strip 0: no window of a strand");
    refused(&window(0, |w| w[0] |= 1 << 4), "strip 0: no window of a strand");
    refused(&window(0, |w| w[0] = 0xE8 | 4), "strip 0: too many segments");
    refused(&window(1, |w| w[0] = 0xE0 | 7), "strip 1: too many segments");
    refused(&window(1, |w| w[0] = 0xE8 | 4), "strip 1: too many segments");
    refused(&window(0, |w| w[0] -= 1), "strips do not add up");
    refused(&window(1, |w| w[1] = 2), "strip 1: refers to a pair");
    refused(&window(1, |w| w[1] = 255), "strip 1: refers to a pair");
    refused(&byte(HEADS, 7 << 5), "strip 0");
}

#[test]
fn codes_of_strands_are_checked() {
    let code = |change: fn(&mut StrandCode)| with_at("page 2", STRANDS, change);
    refused(&code(|c| c.step[0] = 33), "cluster 0: bad code of strands");
    refused(&code(|c| c.bend[3] = 255), "cluster 0: bad code of strands");
    refused(&code(|c| c.rest[2] += 1), "cluster 0: bad code of strands");
    refused(&code(|c| c.radius_bits = 9), "cluster 0: bad code of strands");
    refused(&code(|c| c.order = 0), "cluster 0: bad code of strands");
    refused(&code(|c| c.order = 4), "cluster 0: bad code of strands");
    refused(&code(|c| c.reach[0] = 0), "cluster 0: bad code of strands");
    refused(&code(|c| c.reach[0] = 7), "cluster 0: bad code of strands");
    refused(&code(|c| c.reach[1] = 7), "cluster 0: bad code of strands");
    refused(&code(|c| c.reach[1] = 0), "cluster 0: bad code of strands");
    let header = |change: fn(&mut ClusterHeader)| with_at("page 2", CLUSTERS, change);
    refused(&header(|c| c.code.stride += 1), "cluster 0: bad code of strands");
    refused(&header(|c| c.code.bits[2] = 31), "cluster 0: bad code of vertices");
    refused(&header(|c| c.code.exponent[0] = 97), "cluster 0: bad code of vertices");
    refused(&header(|c| c.code.last += 1), "cluster 0: bad geometry run");
    refused(&header(|c| c.code.last = 255), "cluster 0: cut off");
    refused(&header(|c| c.first_strip += 1), "cluster 0: wrong number");
    // z of a middle, in bits of which none is free, is a float.
    let nan = with_at("page 2", PAIRS, |bytes: &mut [u8; 8]| *bytes = [255; 8]);
    refused(&nan, "a point is not finite");
    let radii = |change: fn(&mut PageHeader)| with("page 2", 0, change);
    refused(&radii(|p| p.radius_base = 0), "radii");
    refused(&radii(|p| p.radius_base = f32::INFINITY.to_bits()), "radii");
    refused(&radii(|p| p.radius_base = u32::MAX), "radii");
    refused(&radii(|p| p.radius_shift = 24), "radii");
    refused(&radii(|p| p.radius_shift = 25), "radii");
    refused(&radii(|p| p.radius_shift = u32::MAX), "radii");
}
