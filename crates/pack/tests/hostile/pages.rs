//! Lies in pages, with checksums that are right.

use super::claims::{refused, with};
use super::{sample, walk::open_all};
use raystrips_pack::layout::{
    ClusterHeader, GeometryRun, MAX_PAGE_CLUSTERS, MAX_PAGE_NODES, PageHeader, WideNode,
};
use raystrips_pack::{PackError, PageEntry, check_page};

// Where things are in page 0 of the sample, which has three nodes and two clusters.
const NODES: usize = size_of::<PageHeader>();
const CLUSTERS: usize = NODES + 3 * size_of::<WideNode>();
const RUNS: usize = CLUSTERS + 2 * size_of::<ClusterHeader>();
const STRIPS: usize = RUNS + 2 * size_of::<GeometryRun>();
/// The first strip has five windows: a count, four splits, then turns, then refs.
const TURNS: usize = STRIPS + 1 + 4 * 3;
const REFS: usize = TURNS + 5;

/// The sample with byte `at` of page 0 changed.
fn byte(at: usize, value: u8) -> Vec<u8> {
    with("page", at, move |b: &mut u8| *b = value)
}

/// The sample with a child of a node of page 0 changed.
fn child(node: usize, slot: usize, value: u16) -> Vec<u8> {
    let at = NODES + node * size_of::<WideNode>() + 64 + slot * 2;
    with("page", at / 2, move |c: &mut u16| *c = value)
}

#[test]
fn headers_are_checked() {
    let page = |change: fn(&mut PageHeader)| with("page", 0, change);
    refused(&page(|p| p.node_count -= 1), "not the page that the directory describes");
    refused(&page(|p| p.first_triangle += 1), "not the page that the directory describes");
    refused(&page(|p| p.cluster_count -= 1), "cluster 0: bad header");
    let cluster = |change: fn(&mut ClusterHeader)| with("page", CLUSTERS / 16, change);
    refused(&cluster(|c| c.offset += 4), "cluster 0: bad header");
    refused(&cluster(|c| c.reserved = 1), "cluster 0: bad header");
    refused(&cluster(|c| c.first_triangle = 1), "cluster 0: wrong number");
    refused(&cluster(|c| c.triangle_count -= 1), "cluster 0: strips do not add up");
    refused(&cluster(|c| c.strip_bytes += 4), "cluster 0: ");
    refused(&cluster(|c| c.strip_bytes = 65532), "cluster 0: strips cut off");
    let last = |change: fn(&mut ClusterHeader)| with("page", CLUSTERS / 16 + 1, change);
    refused(&last(|c| c.last_vertex -= 1), "refers to a vertex");
    refused(&last(|c| c.last_vertex += 1), "cluster 1: vertices cut off");
    refused(&with("section 1", 0, |e: &mut PageEntry| e.bytes += 4), "page 0: bytes left over");
}

#[test]
fn clusters_are_checked() {
    refused(&byte(RUNS, 2), "cluster 0: bad geometry run");
    refused(&byte(RUNS + 4, 0), "cluster 0: bad geometry run");
    refused(&byte(RUNS + 12, 40), "cluster 0: geometry runs do not add up");
    refused(&byte(STRIPS, 0), "strip at 0 cut off");
    refused(&byte(STRIPS + 1, 3), "strip at 0: bad split");
    refused(&byte(STRIPS + 1, 8), "strip at 0: bad split");
    refused(&byte(TURNS, 1), "strip at 0: bad turn bits");
    refused(&byte(TURNS, 64), "strip at 0: bad turn bits");
    refused(&byte(REFS, 35), "strip at 0: refers to a vertex");
    let page = super::reseal::parts(&sample()).into_iter().find(|(name, _)| name == "page").unwrap().1;
    refused(&with("page", page.len() / 4 - 1, |x: &mut f32| *x = f32::INFINITY), "a vertex is not finite");
}

#[test]
fn nodes_are_checked() {
    refused(&byte(NODES + 12, 0x81), "node 0: bad grid");
    refused(&byte(NODES + 13, 0x7F), "node 0: bad grid");
    refused(&with("page", NODES / 4, |x: &mut f32| *x = f32::NAN), "node 0: bad grid");
    refused(&child(0, 0, WideNode::EMPTY), "node 0: no children");
    refused(&child(0, 3, 1), "node 0: a child after an empty place");
    refused(&child(0, 1, 1), "node 0: bad child");
    refused(&child(1, 0, 1), "node 1: bad child");
    refused(&child(0, 1, 3), "node 0: bad child");
    refused(&child(1, 0, WideNode::LEAF | 1), "node 1: no strip begins");
    refused(&byte(NODES + size_of::<WideNode>() + 15, 2), "node 1: no such cluster");
}

/// A page of zeros with a header, and its directory entry.
fn page(header: PageHeader) -> (Vec<u32>, PageEntry) {
    let mut words = vec![0u32; 1 << 20];
    words[..4].copy_from_slice(bytemuck::cast_slice(bytemuck::bytes_of(&header)));
    let bytes: &[u8] = bytemuck::cast_slice(&words);
    let entry = PageEntry {
        offset: 4096,
        first_triangle: header.first_triangle,
        bytes: bytes.len() as u32,
        checksum: crc32c::crc32c(bytes),
        triangle_count: header.triangle_count,
        node_count: header.node_count.into(),
    };
    (words, entry)
}

#[test]
fn pages_with_more_than_can_be_named_are_refused() {
    let header = PageHeader { node_count: 0, cluster_count: 0, triangle_count: 0, first_triangle: 0 };
    let many = [
        PageHeader { node_count: MAX_PAGE_NODES as u16 + 1, ..header },
        PageHeader { cluster_count: MAX_PAGE_CLUSTERS as u16 + 1, ..header },
    ];
    for header in many {
        let (words, entry) = page(header);
        let error = check_page(bytemuck::cast_slice(&words), 0, &entry, 1, 128).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("page 0: more nodes or clusters"), "{error}");
    }
}

#[test]
fn pages_not_aligned_in_memory_are_refused() {
    let file = sample();
    let (pack, _) = open_all(&file).unwrap();
    let entry = pack.directory[0];
    let mut words = vec![0u32; entry.bytes as usize / 4 + 1];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
    let moved = &mut bytes[1..=entry.bytes as usize];
    moved.copy_from_slice(&file[entry.offset as usize..][..entry.bytes as usize]);
    let error = check_page(moved, 0, &entry, 2, 4).map(|_| ()).unwrap_err();
    assert!(matches!(error, PackError::CorruptPage { page: 0, .. }), "{error}");
}
