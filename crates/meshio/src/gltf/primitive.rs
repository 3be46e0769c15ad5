//! Meshes: their primitives as triangles.

use super::accessor::Accessor;
use super::buffer::Buffers;
use super::document::{Document, entry};
use super::draco::{self, Extension};
use super::instances::Instances;
use super::material::{self, Materials};
use super::morph::{Displaced, Morph};
use super::nodes::MeshNode;
use super::pose::Pose;
use super::shared::SharedMeshes;
use super::skin::{Bound, Skins};
use super::syntax;
use super::vertices::PrimitiveVertices;
use crate::emit::{Emitter, Vertices};
use crate::instances::can_show;
use crate::{Place, Result};
use glam::DAffine3;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use raystrips_geom::Streams;
use std::collections::HashMap;
use std::path::Path;

/// Points that a strand has at most before it is cut.
const STRAND_POINTS: usize = 1 << 16;

/// Makes triangles of the meshes of a document.
pub(super) struct Primitives<'a> {
    path: &'a Path,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    materials: Materials<'a>,
    skins: Skins<'a>,
    shared: SharedMeshes,
    /// The part of each mesh that is one.
    parts: HashMap<usize, u32>,
    /// By mesh and primitive.
    geometries: HashMap<(usize, usize), u32>,
    points: u64,
    /// Primitives of lines that are left out because nobody says how wide they are.
    thin_lines: u64,
    /// How wide lines are.
    strand_width: Option<f64>,
    without_positions: u64,
    incomplete: u64,
}

/// What a mesh lists.
#[derive(Clone, Copy)]
pub(super) struct MeshCounts {
    pub triangles: u64,
    pub vertices: u64,
    /// Those with normals, texture coordinates or colors.
    pub attributed_vertices: u64,
    /// False where some triangles may only lead from one strip to the next, which are left out, or where nobody says
    /// how many a compressed mesh has.
    pub is_exact: bool,
}

/// The corners of a primitive's triangles, in the order of the file.
struct Corners<'a> {
    mode: Mode,
    indices: Option<Accessor<'a>>,
    /// Of indices, or of vertices where there are none.
    count: u64,
}

/// Triangles, or segments of lines, of so many corners.
fn primitive_count(mode: Mode, corners: u64) -> u64 {
    match mode {
        Mode::Triangles => corners / 3,
        Mode::Lines => corners / 2,
        Mode::LineStrip => corners.saturating_sub(1),
        Mode::LineLoop => corners,
        _ => corners.saturating_sub(2),
    }
}

impl Corners<'_> {
    /// Vertex number `i` of a line.
    fn vertex(&self, i: u64) -> u32 {
        match &self.indices {
            Some(indices) => indices.index(i),
            None => i as u32,
        }
    }

    /// Triangle `i`, turned as the specification says.
    #[inline]
    fn triangle(&self, i: u64) -> [u32; 3] {
        let places = match self.mode {
            Mode::TriangleStrip if i % 2 == 1 => [i, i + 2, i + 1],
            Mode::TriangleStrip => [i, i + 1, i + 2],
            Mode::TriangleFan => [i + 1, i + 2, 0],
            _ => [3 * i, 3 * i + 1, 3 * i + 2],
        };
        match &self.indices {
            Some(indices) => places.map(|place| indices.index(place)),
            None => places.map(|place| place as u32),
        }
    }
}

