//! Distrusts the bytes of a page once, when they arrive: after this no kernel needs a check.

use super::{ClusterView, PageView};
use crate::PackError;
use crate::layout::*;
use crate::nodes::{Child, check_nodes};
use crate::strand_record::{STRAND_RECORD_BYTES, StrandView};
use crate::strip_record::{PLACE_BYTES, SPLIT_BYTES, StripView, WINDOW_RECORD_BYTES, WindowHead};
use crate::vertices::VERTEX_REACH;
use raystrips_geom::strip::WINDOW_TRIANGLES;
use std::ops::Range;

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
    check_checksum(bytes, page, entry)?;
    let view = PageView::new(bytes).map_err(|what| wrong(what.into()))?;
    check_contents(&view, entry, geometry_count, depth_limit).map_err(wrong)?;
    Ok(view)
}

/// Checks the checksum of a page alone: enough where the page with this entry was good before.
pub fn check_checksum(bytes: &[u8], page: PageId, entry: &PageEntry) -> Result<(), PackError> {
    if crc32c::crc32c(bytes) == entry.checksum {
        return Ok(());
    }
    Err(PackError::CorruptPage { page, what: "its checksum does not match".into() })
}

fn check_contents(
    view: &PageView,
    entry: &PageEntry,
    geometry_count: usize,
    depth_limit: usize,
) -> Result<(), String> {
    let header = view.header;
    if header.triangle_count != entry.triangle_count
        || header.first_triangle != entry.first_triangle
        || u32::from(header.last_node) + 1 != entry.node_count
    {
        return Err("it is not the page that the directory describes".into());
    }
    if view.clusters.len() > MAX_PAGE_CLUSTERS || view.strip_count() > MAX_PAGE_STRIPS {
        return Err("more clusters or strips than can be named".into());
    }
    if !grid_is_sane(header) {
        return Err("bad grid".into());
    }
    if !turn_is_sane(header) {
        return Err("bad header".into());
    }
    let last_triangle = header.first_triangle.checked_add(u64::from(header.triangle_count));
    last_triangle.ok_or("triangle number beyond 64 bits")?;
    let is_single = header.max_windows == 1;
    let mut end = view.places_offset() + table_bytes(header);
    let (mut triangles, mut strips) = (0, 0);
    for i in 0..view.cluster_count() {
        let place = |what: &str| format!("cluster {i}: {what}");
        let header = &view.clusters[i];
        let first_strip = match is_single {
            true => end.div_ceil(WINDOW_RECORD_BYTES),
            false => strips,
        };
        if header.first_triangle != triangles || usize::from(header.first_strip) != first_strip {
            return Err(place("wrong number of its first triangle or strip"));
        }
        triangles += u32::from(header.triangle_count);
        strips += usize::from(header.strip_count);
        if strips > view.strip_count() || first_strip + usize::from(header.strip_count) > MAX_PAGE_STRIPS {
            return Err(place("strips that the page does not have"));
        }
        if is_single {
            end = first_strip * WINDOW_RECORD_BYTES;
        }
        end = check_strip_places(view, first_strip..first_strip + usize::from(header.strip_count), end)?;
        let cluster = view.try_cluster(i).map_err(place)?;
        if header.offset as usize != end.next_multiple_of(align_of::<GeometryRun>()) {
            return Err(place("bad header"));
        }
        end = header.offset as usize + cluster.byte_count();
        check_cluster(&cluster, geometry_count).map_err(|e| place(&e))?;
    }
    if triangles != header.triangle_count || strips != view.strip_count() {
        return Err("clusters and page differ in the number of triangles or strips".into());
    }
    let nodes_offset = end.next_multiple_of(size_of::<WideNode>());
    end = nodes_offset + size_of_val(view.nodes);
    let reach = |cluster: &ClusterHeader| match view.header.holds_strands() {
        true => end,
        false => cluster.offset as usize + VERTEX_REACH,
    };
    let reach = view.clusters.iter().map(reach).fold(end, usize::max);
    if header.nodes_offset as usize != nodes_offset || reach != view.bytes.len() {
        return Err("bytes left over".into());
    }
    check_trees(view, depth_limit)
}

/// Bytes of the table behind the cluster headers: places of strips of several windows, or windows of strands.
fn table_bytes(header: &PageHeader) -> usize {
    let entry = match header.max_windows {
        0 => STRAND_RECORD_BYTES,
        1 => 0,
        _ => PLACE_BYTES,
    };
    entry * header.strip_count as usize
}

