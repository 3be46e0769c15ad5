//! The rest pose of a primitive: displaced by morph targets, then put where joints want it. It is worked out vertex by
//! vertex when asked for, so that it takes no memory.

use super::accessor::Accessor;
use super::morph::Morph;
use super::skin::Bound;

/// What moves the vertices of a primitive.
pub(super) struct Pose<'a> {
    pub positions: Morph<'a>,
    pub normals: Morph<'a>,
    pub bound: Option<Bound<'a>>,
}

impl<'a> Pose<'a> {
    /// Where vertex `i` is, which is modeled at `position`.
    #[inline]
    pub fn position(&self, i: u64, position: [f64; 3]) -> [f64; 3] {
        let position = self.positions.apply(i, position);
        match &self.bound {
            Some(bound) => bound.position(i, position),
            None => position,
        }
    }

    /// The normal of vertex `i`, which is modeled with `normal`. Its length is of no meaning.
    #[inline]
    pub fn normal(&self, i: u64, normal: [f64; 3]) -> [f64; 3] {
        let normal = self.normals.apply(i, normal);
        match &self.bound {
            Some(bound) => bound.normal(i, normal),
            None => normal,
        }
    }

    /// The direction on the surface that is modeled as `direction`. Its length is of no meaning.
    pub fn direction(&self, i: u64, direction: [f64; 3]) -> [f64; 3] {
        let (from, to) = (self.position(i, [0.0; 3]), self.position(i, direction));
        std::array::from_fn(|axis| to[axis] - from[axis])
    }

    pub fn accessors(&self) -> impl Iterator<Item = &Accessor<'a>> {
        let targets = self.positions.accessors().chain(self.normals.accessors());
        targets.chain(self.bound.iter().flat_map(Bound::accessors))
    }
}
