//! Reads all that a pack offers, as the rest of the program does after the checks.

use raystrips_pack::layout::{TopNode, WIDTH};
use raystrips_pack::vertices::VERTEX_REACH;
use raystrips_pack::{ClusterView, Pack, PackError, PageId, PageView, WideNode, check_page};
use std::hint::black_box;
use std::io::Cursor;
use std::ops::Range;

/// A pack and its pages, which were checked.
pub struct Opened {
    pub pack: Pack,
    pages: Vec<Vec<WideNode>>,
}

impl Opened {
    pub fn pages(&self) -> Vec<PageView<'_>> {
        let entries = self.pack.directory.iter();
        let bytes =
            self.pages.iter().zip(entries).map(|(memory, entry)| &bytes(memory)[..entry.bytes as usize]);
        bytes.map(|bytes| PageView::new(bytes).unwrap()).collect()
    }
}

fn bytes(memory: &[WideNode]) -> &[u8] {
    bytemuck::cast_slice(memory)
}

/// Opens the pack and checks all pages, ids, attributes and tiles.
pub fn open_all(file: &[u8]) -> Result<Opened, PackError> {
    let pack = Pack::open(&mut Cursor::new(file))?;
    let geometries = pack.manifest.scene.geometries.len();
    let depth = pack.manifest.depth as usize;
    let mut pages = Vec::new();
    for (id, entry) in pack.directory.iter().enumerate() {
        let length = entry.bytes as usize;
        let memory = aligned(&file[entry.offset as usize..][..length]);
        check_page(&bytes(&memory)[..length], id as PageId, entry, geometries, depth)?;
        pages.push(memory);
        pack.shading.check_attributes(
            part(file, pack.shading.attributes(id as PageId)),
            id as PageId,
            entry.triangle_count,
        )?;
    }
    (0..pack.shading.tile_count())
        .try_for_each(|tile| pack.shading.decode_tile(part(file, pack.shading.tile(tile)), tile).map(drop))?;
    let (offset, bytes) = pack.triangle_ids();
    pack.check_triangle_ids(&file[offset as usize..(offset + bytes) as usize])?;
    Ok(Opened { pack, pages })
}

fn part(file: &[u8], place: Range<u64>) -> &[u8] {
    &file[place.start as usize..place.end as usize]
}

/// A copy of `bytes`, aligned as pages are, with something after them.
pub fn aligned(bytes: &[u8]) -> Vec<WideNode> {
    let mut memory: Vec<WideNode> =
        vec![bytemuck::Zeroable::zeroed(); bytes.len() / size_of::<WideNode>() + 1];
    bytemuck::cast_slice_mut(&mut memory)[..bytes.len()].copy_from_slice(bytes);
    memory
}

/// Calls every accessor of a checked pack. Gives the triangles below the roots.
pub fn walk(opened: &Opened) -> u64 {
    let (pack, pages) = (&opened.pack, opened.pages());
    black_box(pack.manifest.bytes_per_triangle());
    pages.iter().for_each(walk_page);
    let mut triangles = 0;
    // Each part once, however often it is shown.
    let mut roots: Vec<u32> = pack.instances.iter().map(|instance| instance.root).chain([0]).collect();
    roots.sort_unstable();
    roots.dedup();
    let mut waiting: Vec<u32> = roots.into_iter().map(|root| TopNode::NODE | root).collect();
    while let Some(child) = waiting.pop() {
        let number = (child & !TopNode::KIND) as usize;
        if child & TopNode::KIND == TopNode::NODE {
            let node = &pack.top_nodes[number];
            (0..WIDTH).for_each(|i| assert!(node.boxes.child_bounds(i).min.is_finite()));
            waiting.extend(&node.child[..node.child_count()]);
        } else if child & TopNode::KIND == TopNode::INSTANCE {
            assert!(pack.instances[number].world_from_local().inverse().is_finite());
        } else {
            let entry = pack.top_entries[number];
            triangles += descend(&pages[entry.page as usize], entry.node as usize);
        }
    }
    triangles
}

/// Goes down from a node of a page like a ray, and counts the triangles.
fn descend(page: &PageView, root: usize) -> u64 {
    let mut triangles = 0;
    let mut waiting = vec![root];
    while let Some(number) = waiting.pop() {
        let node = &page.nodes()[number];
        let children = usize::from(node.first)..usize::from(node.first) + node.child_count();
        if node.holds_strips() {
            let cluster = page.cluster(node.cluster.into());
            assert!(children.clone().all(|i| cluster.strip_numbers().contains(&i)));
            triangles += children.map(|i| page.strip(i).primitive_count() as u64).sum::<u64>();
        } else {
            waiting.extend(children);
        }
    }
    triangles
}

fn walk_page(page: &PageView) {
    for node in page.nodes() {
        // Rounded outward from what is finite.
        (0..WIDTH).for_each(|i| assert!(!node.child_bounds(page.grid(), i).max.is_nan()));
    }
    for i in 0..page.strip_count() {
        let record = page.window_record(i);
        assert_eq!(record.is_some(), page.header().max_windows == 1);
        assert!(record.is_none_or(|r| r[0] == page.strip(i).heads()[0]));
    }
    black_box((page.records(), page.window_record(1 << 30), page.strand(1 << 30)));
    (0..page.cluster_count()).for_each(|i| walk_cluster(page, &page.cluster(i)));
}

fn walk_cluster(page: &PageView, cluster: &ClusterView) {
    black_box((cluster.runs(), cluster.first_triangle()));
    if page.header().holds_strands() {
        return cluster.strip_numbers().for_each(|number| walk_strand(page, cluster, number));
    }
    // A kernel decodes before it knows whether a byte names a vertex.
    assert!(cluster.vertex_bytes().len() >= VERTEX_REACH);
    (0..256).for_each(|i| _ = black_box(cluster.vertex_code().decode(cluster.vertex_bytes(), i)));
    assert!((0..cluster.vertex_count()).all(|i| cluster.vertex(i as u8).is_finite()));
    for (number, strip) in cluster.strip_numbers().zip(cluster.strips()) {
        assert!(strip.strand().is_none() && strip.window_count() <= page.header().max_windows.into());
        (0..strip.window_count() - 1).for_each(|i| assert!(strip.split(i).axis < 3));
        for w in 0..strip.window_count() {
            let (head, refs) = strip.window(w);
            assert!(head.count() <= 6 && refs.len() >= head.count() + 2);
            black_box(strip.is_reversed_before(w));
        }
        assert_eq!(strip.refs().len(), strip.primitive_count() + 2);
        for i in 0..strip.primitive_count() {
            black_box(cluster.geometry(cluster.triangle_index(number, i)));
            assert!(strip.triangle(i).iter().all(|&v| usize::from(v) < cluster.vertex_count()));
        }
    }
}

fn walk_strand(page: &PageView, cluster: &ClusterView, number: usize) {
    let strand = page.strand(number).unwrap();
    assert_eq!(page.strip(number).strand(), Some(strand));
    assert_eq!(page.strip(number).primitive_count(), strand.segments);
    black_box(cluster.pair(strand));
    for i in 0..strand.segments {
        black_box(cluster.geometry(cluster.triangle_index(number, i)));
        let segment = cluster.segment(strand, i);
        assert!(segment.ends.iter().all(|p| p.is_finite()) && segment.radii.iter().all(|&r| r > 0.0));
    }
}
