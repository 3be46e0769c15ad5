//! The hierarchies above the pages: that of the scene, and one for each part that instances show.

use crate::gathered::Gathered;
use raystrips_geom::Aabb;
use raystrips_geom::affine::transformed_bounds;
use raystrips_pack::Instance;
use raystrips_strips::{Bvh, bvh};

/// Boxes in a part around whose places the box of an instance is.
const TURNED_BOXES: usize = 32;

/// A hierarchy for what stands where it is in the pack, one for each part, and instances of these.
pub(crate) struct Forest {
    /// None if there are instances alone.
    pub scene: Option<Bvh>,
    /// None of parts without area.
    pub parts: Vec<Option<Bvh>>,
    /// `root` is the number of a part that has a hierarchy, from 0 on.
    instances: Vec<Instance>,
    /// Leaf i is instance i.
    tree_of_instances: Option<Bvh>,
    /// Triangles and segments, those of parts as often as they are shown.
    pub shown: u64,
}

impl Forest {
    /// The hierarchies over all pieces, whose leaves, one hierarchy after the other, are the pieces.
    pub fn of(gathered: &Gathered, mut instances: Vec<Instance>) -> Forest {
        let parts = gathered.parts.iter().map(|part| part.as_ref().map(|pieces| pieces.tree.clone()));
        let mut forest = Forest {
            scene: gathered.scene_tree(),
            parts: parts.collect(),
            instances: Vec::new(),
            tree_of_instances: None,
            shown: gathered.scene_primitives(),
        };
        instances.retain(|instance| forest.parts[instance.root as usize].is_some());
        for part in instances.iter().filter_map(|instance| gathered.parts[instance.root as usize].as_ref()) {
            forest.shown = forest.shown.saturating_add(part.primitives());
        }
        Forest { instances, ..forest }
    }

    /// The same with the hierarchies of pieces in place of the leaves, from first to last, and with one over instances.
    pub fn down_to_pages(self, mut next_piece: impl FnMut() -> Bvh) -> Forest {
        let mut graft = |tree: Bvh| tree.graft(&mut |_, _| next_piece());
        let mut forest = Forest {
            scene: self.scene.map(&mut graft),
            parts: self.parts.into_iter().map(|part| part.map(&mut graft)).collect(),
            ..self
        };
        let bounds: Vec<Aabb> = forest.instances.iter().map(|instance| forest.bounds_of(instance)).collect();
        if !bounds.is_empty() {
            let built = bvh::build(&bounds, &|_| false);
            forest.instances = built.order.iter().map(|&i| forest.instances[i as usize]).collect();
            forest.tree_of_instances = Some(built.tree);
        }
        forest
    }

    fn bounds_of(&self, instance: &Instance) -> Aabb {
        // Around many boxes of what turns there is less room than around one.
        let boxes =
            self.parts[instance.root as usize].iter().flat_map(|tree| tree.open(TURNED_BOXES, |_| true));
        let world_from_local = instance.world_from_local();
        boxes.fold(Aabb::EMPTY, |all, part| all.union(transformed_bounds(&part.bounds(), &world_from_local)))
    }

    /// What parts show where.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The hierarchy of the scene: its leaves are those of `scene`, then the instances.
    pub fn scene_with_instances(&self) -> Bvh {
        let trees = self.scene.iter().chain(&self.tree_of_instances).cloned();
        trees.reduce(Bvh::join).expect("there is something to be seen").number_leaves()
    }
}