impl<'a> Primitives<'a> {
    pub fn new(
        path: &'a Path,
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        materials: Materials<'a>,
        skins: Skins<'a>,
        shared: SharedMeshes,
        strand_width: Option<f64>,
    ) -> Primitives<'a> {
        Primitives {
            path,
            document,
            buffers,
            materials,
            skins,
            shared,
            parts: HashMap::new(),
            geometries: HashMap::new(),
            points: 0,
            thin_lines: 0,
            strand_width,
            without_positions: 0,
            incomplete: 0,
        }
    }

    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// True if the mesh of this node is shown by instances.
    pub fn shares(&self, found: &MeshNode) -> bool {
        self.shared.holds(self.document, found)
    }

    /// Adds all triangles and strands of a mesh wherever its node shows it.
    pub fn add_mesh(&mut self, found: &MeshNode, out: &mut Emitter) -> Result<()> {
        let instances = Instances::of(self.path, self.document, self.buffers, found)?;
        let places = (0..instances.count).map(|i| instances.file_from_mesh(found, i));
        if !self.shares(found) {
            return self.add_copies(found, places, out);
        }
        let part = self.part(found, out)?;
        let placement = out.placement();
        let is_shown = |place: &DAffine3| can_show(&(placement * *place));
        places.clone().filter(is_shown).for_each(|place| out.instance(part, place));
        if places.clone().all(|place| is_shown(&place)) {
            return Ok(());
        }
        self.add_copies(found, places.filter(|place| !is_shown(place)), out)
    }

    /// The part that a shared mesh is, which is added when it is first needed.
    fn part(&mut self, found: &MeshNode, out: &mut Emitter) -> Result<u32> {
        if let Some(&part) = self.parts.get(&found.mesh) {
            return Ok(part);
        }
        let part = out.begin_part()?;
        self.add_copies(found, std::iter::once(DAffine3::IDENTITY), out)?;
        out.end_part()?;
        self.parts.insert(found.mesh, part);
        Ok(part)
    }

    /// Adds a mesh at all of `places`.
    fn add_copies(
        &mut self,
        found: &MeshNode,
        places: impl Iterator<Item = DAffine3> + Clone,
        out: &mut Emitter,
    ) -> Result<()> {
        let mesh = &self.document.meshes[found.mesh];
        let node = found.node.map(|node| &self.document.nodes[node]);
        let weights = node.and_then(|node| node.weights.as_ref()).or(mesh.weights.as_ref());
        let weights = weights.map_or(&[][..], Vec::as_slice);
        let joints = match (found.node, node.and_then(|node| node.skin)) {
            (Some(node), Some(skin)) => {
                Some(self.skins.matrices(skin as usize, &format!("nodes[{node}].skin"))?)
            }
            _ => None,
        };
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let at = format!("meshes[{}].primitives[{i}]", found.mesh);
            let Some((positions, corners)) = self.open(primitive, &at)? else { continue };
            let count = positions.count();
            let geometry = self.geometry(found.mesh, i, primitive, out);
            let morph = |displaced| Morph::new(self, primitive, weights, displaced, count, &at);
            let pose = Pose {
                positions: morph(Displaced::Positions)?,
                normals: morph(Displaced::Normals)?,
                bound: match &joints {
                    Some(joints) => Bound::new(self, primitive, joints.clone(), count, &at)?,
                    None => None,
                },
            };
            let vertices = self.vertices(primitive, positions, pose, geometry, &at, out)?;
            for place in places.clone() {
                // Joints put vertices where they belong in the file, wherever the node stands.
                out.set_transform(if vertices.pose.bound.is_some() { DAffine3::IDENTITY } else { place })?;
                match corners.mode {
                    Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                        self.add_strands(geometry, &vertices, &corners, &at, out)?;
                    }
                    _ => self.add_triangles(geometry, &vertices, &corners, &at, out)?,
                }
            }
        }
        Ok(())
    }

    /// Counts what a mesh, which must exist, lists. Does not decompress anything.
    pub fn count_mesh(&mut self, mesh: usize) -> Result<MeshCounts> {
        let mut counts = MeshCounts { triangles: 0, vertices: 0, attributed_vertices: 0, is_exact: true };
        for (i, primitive) in self.document.meshes[mesh].primitives.iter().enumerate() {
            let at = format!("meshes[{mesh}].primitives[{i}]");
            let Some((mode, position)) = self.shown(primitive, &at)? else { continue };
            let compressed = self.compressed(primitive, position, &at)?.is_some();
            let mode = if compressed { Mode::Triangles } else { mode };
            let count = |index: usize, kind: Type, at: &str| match compressed {
                // Nothing holds it against the compressed bytes here, but the codec has no larger numbers.
                true => entry(&self.document.accessors, index, self.path, at)
                    .map(|accessor| accessor.count.0.min(3 * u64::from(u32::MAX))),
                false => Accessor::count_of(self.path, self.document, self.buffers, index, kind, at),
            };
            let vertices = count(position, Type::Vec3, &format!("{at}.attributes.POSITION"))?;
            let corners = match &primitive.indices {
                Some(indices) => count(indices.value(), Type::Scalar, &format!("{at}.indices"))?,
                None => vertices,
            };
            counts.vertices = counts.vertices.saturating_add(vertices);
            if primitive.attributes.len() > 1 {
                counts.attributed_vertices = counts.attributed_vertices.saturating_add(vertices);
            }
            counts.triangles = counts.triangles.saturating_add(primitive_count(mode, corners));
            counts.is_exact &= mode != Mode::TriangleStrip && (!compressed || primitive.indices.is_some());
        }
        Ok(counts)
    }

    /// The mode of a primitive and the accessor of its positions, if it has something to show.
    fn shown(&mut self, primitive: &Primitive, at: &str) -> Result<Option<(Mode, usize)>> {
        let Checked::Valid(mode) = primitive.mode else {
            let what = "is none of glTF 2.0; export again";
            return Err(syntax(self.path, format_args!("{at}.mode"), what));
        };
        match mode {
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => {}
            Mode::Points => {
                self.points += 1;
                return Ok(None);
            }
            _ if self.strand_width.is_none() => {
                self.thin_lines += 1;
                return Ok(None);
            }
            _ => {}
        }
        let Some(position) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            if Extension::of(self.path, primitive, at)?.is_some() {
                let what = "is not there, though the primitive is compressed; export the file again";
                return Err(syntax(self.path, format_args!("{at}.attributes.POSITION"), what));
            }
            self.without_positions += 1;
            return Ok(None);
        };
        Ok(Some((mode, position.value())))
    }

    /// The checked parts of a primitive, if it has something to show.
    fn open(&mut self, primitive: &Primitive, at: &str) -> Result<Option<(Accessor<'a>, Corners<'a>)>> {
        let Some((mode, position)) = self.shown(primitive, at)? else { return Ok(None) };
        let Some(positions) = self.attribute(primitive, Semantic::Positions, &[Type::Vec3], at)? else {
            return Ok(None);
        };
        let corners = match self.compressed(primitive, position, at)? {
            Some(extension) => {
                let mesh = self.buffers.draco(extension.buffer_view, at)?;
                let indices = Accessor::of_bytes(self.buffers, &mesh.indices, 1, ComponentType::U32, false);
                Corners { mode: Mode::Triangles, count: indices.count(), indices: Some(indices) }
            }
            None => self.corners(primitive, mode, &positions, at)?,
        };
        if let Some(material) = &primitive.material {
            entry(&self.document.materials, material.value(), self.path, format_args!("{at}.material"))?;
        }
        self.incomplete += u64::from(corners.mode == Mode::Triangles && corners.count % 3 != 0);
        Ok(Some((positions, corners)))
    }

    /// The attribute `semantic` of the primitive at the place `at`, compressed or not, with elements of one of `kinds`.
    /// Nothing if it has none.
    pub fn attribute(
        &self,
        primitive: &Primitive,
        semantic: Semantic,
        kinds: &[Type],
        at: &str,
    ) -> Result<Option<Accessor<'a>>> {
        let name = semantic.to_string();
        let Some(index) = primitive.attributes.get(&Checked::Valid(semantic)) else { return Ok(None) };
        let at_plain = format!("{at}.attributes.{name}");
        let accessor = entry(&self.document.accessors, index.value(), self.path, &at_plain)?;
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
        let extension = match positions {
            Some(positions) => self.compressed(primitive, positions.value(), at)?,
            None => None,
        };
        let id = extension.as_ref().and_then(|extension| extension.attributes.get(&name));
        let (Some(extension), Some(&id)) = (&extension, id) else {
            if extension.is_some() && positions == Some(index) {
                // Without bytes the accessor would stand for zeros.
                let at = format!("{at}.extensions.{}.attributes.{name}", draco::NAME);
                return Err(syntax(self.path, at, "is not there; export the file again"));
            }
            let found = kinds.iter().find(|&kind| accessor.type_ == Checked::Valid(*kind));
            return self.accessor(index.value(), *found.unwrap_or(&kinds[0]), &at_plain).map(Some);
        };
        let mesh = self.buffers.draco(extension.buffer_view, at)?;
        let wrong = |what: String| {
            let at = format!("{at}.extensions.{}.attributes.{name}", draco::NAME);
            syntax(self.path, at, format_args!("{what}; export the file again"))
        };
        let attribute = mesh
            .attribute(id)
            .ok_or_else(|| wrong(format!("the compressed mesh has no attribute {id} of glTF's types")))?;
        let width = attribute.width;
        if !kinds.iter().any(|kind| kind.multiplicity() == width) {
            return Err(wrong(format!("attribute {id} has {width} components, which do not fit")));
        }
        let (bytes, component) = (&attribute.bytes, attribute.component);
        Ok(Some(Accessor::of_bytes(self.buffers, bytes, width, component, accessor.normalized)))
    }

    pub fn accessor(&self, index: usize, kind: Type, at: &str) -> Result<Accessor<'a>> {
        Accessor::new(self.path, self.document, self.buffers, index, kind, at)
    }

    /// How a primitive with these positions is compressed, if it is and is not there in plain as well.
    fn compressed(&self, primitive: &Primitive, position: usize, at: &str) -> Result<Option<Extension>> {
        let is_plain = self.document.accessors.get(position).is_some_and(|a| a.buffer_view.is_some());
        match is_plain && !self.document.requires(draco::NAME) {
            true => Ok(None),
            false => Extension::of(self.path, primitive, at),
        }
    }

    fn corners(
        &self,
        primitive: &Primitive,
        mode: Mode,
        positions: &Accessor,
        at: &str,
    ) -> Result<Corners<'a>> {
        let Some(indices) = &primitive.indices else {
            let count = Vertices::count(positions);
            if count > u64::from(u32::MAX) {
                return Err(syntax(self.path, at, "has more than 4294967295 vertices; split the mesh"));
            }
            return Ok(Corners { mode, indices: None, count });
        };
        let at = format!("{at}.indices");
        let indices = self.accessor(indices.value(), Type::Scalar, &at)?;
        if !matches!(indices.component(), ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            return Err(syntax(self.path, at, "must be unsigned integers; export the file again"));
        }
        let count = indices.count();
        Ok(Corners { mode, indices: Some(indices), count })
    }

    /// The geometry of a primitive that has been opened.
    fn geometry(&mut self, mesh: usize, index: usize, primitive: &Primitive, out: &mut Emitter) -> u32 {
        if let Some(&geometry) = self.geometries.get(&(mesh, index)) {
            return geometry;
        }
        let material = match &primitive.material {
            Some(material) => self.materials.get(material.value(), out),
            None => self.materials.default(out),
        };
        let name = self.document.meshes[mesh].name.as_deref().unwrap_or_default();
        let geometry = out.geometry(name, material);
        self.geometries.insert((mesh, index), geometry);
        geometry
    }

    /// The vertices of a primitive with those of their attributes that its material needs.
    fn vertices(
        &self,
        primitive: &Primitive,
        positions: Accessor<'a>,
        pose: Pose<'a>,
        geometry: u32,
        at: &str,
        out: &Emitter,
    ) -> Result<PrimitiveVertices<'a>> {
        let material = out.scene.geometries[geometry as usize].material;
        let tex_coords = material::tex_coords(&out.scene, material);
        let needs_tangents = material::needs_tangents(&out.scene, material);
        let count = positions.count();
        let find = |semantic: Semantic, kinds: &[Type]| -> Result<Option<Accessor<'a>>> {
            let name = semantic.to_string();
            let accessor = self.attribute(primitive, semantic, kinds, at)?;
            match accessor.as_ref().map(Accessor::count).filter(|found| *found < count) {
                Some(found) => {
                    let what = format!("has {found} elements for {count} vertices; export again");
                    Err(syntax(self.path, format_args!("{at}.attributes.{name}"), what))
                }
                None => Ok(accessor),
            }
        };
        let tex_coord = |set: u32, stream| match tex_coords.has(stream) {
            true => find(Semantic::TexCoords(set), &[Type::Vec2]),
            false => Ok(None),
        };
        let normals = find(Semantic::Normals, &[Type::Vec3])?;
        // Those that come without normals do not count.
        let tangents = match needs_tangents && normals.is_some() {
            true => find(Semantic::Tangents, &[Type::Vec4])?,
            false => None,
        };
        Ok(PrimitiveVertices {
            positions,
            pose,
            normals,
            tangents,
            tex_coords: [tex_coord(0, Streams::TEX_COORDS_0)?, tex_coord(1, Streams::TEX_COORDS_1)?],
            colors: find(Semantic::Colors(0), &[Type::Vec4, Type::Vec3])?,
        })
    }

    fn add_triangles(
        &self,
        geometry: u32,
        vertices: &PrimitiveVertices,
        corners: &Corners,
        at: &str,
        out: &mut Emitter,
    ) -> Result<()> {
        let strip = corners.mode == Mode::TriangleStrip;
        for i in 0..primitive_count(corners.mode, corners.count) {
            let [a, b, c] = corners.triangle(i);
            // Strips name vertices twice to get from one run to the next; those are no triangles.
            if strip && (a == b || b == c || a == c) {
                continue;
            }
            out.polygon(geometry, vertices, &[a, b, c], self.path, || Place::Json(format!("{at}.indices")))?;
        }
        Ok(())
    }

    /// Adds the strands of a primitive of lines. Lines of which each begins where the one before ends are one strand.
    fn add_strands(
        &self,
        geometry: u32,
        positions: &PrimitiveVertices,
        corners: &Corners,
        at: &str,
        out: &mut Emitter,
    ) -> Result<()> {
        let vertex_count = Vertices::count(positions);
        let radius = self.strand_width.unwrap_or_default() / 2.0;
        let mut strand: Vec<u32> = Vec::new();
        let add = |strand: &mut Vec<u32>, out: &mut Emitter| -> Result<()> {
            if let Some(&bad) = strand.iter().find(|&&vertex| u64::from(vertex) >= vertex_count) {
                let place = || Place::Json(format!("{at}.indices"));
                let segments = strand.len() as u64 - 1;
                strand.clear();
                return out.out_of_range(segments, self.path, place, bad.into(), vertex_count);
            }
            let points = strand.drain(..);
            out.strand(geometry, points.map(|vertex| (positions.position(vertex), radius)))
        };
        match corners.mode {
            Mode::Lines => {
                for i in 0..corners.count / 2 {
                    let [a, b] = [2 * i, 2 * i + 1].map(|place| corners.vertex(place));
                    if strand.last() != Some(&a) || strand.len() == STRAND_POINTS {
                        add(&mut strand, out)?;
                        strand.push(a);
                    }
                    strand.push(b);
                }
            }
            _ => {
                let closing = u64::from(corners.mode == Mode::LineLoop && corners.count > 1);
                for i in 0..corners.count + closing {
                    if strand.len() == STRAND_POINTS {
                        let last = strand[STRAND_POINTS - 1];
                        add(&mut strand, out)?;
                        strand.push(last);
                    }
                    strand.push(corners.vertex(if i == corners.count { 0 } else { i }));
                }
            }
        }
        add(&mut strand, out)
    }

    /// Warns of what was left out.
    pub fn finish(self, out: &mut Emitter) {
        for (count, what) in [
            (self.points, "primitives are points and left out"),
            (self.thin_lines, "primitives are lines and left out; --strand-width makes strands of them"),
            (self.without_positions, "primitives have no positions and are left out"),
            (self.incomplete, "primitives end in the middle of a triangle, which is left out"),
        ] {
            if count > 0 {
                out.warn(self.path, format_args!("{count} {what}"));
            }
        }
        self.materials.finish(out);
    }
}
