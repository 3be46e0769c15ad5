//! The clusters of a piece to pages, and what of its hierarchy is above them.
//!
//! Clusters are taken in the order of the hierarchy; a page ends where it fills whole blocks of the file best, near its
//! size. A subtree whose clusters are all in one page lies in that page. Then pages and their nodes are put into the order
//! of the layout.

use crate::layout::Layout;
use crate::layout::nodes::{PageNodes, PlacedNode};
use crate::layout::pages::order_pages;
use glam::Vec3;
use rayon::prelude::*;
use raystrips_geom::{Aabb, Frame, RadiusCode};
use raystrips_layout::Permutation;
use raystrips_pack::layout::{
    ALIGNMENT, ClusterHeader, GeometryRun, MAX_PAGE_CLUSTERS, MAX_PAGE_STRIPS, PageHeader, WideNode,
};
use raystrips_pack::page::builder::{BuiltPage, Children, PageBuilder, StripParts};
use raystrips_pack::strip_record::strips_bytes;
use raystrips_pack::{PackError, StoredStrands, StrandParts, VertexCode};
use raystrips_strips::{Bvh, Cluster, Strip, StripTree};
use serde::{Deserialize, Serialize};

/// The pages of a piece.
pub(crate) struct Assembled {
    pub pages: Vec<BuiltPage>,
    /// As they are to lie in the file.
    pub file_order: Permutation,
    /// The hierarchy down to what lies in pages; leaf i leads to root i.
    pub tree: Bvh,
    pub roots: Vec<Root>,
}

/// A node of a page that a leaf above the pages leads to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Root {
    /// Number of the page in its piece.
    pub page: u32,
    /// Number of the node in its page.
    pub node: u32,
    /// Levels of nodes from it down to a strip.
    pub depth: u32,
}

/// What pages are to be like.
#[derive(Clone, Copy)]
pub(crate) struct PageStyle {
    /// Bytes to aim at.
    pub size: usize,
    pub layout: Layout,
    /// How radii of strands are stored.
    pub radii: RadiusCode,
}

/// Makes the pages of a piece whose triangles are numbered from `first_triangle` on.
pub(crate) fn assemble(
    built: &StripTree,
    style: PageStyle,
    first_triangle: u64,
) -> Result<Assembled, PackError> {
    let strands = stored_strands(&built.clusters);
    let page_of = fill_pages(&built.clusters, &strands, style.size);
    let page_of_group = |group: usize| page_of[built.groups[group].0 as usize];
    let mut in_pages = Vec::new();
    let tree = cut(&built.tree, &page_of_group, &mut in_pages);
    let plans: Vec<&[(u32, &Bvh)]> = in_pages.chunk_by(|a, b| a.0 == b.0).collect();
    let triangles_before = triangles_before(built, &page_of, first_triangle);
    let pages: Result<Vec<(BuiltPage, Vec<u32>)>, PackError> = plans
        .par_iter()
        .zip(&triangles_before)
        .map(|(roots, &first)| {
            let (page, depths) = build_page(built, &strands, roots, style);
            Ok((page.finish(first)?, depths))
        })
        .collect();
    let (pages, depths): (Vec<BuiltPage>, Vec<Vec<u32>>) = pages?.into_iter().unzip();
    let roots_of_page = |(page, depths): (u32, &Vec<u32>)| {
        let depths = depths.clone();
        (0..).zip(depths).map(move |(node, depth)| Root { page, node, depth })
    };
    let roots: Vec<Root> = (0..).zip(&depths).flat_map(roots_of_page).collect();
    let file_order = order_pages(style.layout, &tree, &roots, pages.len());
    Ok(Assembled { pages, file_order, tree, roots })
}

/// The hierarchy above the largest subtrees that lie in one page; those are pushed to `in_pages` with their page.
fn cut<'a>(tree: &'a Bvh, page_of_group: &impl Fn(usize) -> u32, in_pages: &mut Vec<(u32, &'a Bvh)>) -> Bvh {
    let items = tree.items();
    let page = page_of_group(items.start);
    match tree {
        Bvh::Inner { bounds, children } if page != page_of_group(items.end - 1) => {
            let [a, b] = &**children;
            let a = cut(a, page_of_group, in_pages);
            Bvh::Inner { bounds: *bounds, children: Box::new([a, cut(b, page_of_group, in_pages)]) }
        }
        _ => {
            in_pages.push((page, tree));
            let number = in_pages.len() - 1;
            Bvh::Leaf { bounds: tree.bounds(), items: number..number + 1 }
        }
    }
}

/// For each page the number of its first triangle.
fn triangles_before(built: &StripTree, page_of: &[u32], first_triangle: u64) -> Vec<u64> {
    let triangles = |c: &Cluster| c.strips.iter().map(|s| s.sources.len() as u64).sum::<u64>();
    let (mut cluster, mut triangle) = (0, first_triangle);
    let mut first_of_page = |page: &[u32]| {
        let first = triangle;
        let clusters = &built.clusters[cluster..cluster + page.len()];
        cluster += page.len();
        triangle += clusters.iter().map(triangles).sum::<u64>();
        first
    };
    page_of.chunk_by(|a, b| a == b).map(&mut first_of_page).collect()
}

