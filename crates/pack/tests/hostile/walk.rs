//! Reads all that a pack offers, as the rest of the program does after the checks.

use raystrips_geom::strip::strip_is_reversed;
use raystrips_pack::layout::{TopNode, WIDTH, WideNode};
use raystrips_pack::page::ClusterView;
use raystrips_pack::{Pack, PackError, PageId, PageView, check_page};
use std::hint::black_box;
use std::io::Cursor;

/// Opens the pack and checks all pages and ids.
pub fn open_all(file: &[u8]) -> Result<(Pack, Vec<PageView<'_>>), PackError> {
    let pack = Pack::open(&mut Cursor::new(file))?;
    let geometries = pack.manifest.scene.geometries.len();
    let depth = pack.manifest.depth as usize;
    let page = |(id, e): (usize, &_)| check_page(page_bytes(file, e), id as PageId, e, geometries, depth);
    let pages = pack.directory.iter().enumerate().map(page).collect::<Result<_, _>>()?;
    let (offset, bytes) = pack.triangle_ids();
    pack.check_triangle_ids(&file[offset as usize..(offset + bytes) as usize])?;
    Ok((pack, pages))
}

fn page_bytes<'a>(file: &'a [u8], entry: &raystrips_pack::PageEntry) -> &'a [u8] {
    &file[entry.offset as usize..entry.offset as usize + entry.bytes as usize]
}

/// Calls every accessor of a checked pack. Gives the triangles below the root.
pub fn walk(pack: &Pack, pages: &[PageView]) -> u64 {
    black_box(pack.manifest.bytes_per_triangle());
    pages.iter().for_each(walk_page);
    let mut triangles = 0;
    let mut waiting = vec![0u32];
    while let Some(child) = waiting.pop() {
        if child & TopNode::ENTRY == 0 {
            let node = &pack.top_nodes[child as usize];
            (0..WIDTH).for_each(|i| assert!(node.boxes.child_bounds(i).min.is_finite()));
            waiting.extend(node.child.iter().filter(|&&c| c != TopNode::EMPTY));
        } else {
            let entry = pack.top_entries[(child & !TopNode::ENTRY) as usize];
            triangles += descend(&pages[entry.page as usize], entry.node as u16);
        }
    }
    triangles
}

/// Goes down from a node of a page like a ray, and counts the triangles.
fn descend(page: &PageView, root: u16) -> u64 {
    let mut triangles = 0;
    let mut waiting = vec![(root, root)];
    while let Some((parent, child)) = waiting.pop() {
        if child & WideNode::LEAF == 0 {
            let node = &page.nodes()[usize::from(child)];
            waiting.extend(node.child.iter().filter(|&&c| c != WideNode::EMPTY).map(|&c| (child, c)));
        } else {
            let cluster = page.cluster(usize::from(page.nodes()[usize::from(parent)].boxes.cluster));
            triangles += cluster.strip(usize::from(child & !WideNode::LEAF)).triangle_count() as u64;
        }
    }
    triangles
}

fn walk_page(page: &PageView) {
    for node in page.nodes() {
        (0..WIDTH).for_each(|i| assert!(node.boxes.child_bounds(i).max.is_finite()));
    }
    (0..page.cluster_count()).for_each(|i| walk_cluster(&page.cluster(i)));
}

fn walk_cluster(cluster: &ClusterView) {
    black_box((cluster.runs(), cluster.first_triangle()));
    for (offset, strip) in cluster.strips() {
        (0..strip.window_count() - 1).for_each(|i| assert!(strip.split(i).axis < 3));
        (0..strip.window_count()).for_each(|w| assert!(strip.window(w).2.len() <= 8));
        for i in 0..strip.triangle_count() {
            let index = cluster.triangle_index(offset, i);
            black_box((cluster.geometry(index), strip_is_reversed(strip.turns(), i)));
            assert!(strip.triangle(i).iter().all(|&v| cluster.vertices()[usize::from(v)].is_finite()));
        }
    }
}
