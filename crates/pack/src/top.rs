//! The check of what is above the pages: trees of bounded depth whose leaves are pages and instances.

use crate::PackError;
use crate::layout::{Instance, MAX_INSTANCES, MAX_PAGES, TopEntry, TopNode};
use crate::nodes::{Child, Place, check_boxes, check_nodes};
use crate::reader::Pack;

impl Pack {
    pub(crate) fn check_top(&self) -> Result<(), PackError> {
        let wrong = |what: &str| PackError::corrupt(format!("above the pages: {what}"));
        if self.top_entries.len() as u64 > MAX_PAGES || self.instances.len() as u64 > MAX_INSTANCES {
            return Err(wrong("more entries or instances than can be named"));
        }
        let child = |c: u32| {
            let number = (c & !TopNode::KIND) as usize;
            match c & TopNode::KIND {
                _ if c == TopNode::EMPTY => Child::None,
                TopNode::NODE => Child::Node(number),
                TopNode::ENTRY if self.has_entry(number) => Child::Leaf,
                TopNode::INSTANCE if number < self.instances.len() => Child::Leaf,
                TopNode::INSTANCE => Child::Broken("leads to no instance"),
                _ => Child::Broken("leads to no page"),
            }
        };
        let depth_limit = self.manifest.depth as usize;
        let places =
            check_nodes(&self.top_nodes, depth_limit, |n| check_boxes(&n.boxes), |n| n.child.map(child))
                .map_err(|what| wrong(&what))?;
        self.check_instances(&places).map_err(wrong)?;
        self.check_once(TopNode::ENTRY, self.top_entries.len()).map_err(wrong)?;
        self.check_once(TopNode::INSTANCE, self.instances.len()).map_err(wrong)
    }

    /// Checks that there is one tree for the scene, and one for each part that instances show, which has none of its own.
    fn check_instances(&self, places: &[Place]) -> Result<(), &'static str> {
        let mut is_shown = vec![false; places.len()];
        for instance in &self.instances {
            let root = instance.root as usize;
            if root == 0 || places.get(root).is_none_or(|place| place.root != root) {
                return Err("an instance of what is no tree");
            }
            is_shown[root] = true;
            if instance.condition() > Instance::MAX_CONDITION {
                return Err("an instance that there is no way back from");
            }
        }
        let is_root = |i: usize| places[i].root == i;
        if places.is_empty() || (1..places.len()).any(|i| is_root(i) && !is_shown[i]) {
            return Err("not one tree");
        }
        let shows_instances =
            |node: &TopNode| node.child.iter().any(|child| child & TopNode::KIND == TopNode::INSTANCE);
        if self.top_nodes.iter().zip(places).any(|(node, place)| place.root != 0 && shows_instances(node)) {
            return Err("an instance in an instance");
        }
        let levels = |of_scene: bool| {
            let of_tree = places.iter().filter(|place| (place.root == 0) == of_scene);
            of_tree.map(|place| place.level).max().unwrap_or(0)
        };
        match levels(true) + levels(false) > self.manifest.depth as usize {
            true => Err("too deep"),
            false => Ok(()),
        }
    }

    /// Checks that each of so many children of a kind is below one node at most.
    fn check_once(&self, kind: u32, count: usize) -> Result<(), &'static str> {
        let mut is_child = vec![false; count];
        let children = self.top_nodes.iter().flat_map(|n| n.child).filter(|c| c & TopNode::KIND == kind);
        for child in children {
            if std::mem::replace(&mut is_child[(child & !TopNode::KIND) as usize], true) {
                return Err(match kind {
                    TopNode::ENTRY => "an entry below two nodes",
                    _ => "an instance below two nodes",
                });
            }
        }
        Ok(())
    }

    fn has_entry(&self, i: usize) -> bool {
        let page_has =
            |e: &TopEntry| self.directory.get(e.page as usize).is_some_and(|p| e.node < p.node_count);
        self.top_entries.get(i).is_some_and(page_has)
    }
}
