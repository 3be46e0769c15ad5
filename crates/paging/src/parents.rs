//! The way up from any place above the pages.

use raystrips_pack::{Pack, TopNode};

/// The node above each node, each way into a page and each instance.
#[derive(Debug)]
pub(crate) struct Parents {
    nodes: Vec<u32>,
    entries: Vec<u32>,
    instances: Vec<u32>,
}

impl Parents {
    pub fn of(pack: &Pack) -> Parents {
        let mut parents = Parents {
            nodes: vec![0; pack.top_nodes.len()],
            entries: vec![0; pack.top_entries.len()],
            instances: vec![0; pack.instances.len()],
        };
        for (parent, node) in pack.top_nodes.iter().enumerate() {
            for &child in &node.child[..node.child_count()] {
                *parents.slot(child) = parent as u32;
            }
        }
        parents
    }

    /// The node above the child with this link.
    #[inline]
    pub fn get(&self, link: u32) -> u32 {
        let number = (link & !TopNode::KIND) as usize;
        match link & TopNode::KIND {
            TopNode::NODE => self.nodes[number],
            TopNode::INSTANCE => self.instances[number],
            _ => self.entries[number],
        }
    }

    fn slot(&mut self, link: u32) -> &mut u32 {
        let number = (link & !TopNode::KIND) as usize;
        match link & TopNode::KIND {
            TopNode::NODE => &mut self.nodes[number],
            TopNode::INSTANCE => &mut self.instances[number],
            _ => &mut self.entries[number],
        }
    }

    /// Bytes of memory.
    pub fn bytes(pack: &Pack) -> u64 {
        4 * (pack.top_nodes.len() + pack.top_entries.len() + pack.instances.len()) as u64
    }
}
