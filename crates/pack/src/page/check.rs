//! Distrusts the bytes of a page once, when they arrive: after this no kernel needs a check.

use super::{ClusterView, PageView};
use crate::PackError;
use crate::layout::*;
use crate::nodes::{Child, check_nodes};
use crate::strip_record::{SPLIT_BYTES, StripView};

/// Checks the checksum of a page, then every offset, reference and number in it. `depth_limit` bounds the
/// levels of nodes. Gives the view of the good page.
pub fn check_page<'a>(
    bytes: &'a [u8],
    page: PageId,
    entry: &PageEntry,
    geometry_count: usize,
    depth_limit: usize,
) -> Result<PageView<'a>, PackError> {
    let wrong = |what: String| PackError::CorruptPage { page, what };
    if crc32c::crc32c(bytes) != entry.checksum {
        return Err(wrong("its checksum does not match".into()));
    }
    let view = PageView::new(bytes).map_err(|what| wrong(what.into()))?;
    check_contents(&view, bytes, entry, geometry_count, depth_limit).map_err(wrong)?;
    Ok(view)
}

fn check_contents(
    view: &PageView,
    bytes: &[u8],
    entry: &PageEntry,
    geometry_count: usize,
    depth_limit: usize,
) -> Result<(), String> {
    let header: PageHeader = bytemuck::pod_read_unaligned(&bytes[..size_of::<PageHeader>()]);
    if header.triangle_count != entry.triangle_count
        || header.first_triangle != entry.first_triangle
        || u32::from(header.node_count) != entry.node_count
    {
        return Err("it is not the page that the directory describes".into());
    }
    if view.nodes.len() > MAX_PAGE_NODES || view.clusters.len() > MAX_PAGE_CLUSTERS {
        return Err("more nodes or clusters than can be named".into());
    }
    let mut end = size_of::<PageHeader>() + size_of_val(view.nodes) + size_of_val(view.clusters);
    let mut starts = Vec::with_capacity(view.cluster_count());
    let mut triangles = 0u32;
    for i in 0..view.cluster_count() {
        let place = |what: &str| format!("cluster {i}: {what}");
        let header = view.clusters[i];
        let cluster = view.try_cluster(i).map_err(place)?;
        if header.first_triangle != triangles {
            return Err(place("wrong number of its first triangle"));
        }
        if header.offset as usize != end || header.reserved != 0 {
            return Err(place("bad header"));
        }
        end += cluster.byte_count();
        starts.push(check_cluster(&cluster, header.triangle_count, geometry_count).map_err(|e| place(&e))?);
        triangles += u32::from(header.triangle_count);
    }
    if triangles != header.triangle_count {
        return Err("clusters and page differ in the number of triangles".into());
    }
    if end != bytes.len() {
        return Err("bytes left over".into());
    }
    check_trees(view.nodes, &starts, depth_limit)
}

/// Checks one cluster and gives where its strips begin.
fn check_cluster(
    cluster: &ClusterView,
    triangle_count: u16,
    geometry_count: usize,
) -> Result<Vec<usize>, String> {
    if cluster.strip_bytes().len() > MAX_STRIP_BYTES {
        return Err("more bytes of strips than 15 bits can name".into());
    }
    if !cluster.vertices().iter().all(|v| v.is_finite()) {
        return Err("a vertex is not finite".into());
    }
    let mut starts = Vec::new();
    let (mut triangles, mut end) = (0, 0);
    while triangles < usize::from(triangle_count) {
        let strip =
            StripView::at(cluster.strip_bytes(), end).ok_or_else(|| format!("strip at {end} cut off"))?;
        check_strip(&strip, cluster.vertices().len()).map_err(|e| format!("strip at {end}: {e}"))?;
        starts.push(end);
        triangles += strip.triangle_count();
        end += strip.record_bytes();
    }
    if triangles != usize::from(triangle_count) || end.next_multiple_of(4) != cluster.strip_bytes().len() {
        return Err("strips do not add up".into());
    }
    let mut last_end = 0;
    for run in cluster.runs() {
        if run.end <= last_end || run.geometry as usize >= geometry_count {
            return Err("bad geometry run".into());
        }
        last_end = run.end;
    }
    if last_end != u32::from(triangle_count) {
        return Err("geometry runs do not add up".into());
    }
    Ok(starts)
}

fn check_strip(strip: &StripView, vertex_count: usize) -> Result<(), &'static str> {
    if !strip.refs().iter().all(|&r| usize::from(r) < vertex_count) {
        return Err("refers to a vertex that does not exist");
    }
    if !strip.turns().iter().all(|&bits| bits & 1 == 0 && bits < 1 << 6) {
        return Err("bad turn bits");
    }
    if !strip.tree().chunks_exact(SPLIT_BYTES).all(|b| b[0] & 3 < 3 && b[0] < 1 << 3) {
        return Err("bad split");
    }
    Ok(())
}

/// Checks that nodes form trees of bounded depth whose leaves are strips.
fn check_trees(nodes: &[WideNode], starts: &[Vec<usize>], depth_limit: usize) -> Result<(), String> {
    let child = |cluster: u8, c: u16| {
        if c == WideNode::EMPTY {
            return Child::None;
        }
        if c & WideNode::LEAF == 0 {
            return Child::Node(usize::from(c));
        }
        match starts.get(usize::from(cluster)) {
            None => Child::Broken("no such cluster"),
            Some(starts) if starts.binary_search(&usize::from(c & !WideNode::LEAF)).is_ok() => Child::Leaf,
            Some(_) => Child::Broken("no strip begins where it points"),
        }
    };
    let children = |node: &WideNode| node.child.map(|c| child(node.boxes.cluster, c));
    check_nodes(nodes, depth_limit, |node| &node.boxes, children).map(|_| ())
}
