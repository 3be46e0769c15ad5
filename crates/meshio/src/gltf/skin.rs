//! Skins in the rest pose: where the joints put the vertices of a mesh.

use super::accessor::Accessor;
use super::buffer::Buffers;
use super::document::{Document, entry};
use super::primitive::Primitives;
use super::syntax;
use crate::Result;
use crate::emit::Vertices;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use std::path::Path;
use std::rc::Rc;

/// Vertices between two releases: some tens of megabytes of joints and weights.
const VERTICES_BETWEEN_RELEASES: u64 = 1 << 20;

/// All skins of a document; the matrices of each are made when first asked for.
pub(super) struct Skins<'a> {
    path: &'a Path,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    file_from_node: &'a [Option<DAffine3>],
    matrices: Vec<Option<Rc<[DAffine3]>>>,
}

/// The vertices of a primitive, bound to joints.
pub(super) struct Bound<'a> {
    /// From where vertices are modeled to where the joint puts them.
    matrices: Rc<[DAffine3]>,
    /// Four joints and their weights each.
    sets: Vec<(Accessor<'a>, Accessor<'a>)>,
}

impl<'a> Skins<'a> {
    pub fn new(
        path: &'a Path,
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        file_from_node: &'a [Option<DAffine3>],
    ) -> Skins<'a> {
        Skins { path, document, buffers, file_from_node, matrices: vec![None; document.skins.len()] }
    }

    /// The matrices of the joints of a skin, which the place `at` names.
    pub fn matrices(&mut self, index: usize, at: &str) -> Result<Rc<[DAffine3]>> {
        let skin = entry(&self.document.skins, index, self.path, at)?;
        if let Some(matrices) = &self.matrices[index] {
            return Ok(matrices.clone());
        }
        let at = format!("skins[{index}]");
        let inverse = match skin.inverse_bind_matrices {
            Some(accessor) => Some(self.inverse_bind_matrices(accessor, skin.joints.len() as u64, &at)?),
            None => None,
        };
        let matrix = |(i, &joint): (usize, &u32)| {
            let at = format!("{at}.joints[{i}]");
            let stands = entry(self.file_from_node, joint as usize, self.path, &at)?;
            let file_from_joint = stands.ok_or_else(|| {
                let what = format!("node {joint} is below itself; export the file again");
                syntax(self.path, &at, what)
            })?;
            Ok(match &inverse {
                Some(inverse) => {
                    let joint_from_mesh = DMat4::from_cols_array(&inverse.components::<16>(i as u64));
                    file_from_joint * DAffine3::from_mat4(joint_from_mesh)
                }
                None => file_from_joint,
            })
        };
        let matrices = skin.joints.iter().enumerate().map(matrix).collect::<Result<Rc<[DAffine3]>>>()?;
        Ok(self.matrices[index].insert(matrices).clone())
    }

    fn inverse_bind_matrices(&self, accessor: usize, joints: u64, at: &str) -> Result<Accessor<'a>> {
        let at = format!("{at}.inverseBindMatrices");
        let matrices = Accessor::new(self.path, self.document, self.buffers, accessor, Type::Mat4, &at)?;
        if matrices.component() != ComponentType::F32 {
            return Err(syntax(self.path, at, "must be floats; export the file again"));
        }
        if matrices.count() < joints {
            let what =
                format!("has {} matrices for {joints} joints; export the file again", matrices.count());
            return Err(syntax(self.path, at, what));
        }
        Ok(matrices)
    }
}

impl<'a> Bound<'a> {
    /// Binds the primitive at the place `at`, which has `count` vertices. Nothing if it says of no joints.
    pub fn new(
        primitives: &Primitives<'a>,
        primitive: &Primitive,
        matrices: Rc<[DAffine3]>,
        count: u64,
        at: &str,
    ) -> Result<Option<Bound<'a>>> {
        let mut sets = Vec::new();
        for set in 0.. {
            let joints = primitives.attribute(primitive, Semantic::Joints(set), &[Type::Vec4], at)?;
            let weights = primitives.attribute(primitive, Semantic::Weights(set), &[Type::Vec4], at)?;
            let (Some(joints), Some(weights)) = (joints, weights) else { break };
            let is_plain = matches!(joints.component(), ComponentType::U8 | ComponentType::U16)
                && !joints.is_normalized();
            if !is_plain || joints.count() != count || weights.count() != count {
                let what = format!("must be unsigned integers for {count} vertices, with as many weights");
                let at = format!("{at}.attributes.JOINTS_{set}");
                return Err(syntax(primitives.path(), at, format_args!("{what}; export the file again")));
            }
            sets.push((joints, weights));
        }
        if sets.is_empty() {
            return Ok(None);
        }
        let bound = Bound { matrices, sets };
        // Where positions are asked for it would be too late to say so.
        for i in 0..count {
            if i % VERTICES_BETWEEN_RELEASES == VERTICES_BETWEEN_RELEASES - 1 {
                bound.accessors().for_each(Accessor::release);
            }
            if let Some((joint, _)) = bound.joints(i).find(|(joint, _)| *joint >= bound.matrices.len()) {
                let what = format!(
                    "vertex {i} hangs on joint {joint} of {}; export the file again",
                    bound.matrices.len()
                );
                return Err(syntax(primitives.path(), format_args!("{at}.attributes.JOINTS_0"), what));
            }
        }
        Ok(Some(bound))
    }

    /// The joints of a vertex and their weights, without those of no weight.
    #[inline]
    fn joints(&self, vertex: u64) -> impl Iterator<Item = (usize, f64)> {
        self.sets.iter().flat_map(move |(joints, weights)| {
            let joints = joints.components::<4>(vertex).map(|joint| joint as usize);
            joints.into_iter().zip(weights.components::<4>(vertex)).filter(|(_, weight)| *weight != 0.0)
        })
    }

    /// Where the joints put vertex `i`, which is modeled at `position`.
    #[inline]
    pub fn position(&self, i: u64, position: [f64; 3]) -> [f64; 3] {
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for (joint, weight) in self.joints(i) {
            sum += weight * self.matrices[joint].transform_point3(DVec3::from(position));
            total += weight;
        }
        // Weights are of few bits and need not have the sum of 1. Without any, the vertex stays where it is.
        if total == 0.0 { position } else { (sum / total).to_array() }
    }

    /// How the joints turn the normal of vertex `i`. Its length is of no meaning.
    #[inline]
    pub fn normal(&self, i: u64, normal: [f64; 3]) -> [f64; 3] {
        let mut sum = DMat3::ZERO;
        for (joint, weight) in self.joints(i) {
            sum += self.matrices[joint].matrix3 * weight;
        }
        let determinant = sum.determinant();
        if determinant == 0.0 {
            return normal;
        }
        (sum.inverse().transpose() * determinant.abs() * DVec3::from(normal)).to_array()
    }

    pub fn accessors(&self) -> impl Iterator<Item = &Accessor<'a>> {
        self.sets.iter().flat_map(|(joints, weights)| [joints, weights])
    }
}
