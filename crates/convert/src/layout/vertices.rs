//! The order of vertices in a cluster.

use super::Layout;
use rayon::prelude::*;
use raystrips_layout::{Graph, GraphOrder};
use raystrips_strips::Cluster;

/// Orders the vertices of each cluster, which come by first use.
pub(crate) fn order_vertices(layout: Layout, clusters: &mut [Cluster]) {
    let how = layout.of_graph();
    if how != GraphOrder::Input {
        clusters.par_iter_mut().for_each(|cluster| order_cluster(how, cluster));
    }
}

fn order_cluster(how: GraphOrder, cluster: &mut Cluster) {
    let points: Vec<[f32; 3]> = cluster.vertices.iter().map(|v| v.to_array()).collect();
    let order = how.of(&used_together(cluster), &points);
    cluster.vertices = order.order().iter().map(|&i| cluster.vertices[i as usize]).collect();
    let places = order.places();
    for r in cluster.strips.iter_mut().flat_map(|strip| &mut strip.refs) {
        *r = places[usize::from(*r)] as u8;
    }
}

/// Vertices that triangles of a strip have in common.
fn used_together(cluster: &Cluster) -> Graph {
    let triangles = cluster.strips.iter().flat_map(|strip| strip.refs.windows(3));
    let pairs = triangles.flat_map(|r| [[r[0], r[1]], [r[1], r[2]], [r[0], r[2]]]);
    let edges: Vec<[u32; 2]> = pairs.map(|pair| pair.map(u32::from)).collect();
    Graph::new(cluster.vertices.len(), &edges)
}
