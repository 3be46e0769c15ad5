//! Where in a pack things lie: pages in their piece, nodes in their page, vertices in their cluster. Strips lie with the
//! vertices of their cluster, whose order is that of the hierarchy. None of this changes what rays hit.

pub(crate) mod nodes;
pub(crate) mod pages;
pub(crate) mod vertices;

use raystrips_geom::curve::Curve;
use raystrips_layout::{GraphOrder, TreeOrder};

/// An order for what is in a pack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Layout {
    /// Pages and nodes depth first, vertices by first use: the best of them (`docs/RESULTS.md`, "Layouts").
    #[default]
    DepthFirst,
    /// Pages and nodes level by level.
    BreadthFirst,
    /// Pages and nodes in the order of van Emde Boas.
    VanEmdeBoas,
    /// Pages and nodes by clusters of probable ones, vertices such that neighbors are near at every scale.
    CacheOblivious,
    /// Pages and vertices along a Morton curve.
    Morton,
    /// Pages and vertices along a Hilbert curve.
    Hilbert,
    /// Pages and vertices at random, for comparison.
    Random,
}

/// The pages and vertices of [`Layout::Random`] are the same every time.
const SEED: u64 = 0x7261_7973;

impl Layout {
    /// The order of nodes; those of a mesh keep nodes depth first, since parents must come before their children.
    fn of_nodes(self) -> TreeOrder {
        self.of_tree().unwrap_or(TreeOrder::DepthFirst)
    }

    /// The order of what is in a tree, if this is one for trees.
    fn of_tree(self) -> Option<TreeOrder> {
        match self {
            Layout::DepthFirst => Some(TreeOrder::DepthFirst),
            Layout::BreadthFirst => Some(TreeOrder::BreadthFirst),
            Layout::VanEmdeBoas => Some(TreeOrder::VanEmdeBoas),
            Layout::CacheOblivious => Some(TreeOrder::CacheOblivious),
            Layout::Morton | Layout::Hilbert | Layout::Random => None,
        }
    }

    /// The order of what lies at points.
    fn of_graph(self) -> GraphOrder {
        match self {
            Layout::DepthFirst | Layout::BreadthFirst | Layout::VanEmdeBoas => GraphOrder::Input,
            Layout::CacheOblivious => GraphOrder::CacheOblivious,
            Layout::Morton => GraphOrder::Along(Curve::Z),
            Layout::Hilbert => GraphOrder::Along(Curve::Hilbert),
            Layout::Random => GraphOrder::Random(SEED),
        }
    }
}
