//! Orders in which what is used together lies together, whatever the size of a block.
//!
//! A layout is a [`Permutation`] of things that are known by number alone: the nodes of a [`Tree`] that is walked from
//! its root ([`TreeOrder`]), or those of a [`Graph`] that is walked from neighbor to neighbor ([`GraphOrder`]). What they
//! stand for, and how many bytes they have, is the caller's. [`treelets`] cuts a tree for blocks of one known size.
//!
//! What is larger than memory is laid out in parts: the order of the parts first, then that within each.

mod graph;
mod graph_order;
mod multilevel;
mod permutation;
mod tree;
mod tree_order;
mod treelets;

pub use graph::Graph;
pub use graph_order::GraphOrder;
pub use permutation::Permutation;
pub use tree::Tree;
pub use tree_order::TreeOrder;
pub use treelets::{Treelets, treelets};
