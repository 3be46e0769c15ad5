//! The hierarchies above the pages: that of the scene, and one for each part that instances show.

use crate::gathered::Gathered;
use raystrips_geom::Aabb;
use raystrips_geom::affine::transformed_bounds;
use raystrips_pack::Instance;
use raystrips_strips::{Bvh, bvh};

/// A hierarchy for what stands where it is in the pack, one for each part, and instances of these.
pub(crate) struct Forest {
    /// None if there are instances alone.
    pub scene: Option<Bvh>,
    /// None of parts without area.
    pub parts: Vec<Option<Bvh>>,
    /// In the order of a hierarchy over them; `root` is the number of a part that has a hierarchy, from 0 on.
    instances: Vec<Instance>,
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
        let bounds: Vec<Aabb> = instances.iter().map(|instance| forest.bounds_of(instance)).collect();
        if !bounds.is_empty() {
            let built = bvh::build(&bounds, &|_| false);
            forest.instances = built.order.iter().map(|&i| instances[i as usize]).collect();
            forest.tree_of_instances = Some(built.tree);
        }
        forest
    }

    fn bounds_of(&self, instance: &Instance) -> Aabb {
        let part = self.parts[instance.root as usize].as_ref().map_or(Aabb::EMPTY, Bvh::bounds);
        transformed_bounds(&part, &instance.world_from_local())
    }

    /// What parts show where.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The same with other hierarchies in place of all leaves, visited from first to last.
    pub fn graft(self, mut f: impl FnMut() -> Bvh) -> Forest {
        let mut graft = |tree: Bvh| tree.graft(&mut |_, _| f());
        Forest {
            scene: self.scene.map(&mut graft),
            parts: self.parts.into_iter().map(|part| part.map(&mut graft)).collect(),
            ..self
        }
    }

    /// The hierarchy of the scene: its leaves are those of `scene`, then the instances.
    pub fn scene_with_instances(&self) -> Bvh {
        let trees = self.scene.iter().chain(&self.tree_of_instances).cloned();
        let join =
            |a: Bvh, b: Bvh| Bvh::Inner { bounds: a.bounds().union(b.bounds()), children: Box::new([a, b]) };
        trees.reduce(join).expect("there is something to be seen").number_leaves()
    }
}