fn check_cluster(cluster: &ClusterView, geometry_count: usize) -> Result<(), String> {
    let holds_strands = cluster.page.header.holds_strands();
    if holds_strands {
        check_strand_code(cluster)?;
    } else {
        cluster.vertex_code().check()?;
        if !(0..=cluster.header.code.last).all(|i| cluster.vertex(i).is_finite()) {
            return Err("a vertex is not finite".into());
        }
    }
    let triangle_count = cluster.header.triangle_count;
    let mut triangles = 0;
    for (number, strip) in cluster.strip_numbers().zip(cluster.strips()) {
        let checked = match holds_strands {
            true => check_strand(cluster, number),
            false => check_strip(&strip, cluster.header.code.last),
        };
        checked.map_err(|what| format!("strip {number}: {what}"))?;
        triangles += strip.primitive_count();
    }
    if triangles != usize::from(triangle_count) || triangle_count == 0 {
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
    Ok(())
}

/// Checks that the strips of a cluster follow each other from `end` on, and tells where they end.
fn check_strip_places(view: &PageView, strips: Range<usize>, mut end: usize) -> Result<usize, String> {
    let max_windows = view.header.max_windows;
    if max_windows == 0 {
        return Ok(end);
    }
    for i in strips {
        if max_windows > 1 && view.long_place(i) != Some(end) {
            return Err(format!("strip {i} is not where the one before ends"));
        }
        let strip = view.try_strip(i).ok_or_else(|| format!("strip {i} cut off"))?;
        if strip.window_count() > usize::from(max_windows) {
            return Err(format!("strip {i} is longer than its page says"));
        }
        end += if max_windows > 1 { strip.long_record_bytes() } else { WINDOW_RECORD_BYTES };
    }
    Ok(end)
}

fn check_strand_code(cluster: &ClusterView) -> Result<(), &'static str> {
    cluster.vertex_code().check_axes()?;
    cluster.strand_code().check(cluster.vertex_code())?;
    if cluster.radius_code().is_sane() { Ok(()) } else { Err("radii that are not finite or not above zero") }
}

fn check_strand(cluster: &ClusterView, number: usize) -> Result<(), &'static str> {
    let record = cluster.page.strand_record(number).ok_or("cut off")?;
    let strand = StrandView::of(record);
    if strand.record() != *record {
        return Err("no window of a strand");
    }
    let code = cluster.vertex_code();
    cluster.strand_code().check_window(code, strand)?;
    // Fixed-point coordinates are finite whatever the bits.
    if !(0..3).any(|axis| code.is_float(axis)) {
        return Ok(());
    }
    let points = cluster.strand_points(strand);
    let is_finite = points.axes.iter().flatten().all(|x| x.is_finite());
    if is_finite { Ok(()) } else { Err("a point is not finite") }
}

fn check_strip(strip: &StripView, last_vertex: u8) -> Result<(), &'static str> {
    let (last, full) = strip.heads().split_last().ok_or("no windows")?;
    let is_full = |&head: &u8| WindowHead(head).count() == WINDOW_TRIANGLES;
    if !full.iter().all(is_full) || WindowHead(*last).count() > WINDOW_TRIANGLES {
        return Err("bad number of triangles");
    }
    if strip.primitive_count() > MAX_STRIP_TRIANGLES {
        return Err("too many triangles");
    }
    if !strip.all_refs().iter().all(|&r| r <= last_vertex) {
        return Err("refers to a vertex that does not exist");
    }
    let splits = strip.tree_bytes() / SPLIT_BYTES;
    if !(0..splits).all(|i| strip.split_bits(i) >> 31 == 0 && strip.split(i).axis < 3) {
        return Err("bad split");
    }
    Ok(())
}

/// True where the page's planes are finite.
fn grid_is_sane(header: &PageHeader) -> bool {
    let grid = header.grid();
    grid.exponent.iter().all(|&e| e > -127)
        && (0..3).all(|axis| grid.origin[axis].is_finite() && is_f32(grid.plane(axis, u16::MAX)))
}

/// True where the page is not turned, or by a quaternion of unit length at about.
fn turn_is_sane(header: &PageHeader) -> bool {
    let length_squared = header.turn.iter().map(|x| x * x).sum::<f32>();
    !header.is_turned()
        || (0.99..1.01).contains(&length_squared) && header.grid_origin.iter().all(|x| x.is_finite())
}

fn is_f32(x: f64) -> bool {
    (x as f32).is_finite()
}

/// Checks that nodes form trees of bounded depth whose leaves are strips.
fn check_trees(view: &PageView, depth_limit: usize) -> Result<(), String> {
    let page = view.grid();
    let check_node = |node: &WideNode| {
        let grid = node.grid(page);
        let planes_are_finite =
            grid.exponent.iter().all(|&e| e > -127) && (0..3).all(|axis| is_f32(grid.plane(axis, 255)));
        match node.child_count() {
            _ if !planes_are_finite || node.reserved != 0 || node.reserved_too != 0 => Err("bad grid"),
            1..=WIDTH => Ok(()),
            _ => Err("bad number of children"),
        }
    };
    let child = |node: &WideNode, slot: usize| {
        let number = usize::from(node.first) + slot;
        let cluster = view.clusters.get(usize::from(node.cluster));
        let strips = cluster
            .map(|c| usize::from(c.first_strip)..usize::from(c.first_strip) + usize::from(c.strip_count));
        match strips {
            _ if slot >= node.child_count() => Child::None,
            _ if !node.holds_strips() && node.cluster != 0 => {
                Child::Broken("names a cluster it has no use for")
            }
            _ if !node.holds_strips() => Child::Node(number),
            None => Child::Broken("no such cluster"),
            Some(strips) if strips.contains(&number) => Child::Leaf,
            Some(_) => Child::Broken("a strip that is not of its cluster"),
        }
    };
    let children = |node: &WideNode| std::array::from_fn(|slot| child(node, slot));
    check_nodes(view.nodes, depth_limit, check_node, children).map(|_| ())
}
