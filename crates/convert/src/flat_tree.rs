//! A hierarchy as a list, to be put into the journal.

use glam::Vec3;
use raystrips_geom::Aabb;
use raystrips_strips::Bvh;
use serde::{Deserialize, Serialize};

/// The nodes of a hierarchy with single, numbered items, each before those below it: min, max, and whether it is a
/// leaf.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FlatTree(Vec<([f32; 3], [f32; 3], bool)>);

impl FlatTree {
    pub fn of(tree: &Bvh) -> FlatTree {
        let mut flat = FlatTree(Vec::new());
        flat.push(tree);
        flat
    }

    fn push(&mut self, tree: &Bvh) {
        let bounds = tree.bounds();
        let children = if let Bvh::Inner { children, .. } = tree { children.as_slice() } else { &[] };
        self.0.push((bounds.min.to_array(), bounds.max.to_array(), children.is_empty()));
        children.iter().for_each(|child| self.push(child));
    }

    /// The hierarchy; `None` if the list is that of none.
    pub fn tree(&self) -> Option<Bvh> {
        let mut nodes = self.0.iter();
        let tree = take(&mut nodes, 0)?;
        nodes.next().is_none().then(|| tree.number_leaves())
    }
}

fn take<'a>(nodes: &mut impl Iterator<Item = &'a ([f32; 3], [f32; 3], bool)>, depth: usize) -> Option<Bvh> {
    /// Deeper than any hierarchy gets; keeps a damaged list from using up the stack.
    const MAX_DEPTH: usize = 1000;
    let &(min, max, is_leaf) = nodes.next().filter(|_| depth < MAX_DEPTH)?;
    let bounds = Aabb { min: Vec3::from_array(min), max: Vec3::from_array(max) };
    if is_leaf {
        return Some(Bvh::Leaf { bounds, items: 0..1 });
    }
    let a = take(nodes, depth + 1)?;
    Some(Bvh::Inner { bounds, children: Box::new([a, take(nodes, depth + 1)?]) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_come_back() {
        let bounds: Vec<Aabb> =
            (0..20).map(|i| Aabb::EMPTY.grow(Vec3::new((i * i) as f32, 1.0, 0.0))).collect();
        let tree = raystrips_strips::bvh::build(&bounds, &|items| items.len() < 2).tree;
        let mut flat = FlatTree::of(&tree);
        assert_eq!(format!("{:?}", flat.tree().unwrap()), format!("{tree:?}"));
        flat.0.pop();
        assert!(flat.tree().is_none());
    }
}
