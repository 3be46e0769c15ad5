//! The nodes above the pages.

use crate::forest::Forest;
use raystrips_geom::Aabb;
use raystrips_pack::layout::{ChildBoxes, MAX_DEPTH, MAX_INSTANCES, MAX_PAGES, WIDTH};
use raystrips_pack::{Instance, PackError, TopEntry, TopNode};
use raystrips_strips::Bvh;

/// What is above the pages.
pub(crate) struct Top {
    pub nodes: Vec<TopNode>,
    pub entries: Vec<TopEntry>,
    pub instances: Vec<Instance>,
    /// Box around all that is shown.
    pub bounds: Aabb,
    /// Most levels of nodes from the root to a strip.
    pub depth: u32,
}

/// A way into a page, and the levels of nodes there.
pub(crate) struct Entry {
    pub entry: TopEntry,
    pub depth: u32,
}

/// Most levels of nodes from a root on: above the pages, and in all.
#[derive(Default)]
struct Levels {
    above: u32,
    all: u32,
}

impl Top {
    /// Nodes for the hierarchies of `forest`, whose leaves lead to the entries, one hierarchy after the other.
    pub fn over(forest: &Forest, entries: &[Entry]) -> Result<Top, PackError> {
        let too_large = |what: String| Err(PackError::TooLarge(what));
        if entries.len() as u64 > MAX_PAGES {
            let what = "more ways into pages than 29 bits can number; use a larger --page-size";
            return too_large(what.into());
        }
        if forest.instances().len() as u64 > MAX_INSTANCES {
            return too_large("more instances than 29 bits can number; split the scene".into());
        }
        let scene = forest.scene_with_instances();
        let mut top = Top {
            nodes: Vec::new(),
            entries: entries.iter().map(|e| e.entry).collect(),
            instances: forest.instances().to_vec(),
            bounds: scene.bounds(),
            depth: 0,
        };
        let mut first = forest.scene.as_ref().map_or(0, |tree| tree.items().end);
        let mut levels = Levels::default();
        let leaf = |number: usize| match number.checked_sub(first) {
            Some(instance) => (TopNode::INSTANCE | instance as u32, 0),
            None => (TopNode::ENTRY | number as u32, entries[number].depth),
        };
        top.add(&scene, 1, &leaf, &mut levels);
        let mut in_parts = 0;
        let mut roots = Vec::with_capacity(forest.parts.len());
        for part in &forest.parts {
            let Some(tree) = part else {
                roots.push(0);
                continue;
            };
            let mut levels = Levels::default();
            let leaf =
                |number: usize| (TopNode::ENTRY | (first + number) as u32, entries[first + number].depth);
            roots.push(top.add(tree, 1, &leaf, &mut levels));
            first += tree.items().end;
            in_parts = in_parts.max(levels.all);
        }
        top.instances.iter_mut().for_each(|instance| instance.root = roots[instance.root as usize]);
        top.depth = levels.all.max(levels.above + in_parts);
        if top.depth as usize > MAX_DEPTH {
            let what = format!("a hierarchy {} levels deep; the format allows {MAX_DEPTH}", top.depth);
            return too_large(what);
        }
        Ok(top)
    }

    /// Adds a node for `tree`, and all below it; gives its number. `leaf` tells the child that a leaf is, and the levels of
    /// nodes below.
    fn add(
        &mut self,
        tree: &Bvh,
        level: u32,
        leaf: &impl Fn(usize) -> (u32, u32),
        levels: &mut Levels,
    ) -> u32 {
        levels.above = levels.above.max(level);
        let children = tree.open(WIDTH, |_| true);
        let bounds: Vec<Aabb> = children.iter().map(|c| c.bounds()).collect();
        let node = self.nodes.len();
        self.nodes.push(TopNode { boxes: ChildBoxes::around(&bounds), child: [TopNode::EMPTY; WIDTH] });
        for (slot, child) in children.into_iter().enumerate() {
            self.nodes[node].child[slot] = match child {
                Bvh::Leaf { items, .. } => {
                    let (child, depth) = leaf(items.start);
                    levels.all = levels.all.max(level + depth);
                    child
                }
                Bvh::Inner { .. } => TopNode::NODE | self.add(child, level + 1, leaf, levels),
            };
        }
        node as u32
    }
}
