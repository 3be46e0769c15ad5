//! Built clusters to pages, and the nodes above them.
//!
//! Clusters are taken in the order of the hierarchy; a page ends where it fills whole blocks of the file best, near its
//! size. A node whose clusters are all in one page lies in that page; the others lie above
//! the pages and lead into them.

use crate::{Observer, Stage};
use rayon::prelude::*;
use raystrips_geom::Aabb;
use raystrips_pack::layout::{
    ALIGNMENT, ChildBoxes, ClusterHeader, GeometryRun, MAX_DEPTH, MAX_PAGE_CLUSTERS, MAX_PAGE_STRIPS,
    MAX_PAGES, PageHeader, WIDTH, WideNode,
};
use raystrips_pack::page::builder::{Children, PageBuilder, StripParts};
use raystrips_pack::strip_record::strips_bytes;
use raystrips_pack::{PackError, PackWriter, TopEntry, TopNode, VertexCode};
use raystrips_strips::collapse::Numbered;
use raystrips_strips::{Bvh, Cluster, Collapse, Strip, StripTree};

/// Pages built at a time: bounds the memory of finished pages that wait to be written.
const BATCH: usize = 64;

/// What is above the pages.
pub(crate) struct Top {
    pub nodes: Vec<TopNode>,
    pub entries: Vec<TopEntry>,
    /// Most levels of nodes from the root to a strip.
    pub depth: u32,
}

/// Writes all pages and gives what is above them.
pub(crate) fn write_pages(
    writer: &mut PackWriter,
    built: &StripTree,
    page_size: usize,
    observer: &dyn Observer,
) -> Result<Top, PackError> {
    let page_of = fill_pages(&built.clusters, page_size);
    let mut plan = Plan { built, page_of: &page_of, nodes: Vec::new(), roots: Vec::new(), depth: 0 };
    plan.above(&built.tree, 1);
    if plan.roots.len() as u64 > MAX_PAGES {
        let what = "more ways into pages than 29 bits can number; use a larger --page-size";
        return Err(PackError::TooLarge(what.into()));
    }
    let pages: Vec<&[Root]> = plan.roots.chunk_by(|a, b| a.page == b.page).collect();
    let mut entries = Vec::with_capacity(plan.roots.len());
    let total = built.clusters.iter().flat_map(|c| &c.strips).map(|s| s.sources.len() as u64).sum();
    let mut depth = plan.depth;
    for batch in pages.chunks(BATCH) {
        if observer.is_cancelled() {
            return Err(std::io::Error::from(std::io::ErrorKind::Interrupted).into());
        }
        let built: Vec<_> = batch.par_iter().map(|roots| build_page(built, roots)).collect();
        for (roots, (page, page_depth)) in batch.iter().zip(built) {
            let id = writer.page(&page.finish(writer.next_triangle())?)?;
            debug_assert_eq!(id, roots[0].page);
            entries.extend((0..roots.len() as u32).map(|node| TopEntry { page: id, node }));
            depth = depth.max(page_depth);
        }
        observer.progress(Stage::Write, writer.next_triangle(), total);
    }
    if depth as usize > MAX_DEPTH {
        return Err(PackError::TooLarge(format!(
            "a hierarchy {depth} levels deep; the format allows {MAX_DEPTH}"
        )));
    }
    Ok(Top { nodes: plan.nodes, entries, depth })
}

/// The page of each cluster. A page ends where it fills whole blocks of the file best, at three quarters of
/// `page_size` or later.
fn fill_pages(clusters: &[Cluster], page_size: usize) -> Vec<u32> {
    let mut page_of = Vec::with_capacity(clusters.len());
    let mut page = 0;
    while page_of.len() < clusters.len() {
        let count = clusters_of_page(&clusters[page_of.len()..], page_size);
        page_of.resize(page_of.len() + count, page);
        page += 1;
    }
    page_of
}

/// How many of `clusters`, from the first on, make a page.
fn clusters_of_page(clusters: &[Cluster], page_size: usize) -> usize {
    let (mut bytes, mut strips) = (size_of::<PageHeader>(), 0);
    // The best end so far and its padding as a share of the page.
    let (mut best, mut least_padding) = (1, f64::INFINITY);
    for (i, cluster) in clusters.iter().enumerate() {
        bytes += estimated_bytes(cluster);
        strips += cluster.strips.len();
        if i > 0 && (bytes > page_size || i == MAX_PAGE_CLUSTERS || strips > MAX_PAGE_STRIPS) {
            return best;
        }
        let padding = ((bytes as u64).next_multiple_of(ALIGNMENT) - bytes as u64) as f64 / bytes as f64;
        if bytes < page_size / 4 * 3 || padding <= least_padding {
            (best, least_padding) = (i + 1, padding);
        }
    }
    clusters.len()
}

