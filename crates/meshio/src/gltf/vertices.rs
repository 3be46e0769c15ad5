//! The vertices of a primitive: positions and what else there is of them.

use super::accessor::Accessor;
use super::pose::Pose;
use crate::emit::Vertices;
use glam::{Vec2, Vec3, Vec4};
use raystrips_geom::{Attributes, Streams};

/// Accessors of a primitive, each with as many elements as there are positions, or more.
pub(super) struct PrimitiveVertices<'a> {
    pub positions: Accessor<'a>,
    pub pose: Pose<'a>,
    pub normals: Option<Accessor<'a>>,
    pub tex_coords: [Option<Accessor<'a>>; 2],
    pub colors: Option<Accessor<'a>>,
    pub tangents: Option<Accessor<'a>>,
}

impl Vertices for PrimitiveVertices<'_> {
    fn count(&self) -> u64 {
        Vertices::count(&self.positions)
    }

    #[inline]
    fn position(&self, index: u32) -> [f64; 3] {
        self.pose.position(index.into(), self.positions.position(index))
    }

    fn release(&self) {
        self.positions.release();
        self.pose.accessors().for_each(Accessor::release);
    }

    fn streams(&self) -> Streams {
        let [first, second] = &self.tex_coords;
        let streams = [
            (&self.normals, Streams::NORMALS),
            (first, Streams::TEX_COORDS_0),
            (second, Streams::TEX_COORDS_1),
            (&self.colors, Streams::COLORS),
            (&self.tangents, Streams::TANGENTS),
        ];
        let there = streams.iter().filter(|(accessor, _)| accessor.is_some());
        there.fold(Streams::NONE, |all, (_, stream)| all.union(*stream))
    }

    fn attributes(&self, _place: usize, index: u32) -> Attributes {
        let plain = Attributes::default();
        let values = |accessor: &Accessor| accessor.element(u64::from(index)).map(|x| x as f32);
        let tex_coord = |accessor: &Option<Accessor>| {
            accessor.as_ref().map_or(Vec2::ZERO, |accessor| {
                let [u, v, ..] = values(accessor);
                let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
                Vec2::new(finite(u), finite(v))
            })
        };
        Attributes {
            normal: self.normals.as_ref().map_or(plain.normal, |normals| {
                let normal = self.pose.normal(index.into(), normals.components(index.into()));
                Vec3::from_array(normal.map(|x| x as f32))
            }),
            tex_coords: [tex_coord(&self.tex_coords[0]), tex_coord(&self.tex_coords[1])],
            color: self.colors.as_ref().map_or(plain.color, |colors| {
                let color = Vec4::from_array(values(colors));
                if colors.width() == 3 { color.with_w(1.0) } else { color }
            }),
            tangent: self.tangents.as_ref().map_or(plain.tangent, |tangents| {
                // Whether the image is mirrored its coordinates tell.
                let [x, y, z, ..] = tangents.element(index.into());
                Vec3::from_array(self.pose.direction(index.into(), [x, y, z]).map(|x| x as f32))
            }),
        }
    }
}
