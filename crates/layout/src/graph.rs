//! Graphs whose neighbors are used together, and how well an order serves that.

use crate::Permutation;

/// A graph without directions.
///
/// Memory: 4 bytes a node and 8 an edge.
#[derive(Clone, Debug)]
pub struct Graph {
    /// Where the neighbors of each node begin in `neighbors`, and their end.
    starts: Vec<u32>,
    neighbors: Vec<u32>,
}

impl Graph {
    /// The graph of `count` nodes with these edges. Edges that are there twice, or lead from a node to itself, count once
    /// or not at all.
    ///
    /// # Panics
    /// If an edge leads to a node that does not exist.
    pub fn new(count: usize, edges: &[[u32; 2]]) -> Graph {
        let mut both: Vec<[u32; 2]> = edges.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        both.retain(|[a, b]| a != b);
        both.sort_unstable();
        both.dedup();
        let mut starts = vec![0; count + 1];
        both.iter().for_each(|edge| starts[edge[0] as usize + 1] += 1);
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        Graph { starts, neighbors: both.into_iter().map(|edge| edge[1]).collect() }
    }

    /// Nodes.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Neighbors of a node, in ascending order.
    pub fn neighbors(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.neighbors[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    /// The mean of log2 of how far apart the ends of an edge are in `order`: the less, the fewer blocks are missed,
    /// whatever their size (Yoon and Lindstrom 2006, "Mesh layouts for block-based caches"). 0 without edges.
    pub fn mean_log_length(&self, order: &Permutation) -> f64 {
        self.mean(order, |distance| distance.log2())
    }

    /// The probability that a step along an edge leads to another block of `size` nodes, wherever blocks begin. 0 without
    /// edges.
    pub fn expected_misses(&self, order: &Permutation, size: u32) -> f64 {
        self.mean(order, |distance| (distance / f64::from(size)).min(1.0))
    }

    /// The mean of something over the distances of all edges.
    fn mean(&self, order: &Permutation, of_distance: impl Fn(f64) -> f64) -> f64 {
        let places = order.places();
        let place = |node: u32| places[node as usize];
        let from = |node: u32| {
            let distances = self.neighbors(node).iter().map(move |&other| place(node).abs_diff(place(other)));
            distances.map(|distance| of_distance(f64::from(distance))).sum::<f64>()
        };
        (0..self.len() as u32).map(from).sum::<f64>() / self.neighbors.len().max(1) as f64
    }
}

#[cfg(test)]
pub(crate) mod testing {
    use super::Graph;

    /// A square grid row by row, and its points.
    pub fn grid(side: u32) -> (Graph, Vec<[f32; 3]>) {
        let cells = || (0..side * side).map(|i| [i % side, i / side]);
        let edges = cells().zip(0..).flat_map(|([x, y], i)| {
            let right = (x + 1 < side).then_some([i, i + 1]);
            right.into_iter().chain((y + 1 < side).then_some([i, i + side]))
        });
        let points = cells().map(|[x, y]| [x as f32, y as f32, 0.0]).collect();
        (Graph::new((side * side) as usize, &edges.collect::<Vec<_>>()), points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_count_once() {
        let graph = Graph::new(4, &[[0, 1], [1, 0], [1, 1], [3, 0], [0, 1]]);
        assert_eq!(
            [0, 1, 2, 3].map(|node| graph.neighbors(node).to_vec()),
            [vec![1, 3], vec![0], vec![], vec![0]]
        );
    }

    #[test]
    fn distances_are_those_of_the_order() {
        // A way through four nodes, and one that jumps: distances 1, 1, 1 and 2, 1, 2.
        let graph = Graph::new(4, &[[0, 1], [1, 2], [2, 3]]);
        let jumping = Permutation::of_order(vec![0, 2, 1, 3]).unwrap();
        assert_eq!(graph.mean_log_length(&Permutation::identity(4)), 0.0);
        assert!((graph.mean_log_length(&jumping) - 2.0 / 3.0).abs() < 1e-12);
        assert!((graph.expected_misses(&jumping, 2) - 5.0 / 6.0).abs() < 1e-12);
        assert!((graph.expected_misses(&Permutation::identity(4), 4) - 0.25).abs() < 1e-12);
    }
}