/// Bytes of a cluster in a page with its share of the page's nodes.
fn estimated_bytes(cluster: &Cluster) -> usize {
    let runs = cluster.strips.chunk_by(|a, b| a.geometry == b.geometry).count();
    // A full tree of eight children has a seventh as many nodes above its leaves as leaves.
    let nodes_above = cluster.groups.len().div_ceil(7);
    size_of::<ClusterHeader>()
        + runs * size_of::<GeometryRun>()
        + strips_bytes(cluster.strips.iter().map(|s| s.sources.len()))
        + VertexCode::of(&cluster.vertices).byte_count()
        + (cluster.groups.len() + nodes_above) * size_of::<WideNode>()
}

/// A tree that lies in one page, and its level there.
struct Root<'a> {
    page: u32,
    tree: &'a Bvh,
    level: u32,
}

/// Nodes above the pages and the roots they lead to, which are numbered like the entries.
struct Plan<'a> {
    built: &'a StripTree,
    page_of: &'a [u32],
    nodes: Vec<TopNode>,
    roots: Vec<Root<'a>>,
    depth: u32,
}

impl<'a> Plan<'a> {
    fn page_of_group(&self, group: usize) -> u32 {
        self.page_of[self.built.groups[group].0 as usize]
    }

    fn is_in_one_page(&self, tree: &Bvh) -> bool {
        let items = tree.items();
        self.page_of_group(items.start) == self.page_of_group(items.end - 1)
    }

    /// Adds a node above the pages for `tree`, and all below it.
    fn above(&mut self, tree: &'a Bvh, level: u32) -> u32 {
        self.depth = self.depth.max(level);
        let children = tree.open(WIDTH, |t| !self.is_in_one_page(t));
        let bounds: Vec<Aabb> = children.iter().map(|c| c.bounds()).collect();
        let node = self.nodes.len();
        self.nodes.push(TopNode { boxes: ChildBoxes::around(&bounds), child: [TopNode::EMPTY; WIDTH] });
        for (slot, child) in children.into_iter().enumerate() {
            self.nodes[node].child[slot] = if self.is_in_one_page(child) {
                let page = self.page_of_group(child.items().start);
                self.roots.push(Root { page, tree: child, level: level + 1 });
                TopNode::ENTRY | (self.roots.len() - 1) as u32
            } else {
                TopNode::NODE | self.above(child, level + 1)
            };
        }
        node as u32
    }
}

/// A page whose first nodes are its roots, and its deepest level.
fn build_page<'a>(built: &'a StripTree, roots: &[Root<'a>]) -> (PageBuilder<'a>, u32) {
    let first_group = roots[0].tree.items().start;
    let last_group = roots[roots.len() - 1].tree.items().end - 1;
    let first_cluster = built.groups[first_group].0;
    let mut page = PageContents {
        built,
        builder: PageBuilder::default(),
        first_cluster,
        first_strips: Vec::new(),
        depth: 0,
    };
    for cluster in &built.clusters[first_cluster as usize..=built.groups[last_group].0 as usize] {
        let strips = cluster.strips.iter().map(strip_parts).collect();
        page.first_strips.push(page.builder.cluster(&cluster.vertices, strips).1);
    }
    let first = page.builder.reserve_nodes(roots.len());
    for (number, root) in (first..).zip(roots) {
        page.node(number, (root.tree, 0), &Collapse::of(root.tree), root.level);
    }
    (page.builder, page.depth)
}

fn strip_parts(strip: &Strip) -> StripParts<'_> {
    StripParts { refs: &strip.refs, turns: &strip.turns, splits: &strip.splits, geometry: strip.geometry }
}

struct PageContents<'a> {
    built: &'a StripTree,
    builder: PageBuilder<'a>,
    first_cluster: u32,
    /// Number of the first strip of each cluster.
    first_strips: Vec<u16>,
    depth: u32,
}

impl PageContents<'_> {
    /// Makes node `number` of a tree over groups, and all below it.
    fn node(&mut self, number: u16, tree: Numbered, collapse: &Collapse, level: u32) {
        self.depth = self.depth.max(level);
        if let Bvh::Leaf { items, .. } = tree.0 {
            return self.group(number, items.start);
        }
        let children = collapse.children(tree);
        let first = self.builder.reserve_nodes(children.len());
        let bounds = children.iter().map(|c| c.0.bounds()).collect();
        self.builder.set_node(number, bounds, Children::Nodes(first));
        for (number, child) in (first..).zip(children) {
            self.node(number, child, collapse, level + 1);
        }
    }

    /// Makes node `number` of the strips of a group.
    fn group(&mut self, number: u16, group: usize) {
        let (cluster, place) = self.built.groups[group];
        let built = &self.built.clusters[cluster as usize];
        let strips = built.groups[place as usize].clone();
        let cluster = (cluster - self.first_cluster) as u8;
        let first = self.first_strips[usize::from(cluster)] + strips.start as u16;
        let bounds = built.strips[strips].iter().map(|s| s.bounds).collect();
        self.builder.set_node(number, bounds, Children::Strips { cluster, first });
    }
}
