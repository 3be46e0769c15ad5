//! Morph targets: what weights add to the vertices of a primitive.

use super::accessor::Accessor;
use super::primitive::Primitives;
use super::syntax;
use crate::Result;
use gltf::json::accessor::Type;
use gltf::json::mesh::{MorphTarget, Primitive};

/// Displacements of a primitive's vertices, each with its weight.
#[derive(Default)]
pub(super) struct Morph<'a>(Vec<(f64, Accessor<'a>)>);

/// Which accessor of a target is meant.
#[derive(Clone, Copy)]
pub(super) enum Displaced {
    Positions,
    Normals,
}

impl<'a> Morph<'a> {
    /// What `weights` leave of the targets of the primitive at the place `at`, which has `count` vertices.
    pub fn new(
        primitives: &Primitives<'a>,
        primitive: &Primitive,
        weights: &[f32],
        displaced: Displaced,
        count: u64,
        at: &str,
    ) -> Result<Morph<'a>> {
        let mut morph = Morph::default();
        let targets = primitive.targets.iter().flatten().zip(weights).enumerate();
        for (i, (target, &weight)) in targets.filter(|(_, (_, weight))| **weight != 0.0) {
            let Some((name, index)) = displaced.of(target) else { continue };
            let at = format!("{at}.targets[{i}].{name}");
            let displacements = primitives.accessor(index, Type::Vec3, &at)?;
            if displacements.count() != count {
                let what = format!(
                    "displaces {} vertices, but there are {count}; export the file again",
                    displacements.count()
                );
                return Err(syntax(primitives.path(), at, what));
            }
            morph.0.push((weight.into(), displacements));
        }
        Ok(morph)
    }

    /// Vertex `i` of the mesh, which is `base` without targets.
    #[inline]
    pub fn apply(&self, i: u64, base: [f64; 3]) -> [f64; 3] {
        self.0.iter().fold(base, |[x, y, z], (weight, displacements)| {
            let [dx, dy, dz] = displacements.components::<3>(i);
            [x + weight * dx, y + weight * dy, z + weight * dz]
        })
    }

    pub fn accessors(&self) -> impl Iterator<Item = &Accessor<'a>> {
        self.0.iter().map(|(_, displacements)| displacements)
    }
}

impl Displaced {
    fn of(self, target: &MorphTarget) -> Option<(&'static str, usize)> {
        match self {
            Displaced::Positions => target.positions.map(|index| ("POSITION", index.value())),
            Displaced::Normals => target.normals.map(|index| ("NORMAL", index.value())),
        }
    }
}
