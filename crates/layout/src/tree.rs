//! Trees that are walked from the root, each node with some probability.

/// A tree, or several, whose nodes are numbered such that parents come before their children.
///
/// Memory: 16 bytes a node.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Where the children of each node begin in `children`, and their end.
    starts: Vec<u32>,
    children: Vec<u32>,
    roots: Vec<u32>,
    probability: Vec<f32>,
}

impl Tree {
    /// The tree in which node i has a parent, unless it is a root, and is visited with a probability (or anything that
    /// probabilities are proportional to, such as the area of a box). Siblings stay in the order of their numbers.
    ///
    /// # Panics
    /// If a parent does not come before its child, or there are not as many probabilities as nodes.
    pub fn new(parents: &[Option<u32>], probability: Vec<f32>) -> Tree {
        assert_eq!(parents.len(), probability.len(), "nodes and probabilities");
        let mut starts = vec![0; parents.len() + 1];
        for (node, parent) in parents.iter().enumerate() {
            assert!(parent.is_none_or(|p| (p as usize) < node), "the parent of node {node} comes after it");
            parent.iter().for_each(|&p| starts[p as usize + 1] += 1);
        }
        for i in 0..parents.len() {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut children = vec![0; starts[parents.len()] as usize];
        let mut roots = Vec::new();
        for (node, parent) in (0..).zip(parents) {
            match parent {
                Some(parent) => {
                    let next = &mut next[*parent as usize];
                    children[*next as usize] = node;
                    *next += 1;
                }
                None => roots.push(node),
            }
        }
        Tree { starts, children, roots, probability }
    }

    /// Nodes.
    pub fn len(&self) -> usize {
        self.probability.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.probability.is_empty()
    }

    /// Nodes without a parent.
    pub fn roots(&self) -> &[u32] {
        &self.roots
    }

    /// Children of a node.
    pub fn children(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.children[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    /// How probable a visit to a node is.
    pub fn probability(&self, node: u32) -> f32 {
        self.probability[node as usize]
    }
}

#[cfg(test)]
pub(crate) mod testing {
    use super::Tree;
    use proptest::prelude::*;

    /// A tree of `levels` full levels; each child is half as probable as its parent.
    pub fn full_binary(levels: u32) -> Tree {
        let count = (1 << levels) - 1;
        let parents: Vec<Option<u32>> = (0..count).map(|i: u32| i.checked_sub(1).map(|i| i / 2)).collect();
        Tree::new(&parents, (0..count).map(|i| 1.0 / (i + 1) as f32).collect())
    }

    /// Trees of any shape.
    pub fn any_tree() -> impl Strategy<Value = Tree> {
        prop::collection::vec((any::<prop::sample::Index>(), 0.0f32..1.0), 1..200).prop_map(|nodes| {
            let parent = |(i, (index, _)): (usize, &(prop::sample::Index, f32))| {
                (i > 0 && index.index(10) > 0).then(|| index.index(i) as u32)
            };
            let parents: Vec<Option<u32>> = nodes.iter().enumerate().map(parent).collect();
            Tree::new(&parents, nodes.iter().map(|node| node.1).collect())
        })
    }
}
