//! The nodes above the pages.

use raystrips_geom::Aabb;
use raystrips_pack::layout::{ChildBoxes, MAX_DEPTH, MAX_PAGES, WIDTH};
use raystrips_pack::{PackError, TopEntry, TopNode};
use raystrips_strips::Bvh;

/// What is above the pages.
pub(crate) struct Top {
    pub nodes: Vec<TopNode>,
    pub entries: Vec<TopEntry>,
    /// Most levels of nodes from the root to a strip.
    pub depth: u32,
}

/// A way into a page, and the levels of nodes there.
pub(crate) struct Entry {
    pub entry: TopEntry,
    pub depth: u32,
}

impl Top {
    /// Nodes for `tree`, whose leaf i leads to entry i.
    pub fn over(tree: &Bvh, entries: &[Entry]) -> Result<Top, PackError> {
        if entries.len() as u64 > MAX_PAGES {
            let what = "more ways into pages than 29 bits can number; use a larger --page-size";
            return Err(PackError::TooLarge(what.into()));
        }
        let mut top = Top { nodes: Vec::new(), entries: entries.iter().map(|e| e.entry).collect(), depth: 0 };
        top.add(tree, 1, entries);
        if top.depth as usize > MAX_DEPTH {
            let what = format!("a hierarchy {} levels deep; the format allows {MAX_DEPTH}", top.depth);
            return Err(PackError::TooLarge(what));
        }
        Ok(top)
    }

    /// Adds a node for `tree`, and all below it; gives its number.
    fn add(&mut self, tree: &Bvh, level: u32, entries: &[Entry]) -> u32 {
        let children = tree.open(WIDTH, |_| true);
        let bounds: Vec<Aabb> = children.iter().map(|c| c.bounds()).collect();
        let node = self.nodes.len();
        self.nodes.push(TopNode { boxes: ChildBoxes::around(&bounds), child: [TopNode::EMPTY; WIDTH] });
        for (slot, child) in children.into_iter().enumerate() {
            self.nodes[node].child[slot] = match child {
                Bvh::Leaf { items, .. } => {
                    self.depth = self.depth.max(level + entries[items.start].depth);
                    TopNode::ENTRY | items.start as u32
                }
                Bvh::Inner { .. } => TopNode::NODE | self.add(child, level + 1, entries),
            };
        }
        node as u32
    }
}