/// Each cluster as it is stored, if they are strands; else nothing.
fn stored_strands(clusters: &[Cluster]) -> Vec<StoredStrands> {
    let is_strand = |strip: &Strip| !strip.radii.is_empty();
    if !clusters.iter().flat_map(|cluster| &cluster.strips).all(is_strand) {
        return Vec::new();
    }
    let stored = |cluster: &Cluster| {
        let parts: Vec<StrandParts> = cluster.strips.iter().map(strand_parts).collect();
        StoredStrands::of(&cluster.vertices, &parts)
    };
    clusters.par_iter().map(stored).collect()
}

/// The page of each cluster. A page ends where it fills whole blocks of the file best, at three quarters of
/// `page_size` or later.
fn fill_pages(clusters: &[Cluster], strands: &[StoredStrands], page_size: usize) -> Vec<u32> {
    let bytes: Vec<usize> =
        clusters.iter().enumerate().map(|(i, c)| estimated_bytes(c, strands.get(i))).collect();
    let mut page_of = Vec::with_capacity(clusters.len());
    let mut page = 0;
    while page_of.len() < clusters.len() {
        let first = page_of.len();
        let count = clusters_of_page(&clusters[first..], &bytes[first..], page_size);
        page_of.resize(first + count, page);
        page += 1;
    }
    page_of
}

/// How many of `clusters`, of so many bytes each, from the first on, make a page.
fn clusters_of_page(clusters: &[Cluster], bytes_of: &[usize], page_size: usize) -> usize {
    let (mut bytes, mut strips) = (size_of::<PageHeader>(), 0);
    // The best end so far and its padding as a share of the page.
    let (mut best, mut least_padding) = (1, f64::INFINITY);
    for (i, cluster) in clusters.iter().enumerate() {
        bytes += bytes_of[i];
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

/// Zeros before the strips and the vertices of a cluster, at about.
const CLUSTER_PADDING: usize = 6;

/// Bytes of a cluster in a page with its share of the page's nodes.
fn estimated_bytes(cluster: &Cluster, strands: Option<&StoredStrands>) -> usize {
    let runs = cluster.strips.chunk_by(|a, b| a.geometry == b.geometry).count();
    // A full tree of eight children has a seventh as many nodes above its leaves as leaves.
    let nodes_above = cluster.groups.len().div_ceil(7);
    size_of::<ClusterHeader>()
        + runs * size_of::<GeometryRun>()
        + CLUSTER_PADDING
        + strands.map_or_else(|| triangle_bytes(cluster), StoredStrands::byte_count)
        + (cluster.groups.len() + nodes_above) * size_of::<WideNode>()
}

/// Bytes of vertices and strips.
fn triangle_bytes(cluster: &Cluster) -> usize {
    strips_bytes(cluster.strips.iter().map(|s| s.sources.len()))
        + VertexCode::of(&cluster.vertices).byte_count()
}

/// A page whose first nodes are its roots, and the levels below each.
fn build_page<'a>(
    built: &'a StripTree,
    strands: &'a [StoredStrands],
    roots: &[(u32, &'a Bvh)],
    style: PageStyle,
) -> (PageBuilder<'a>, Vec<u32>) {
    let first_group = roots[0].1.items().start;
    let last_group = roots[roots.len() - 1].1.items().end - 1;
    let first_cluster = built.groups[first_group].0;
    let range = first_cluster as usize..built.groups[last_group].0 as usize + 1;
    let clusters = &built.clusters[range.clone()];
    let frame = if strands.is_empty() { None } else { frame_of(clusters, &style) };
    let boxes = Boxes { frame, radii: style.radii };
    let builder = PageBuilder::new(style.radii, boxes.frame);
    let of_cluster = |c: &Cluster| Vec::from_iter(c.strips.iter().map(|strip| boxes.of_strip(c, strip)));
    let bounds = clusters.iter().map(of_cluster).collect();
    let mut page = PageContents { built, builder, first_cluster, is_turned: boxes.frame.is_some(), bounds };
    for (cluster, number) in clusters.iter().zip(range) {
        match strands.get(number) {
            Some(strands) => page.builder.strands(strands),
            None => page.builder.cluster(&cluster.vertices, cluster.strips.iter().map(strip_parts).collect()),
        };
    }
    let turned: Vec<Bvh> = roots.iter().filter_map(|root| page.turned(root.1)).collect();
    let roots: Vec<&Bvh> = match turned.is_empty() {
        true => roots.iter().map(|root| root.1).collect(),
        false => turned.iter().collect(),
    };
    let nodes = PageNodes::new(&roots);
    page.builder.reserve_nodes(nodes.count());
    nodes.placed(style.layout).into_iter().for_each(|node| page.node(node));
    (page.builder, nodes.depths)
}

fn strand_parts(strip: &Strip) -> StrandParts<'_> {
    StrandParts { refs: &strip.refs, radii: &strip.radii, geometry: strip.geometry }
}

fn strip_parts(strip: &Strip) -> StripParts<'_> {
    StripParts { refs: &strip.refs, turns: &strip.turns, splits: &strip.splits, geometry: strip.geometry }
}

/// Strands that point this much the same way have boxes along it: length of the mean of their directions.
const LEAST_ALIKE: f32 = 0.5;

/// The frame for the boxes of clusters of strands; none where these run in all directions.
fn frame_of(clusters: &[Cluster], style: &PageStyle) -> Option<Frame> {
    let strands = || clusters.iter().flat_map(|c| c.strips.iter().map(move |strip| (c, strip)));
    let ends = |(cluster, strip): (&Cluster, &Strip)| {
        let vertex = |r: &u8| cluster.vertices[usize::from(*r)];
        (strip.refs.first().map_or(Vec3::ZERO, vertex), strip.refs.last().map_or(Vec3::ZERO, vertex))
    };
    let count = strands().count() as f32;
    let directions = strands().map(ends).map(|(a, b)| (b - a).normalize_or_zero());
    let mean = directions.sum::<Vec3>() / count;
    let direction = mean.try_normalize().filter(|_| mean.length() > LEAST_ALIKE)?;
    let around = |frame| {
        let boxes = Boxes { frame: Some(frame), radii: style.radii };
        strands().fold(Aabb::EMPTY, |all, (cluster, strip)| all.union(boxes.of_strip(cluster, strip)))
    };
    // Zero is in the middle of the grid, so that belongs into the middle of what is there.
    let first = Frame::along(strands().next().map(ends)?.0, direction);
    let [x, y, z] = first.axes();
    let middle = around(first).center();
    Some(Frame { origin: first.origin + x * middle.x + y * middle.y + z * middle.z, ..first })
}

/// How boxes of strips are found.
#[derive(Clone, Copy)]
struct Boxes {
    frame: Option<Frame>,
    radii: RadiusCode,
}

impl Boxes {
    fn of_strip(&self, cluster: &Cluster, strip: &Strip) -> Aabb {
        let Some(frame) = self.frame else { return strip.bounds };
        let points = strip.refs.iter().zip(&strip.radii);
        let ball = |(&vertex, &code): (&u8, &u8)| {
            frame.ball_bounds(cluster.vertices[usize::from(vertex)], self.radii.decode(code))
        };
        points.map(ball).fold(Aabb::EMPTY, |all, ball| all.union(ball))
    }
}

struct PageContents<'a> {
    built: &'a StripTree,
    builder: PageBuilder<'a>,
    first_cluster: u32,
    is_turned: bool,
    /// Those of strips, by cluster, as seen from the page's frame if it has one.
    bounds: Vec<Vec<Aabb>>,
}

