//! The nodes of a page and their order. Children of one node lie side by side, so siblings are ordered as one.

use super::Layout;
use raystrips_layout::Tree;
use raystrips_strips::collapse::Numbered;
use raystrips_strips::{Bvh, Collapse};

/// The nodes of a page.
pub(crate) struct PageNodes<'a> {
    /// In depth-first order; the first ones are the roots.
    siblings: Vec<Siblings<'a>>,
    /// Levels of nodes below each root, itself counted.
    pub depths: Vec<u32>,
}

/// Nodes that are the children of one node, or all roots.
struct Siblings<'a> {
    /// Hierarchies that they stand for, each with the siblings that are its children if it has any.
    nodes: Vec<(&'a Bvh, Option<u32>)>,
    /// Siblings with their parent.
    parent: Option<u32>,
    /// What the probability that a ray reads them is proportional to.
    area: f32,
}

/// A node with its number in the page.
pub(crate) struct PlacedNode<'a> {
    pub number: u16,
    pub tree: &'a Bvh,
    /// Its children, of which the first has this number; none for a leaf.
    pub children: Vec<&'a Bvh>,
    pub first_child: u16,
}

impl<'a> PageNodes<'a> {
    /// The nodes of a page with these roots.
    pub fn new(roots: &[&'a Bvh]) -> PageNodes<'a> {
        let area = roots.iter().map(|root| root.bounds().half_area()).sum();
        let nodes = roots.iter().map(|&root| (root, None)).collect();
        let mut page =
            PageNodes { siblings: vec![Siblings { nodes, parent: None, area }], depths: Vec::new() };
        for (slot, &root) in roots.iter().enumerate() {
            let depth = page.below((0, slot), (root, 0), &Collapse::of(root));
            page.depths.push(depth);
        }
        page
    }

    /// Adds all below the node in a slot of some siblings; tells how many levels there are with it.
    fn below(&mut self, (own, slot): (u32, usize), node: Numbered<'a>, collapse: &Collapse) -> u32 {
        let children = collapse.children(node);
        if children.is_empty() {
            return 1;
        }
        let number = self.siblings.len() as u32;
        self.siblings[own as usize].nodes[slot].1 = Some(number);
        self.siblings.push(Siblings {
            nodes: children.iter().map(|child| (child.0, None)).collect(),
            parent: Some(own),
            area: node.0.bounds().half_area(),
        });
        let depths =
            children.into_iter().enumerate().map(|(slot, child)| self.below((number, slot), child, collapse));
        depths.max().unwrap_or(0) + 1
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.siblings.iter().map(|siblings| siblings.nodes.len()).sum()
    }

    /// All nodes with their places in `layout`.
    ///
    /// # Panics
    /// If there are more than a page can number.
    pub fn placed(&self, layout: Layout) -> Vec<PlacedNode<'a>> {
        let parents: Vec<Option<u32>> = self.siblings.iter().map(|siblings| siblings.parent).collect();
        let tree = Tree::new(&parents, self.siblings.iter().map(|siblings| siblings.area).collect());
        let mut firsts = vec![0; self.siblings.len()];
        let mut next = 0;
        for &i in layout.of_nodes().of(&tree).order() {
            firsts[i as usize] = next;
            next += self.siblings[i as usize].nodes.len();
        }
        let number = |i: usize| u16::try_from(i).expect("a page can number its nodes");
        let mut placed = Vec::with_capacity(next);
        for (siblings, &first) in self.siblings.iter().zip(&firsts) {
            placed.extend(siblings.nodes.iter().zip(first..).map(|(&(tree, below), place)| PlacedNode {
                number: number(place),
                tree,
                children: below.map_or(Vec::new(), |i| self.siblings[i as usize].trees()),
                first_child: below.map_or(0, |i| number(firsts[i as usize])),
            }));
        }
        placed
    }
}

impl<'a> Siblings<'a> {
    fn trees(&self) -> Vec<&'a Bvh> {
        self.nodes.iter().map(|node| node.0).collect()
    }
}
