//! Orders of the nodes of a graph.

use crate::{Graph, Permutation, multilevel};
use raystrips_geom::curve::Curve;

/// How the nodes of a graph, which lie at points, are ordered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GraphOrder {
    /// As they come.
    Input,
    /// At random, the same every time for one seed: what orders can be compared with.
    Random(u64),
    /// Along a curve through their points.
    Along(Curve),
    /// By cutting the graph in two again and again where that cuts few edges (after Yoon, Lindstrom, Pascucci, Manocha 2005,
    /// "Cache-oblivious mesh layouts").
    CacheOblivious,
}

/// Bits of a coordinate on a curve.
const BITS: u32 = 21;

impl GraphOrder {
    /// The order of the nodes of `graph`, of which node i lies at `points[i]`. Coordinates that are not finite count as the
    /// least.
    ///
    /// # Panics
    /// If there are not as many points as nodes.
    pub fn of(self, graph: &Graph, points: &[[f32; 3]]) -> Permutation {
        assert_eq!(graph.len(), points.len(), "nodes and points");
        match self {
            GraphOrder::Input => Permutation::identity(graph.len()),
            GraphOrder::Random(seed) => random(graph.len(), seed),
            GraphOrder::Along(curve) => along(curve, points),
            GraphOrder::CacheOblivious => multilevel::order(graph),
        }
    }
}

fn random(count: usize, seed: u64) -> Permutation {
    Permutation::by_key(&(0..count as u64).map(|i| mix(seed.wrapping_add(i))).collect::<Vec<u64>>())
}

/// A number that looks like chance (SplitMix64, Steele et al. 2014).
fn mix(i: u64) -> u64 {
    let mut z = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

fn along(curve: Curve, points: &[[f32; 3]]) -> Permutation {
    let finite = |axis: usize| points.iter().map(move |p| p[axis]).filter(|x| x.is_finite());
    let min: [f32; 3] = std::array::from_fn(|axis| finite(axis).fold(f32::INFINITY, f32::min));
    let max: [f32; 3] = std::array::from_fn(|axis| finite(axis).fold(f32::NEG_INFINITY, f32::max));
    // A cube, so that cells are not longer along one axis.
    let size =
        (0..3).map(|axis| f64::from(max[axis]) - f64::from(min[axis])).fold(f64::MIN_POSITIVE, f64::max);
    let cell = |x: f32, min: f32| {
        let scaled = (f64::from(x) - f64::from(min)) / size * f64::from(1u32 << BITS);
        (scaled as u32).min((1 << BITS) - 1)
    };
    let key =
        |p: &[f32; 3]| curve.place(std::array::from_fn::<u32, 3, _>(|axis| cell(p[axis], min[axis])), BITS);
    Permutation::by_key(&points.iter().map(key).collect::<Vec<u64>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::testing::grid;
    use proptest::prelude::*;

    const ALL: [GraphOrder; 5] = [
        GraphOrder::Input,
        GraphOrder::Random(7),
        GraphOrder::Along(Curve::Z),
        GraphOrder::Along(Curve::Hilbert),
        GraphOrder::CacheOblivious,
    ];

    #[test]
    fn orders_of_a_grid_are_as_good_as_they_should() {
        let (graph, points) = grid(64);
        let [rows, random, z, hilbert, oblivious] =
            ALL.map(|how| graph.mean_log_length(&how.of(&graph, &points)));
        assert!((rows - 3.0).abs() < 0.01, "{rows}");
        assert!(random > 9.0, "{random}");
        assert!(z < rows && hilbert < rows, "{z} {hilbert}");
        assert!(oblivious < z && oblivious < 1.15 * hilbert, "{oblivious} {z} {hilbert}");
    }

    #[test]
    fn points_that_are_nowhere_are_ordered_too() {
        let points = [[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]];
        for how in ALL {
            assert_eq!(how.of(&Graph::new(4, &[]), &points).order().len(), 4);
        }
    }

    proptest! {
        #[test]
        fn every_node_has_a_place(edges in prop::collection::vec(prop::array::uniform2(0u32..150), 0..400)) {
            let graph = Graph::new(150, &edges);
            let points: Vec<[f32; 3]> = (0..150).map(|i| [(i * i % 71) as f32, i as f32, 0.5]).collect();
            for how in ALL {
                let order = how.of(&graph, &points).order().to_vec();
                prop_assert!(Permutation::of_order(order).is_some_and(|p| p.order().len() == 150));
            }
        }
    }
}
