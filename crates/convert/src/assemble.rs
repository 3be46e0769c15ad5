//! Built clusters to pages, and the nodes above them.
//!
//! Clusters are taken in the order of the hierarchy until a page is full, so pages are full but for the last
//! cluster that did not fit. A node whose clusters are all in one page lies in that page; the others lie above
//! the pages and lead into them.

use crate::{Observer, Stage};
use rayon::prelude::*;
use raystrips_geom::Aabb;
use raystrips_pack::layout::{
    ChildBoxes, ClusterHeader, GeometryRun, MAX_DEPTH, MAX_PAGE_CLUSTERS, WIDTH, WideNode,
};
use raystrips_pack::page::builder::{PageBuilder, StripParts};
use raystrips_pack::strip_record::record_bytes;
use raystrips_pack::{PackError, PackWriter, TopEntry, TopNode};
use raystrips_strips::{Bvh, Cluster, StripTree};

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
    let mut plan = Plan { page_of: &page_of, nodes: Vec::new(), roots: Vec::new(), depth: 0 };
    plan.above(&built.tree, 1);
    let pages: Vec<&[Root]> = plan.roots.chunk_by(|a, b| a.page == b.page).collect();
    let mut entries = Vec::with_capacity(plan.roots.len());
    let total = built.clusters.iter().flat_map(|c| &c.strips).map(|s| s.sources.len() as u64).sum();
    let mut depth = plan.depth;
    for batch in pages.chunks(BATCH) {
        if observer.is_cancelled() {
            return Err(std::io::Error::from(std::io::ErrorKind::Interrupted).into());
        }
        let built: Vec<_> = batch.par_iter().map(|roots| build_page(&built.clusters, roots)).collect();
        for (roots, (page, nodes, page_depth)) in batch.iter().zip(built) {
            let id = writer.page(&page.finish(writer.next_triangle())?)?;
            debug_assert_eq!(id, roots[0].page);
            entries.extend(nodes.into_iter().map(|node| TopEntry { page: id, node: u32::from(node) }));
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

/// The page of each cluster.
fn fill_pages(clusters: &[Cluster], page_size: usize) -> Vec<u32> {
    let (mut page, mut bytes, mut count) = (0, 0, 0);
    let place = |cluster: &Cluster| {
        let size = estimated_bytes(cluster);
        if count > 0 && (bytes + size > page_size || count == MAX_PAGE_CLUSTERS) {
            page += 1;
            bytes = 0;
            count = 0;
        }
        bytes += size;
        count += 1;
        page
    };
    clusters.iter().map(place).collect()
}

/// Bytes of a cluster in a page with its share of the page's nodes.
fn estimated_bytes(cluster: &Cluster) -> usize {
    let strips: usize = cluster.strips.iter().map(|s| record_bytes(s.sources.len())).sum();
    let runs = cluster.strips.chunk_by(|a, b| a.geometry == b.geometry).count();
    size_of::<ClusterHeader>()
        + runs * size_of::<GeometryRun>()
        + strips.next_multiple_of(4)
        + size_of_val(&cluster.vertices[..])
        + (node_count(&cluster.tree) + 1) * size_of::<WideNode>()
}

fn node_count(tree: &Bvh) -> usize {
    let inner = |t: &&&Bvh| matches!(t, Bvh::Inner { .. });
    1 + tree.open(WIDTH, |_| true).iter().filter(inner).map(|t| node_count(t)).sum::<usize>()
}

/// A tree that lies in one page, and its level there.
struct Root<'a> {
    page: u32,
    tree: &'a Bvh,
    level: u32,
}

/// Nodes above the pages and the roots they lead to, which are numbered like the entries.
struct Plan<'a> {
    page_of: &'a [u32],
    nodes: Vec<TopNode>,
    roots: Vec<Root<'a>>,
    depth: u32,
}

impl<'a> Plan<'a> {
    fn is_in_one_page(&self, tree: &Bvh) -> bool {
        let items = tree.items();
        self.page_of[items.start] == self.page_of[items.end - 1]
    }

    /// Adds a node above the pages for `tree`, and all below it.
    fn above(&mut self, tree: &'a Bvh, level: u32) -> u32 {
        self.depth = self.depth.max(level);
        let children = tree.open(WIDTH, |t| !self.is_in_one_page(t));
        let bounds: Vec<Aabb> = children.iter().map(|c| c.bounds()).collect();
        let node = self.nodes.len();
        self.nodes.push(TopNode { boxes: ChildBoxes::around(&bounds, 0), child: [TopNode::EMPTY; WIDTH] });
        for (slot, child) in children.into_iter().enumerate() {
            self.nodes[node].child[slot] = if self.is_in_one_page(child) {
                let page = self.page_of[child.items().start];
                self.roots.push(Root { page, tree: child, level: level + 1 });
                TopNode::ENTRY | (self.roots.len() - 1) as u32
            } else {
                self.above(child, level + 1)
            };
        }
        node as u32
    }
}

/// A page with the nodes of its roots and its deepest level.
fn build_page(clusters: &[Cluster], roots: &[Root]) -> (PageBuilder, Vec<u16>, u32) {
    let mut page = PageContents { builder: PageBuilder::default(), clusters, depth: 0 };
    let nodes = roots.iter().map(|root| page.tree(root.tree, root.level)).collect();
    (page.builder, nodes, page.depth)
}

struct PageContents<'a> {
    builder: PageBuilder,
    clusters: &'a [Cluster],
    depth: u32,
}

impl PageContents<'_> {
    /// Adds a tree over clusters and gives its node.
    fn tree(&mut self, tree: &Bvh, level: u32) -> u16 {
        if let Bvh::Leaf { items, .. } = tree {
            return self.cluster(&self.clusters[items.start], level);
        }
        let children = tree.open(WIDTH, |_| true);
        let bounds: Vec<Aabb> = children.iter().map(|c| c.bounds()).collect();
        let node = self.builder.node(0, &bounds);
        for (slot, child) in children.into_iter().enumerate() {
            let child = self.tree(child, level + 1);
            self.builder.link(node, slot, child);
        }
        node
    }

    /// Adds a cluster and gives the node of its tree.
    fn cluster(&mut self, cluster: &Cluster, level: u32) -> u16 {
        let number = self.builder.cluster(cluster.vertices.clone());
        let mut places = vec![(0, 0); cluster.strips.len()];
        let root = self.cluster_node(number, &cluster.tree, level, &mut places);
        for (strip, (node, slot)) in cluster.strips.iter().zip(places) {
            let parts = StripParts {
                refs: &strip.refs,
                turns: &strip.turns,
                splits: &strip.splits,
                geometry: strip.geometry,
            };
            self.builder.strip(node, slot, parts);
        }
        root
    }

    /// Adds a node over strips, and notes where each strip shall hang.
    fn cluster_node(&mut self, cluster: u8, tree: &Bvh, level: u32, places: &mut [(u16, usize)]) -> u16 {
        self.depth = self.depth.max(level);
        let children = tree.open(WIDTH, |_| true);
        let bounds: Vec<Aabb> = children.iter().map(|c| c.bounds()).collect();
        let node = self.builder.node(cluster, &bounds);
        for (slot, child) in children.into_iter().enumerate() {
            if let Bvh::Leaf { items, .. } = child {
                places[items.start] = (node, slot);
            } else {
                let child = self.cluster_node(cluster, child, level + 1, places);
                self.builder.link(node, slot, child);
            }
        }
        node
    }
}