impl PageContents<'_> {
    /// The same hierarchy with boxes as seen from the page's frame, if it has one.
    fn turned(&self, tree: &Bvh) -> Option<Bvh> {
        self.is_turned.then(|| self.turned_tree(tree))
    }

    fn turned_tree(&self, tree: &Bvh) -> Bvh {
        match tree {
            Bvh::Leaf { items, .. } => {
                let (cluster, place) = self.built.groups[items.start];
                let strips = self.built.clusters[cluster as usize].groups[place as usize].clone();
                let boxes = &self.bounds[(cluster - self.first_cluster) as usize][strips];
                Bvh::Leaf {
                    bounds: boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(*b)),
                    items: items.clone(),
                }
            }
            Bvh::Inner { children, .. } => {
                let children = [0, 1].map(|i| self.turned_tree(&children[i]));
                let bounds = children[0].bounds().union(children[1].bounds());
                Bvh::Inner { bounds, children: Box::new(children) }
            }
        }
    }

    /// Says what a node is: one over others, or that of the strips of a group.
    fn node(&mut self, node: PlacedNode) {
        match node.children.as_slice() {
            [] => self.group(node.number, node.tree.items().start),
            children => {
                let bounds = children.iter().map(|child| child.bounds()).collect();
                self.builder.set_node(node.number, bounds, Children::Nodes(node.first_child));
            }
        }
    }

    /// Makes node `number` of the strips of a group.
    fn group(&mut self, number: u16, group: usize) {
        let (cluster, place) = self.built.groups[group];
        let built = &self.built.clusters[cluster as usize];
        let strips = built.groups[place as usize].clone();
        let (cluster, first) = ((cluster - self.first_cluster) as u8, strips.start as u16);
        let bounds = self.bounds[usize::from(cluster)][strips].to_vec();
        self.builder.set_node(number, bounds, Children::Strips { cluster, first });
    }
}
