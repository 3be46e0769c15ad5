//! Meshes: their primitives as triangles.

use super::accessor::Accessor;
use super::buffer::Buffers;
use super::document::{Document, cure, entry};
use super::material::{self, Materials};
use super::vertices::PrimitiveVertices;
use super::{syntax, unsupported};
use crate::emit::{Emitter, Vertices};
use crate::{Place, Result};
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
    /// By mesh and primitive.
    geometries: HashMap<(usize, usize), u32>,
    points: u64,
    /// Primitives of lines that are left out because nobody says how wide they are.
    thin_lines: u64,
    /// How wide lines are.
    strand_width: Option<f64>,
    without_positions: u64,
    incomplete: u64,
    morphed: bool,
}

/// What a mesh lists.
#[derive(Clone, Copy, Default)]
pub(super) struct MeshCounts {
    pub triangles: u64,
    pub vertices: u64,
    /// Those with normals, texture coordinates or colors.
    pub attributed_vertices: u64,
    /// Whether some triangles may only lead from one strip to the next, which are left out.
    pub has_strips: bool,
}

/// The corners of a primitive's triangles, in the order of the file.
struct Corners<'a> {
    mode: Mode,
    indices: Option<Accessor<'a>>,
    /// Of indices, or of vertices where there are none.
    count: u64,
}

impl Corners<'_> {
    /// Triangles, or segments of lines.
    fn primitive_count(&self) -> u64 {
        match self.mode {
            Mode::Triangles => self.count / 3,
            Mode::Lines => self.count / 2,
            Mode::LineStrip => self.count.saturating_sub(1),
            Mode::LineLoop => self.count,
            _ => self.count.saturating_sub(2),
        }
    }

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
        strand_width: Option<f64>,
    ) -> Primitives<'a> {
        Primitives {
            path,
            document,
            buffers,
            materials,
            geometries: HashMap::new(),
            points: 0,
            thin_lines: 0,
            strand_width,
            without_positions: 0,
            incomplete: 0,
            morphed: false,
        }
    }

    /// Adds all triangles and strands of a mesh, which must exist.
    pub fn add_mesh(&mut self, mesh: usize, out: &mut Emitter) -> Result<()> {
        for (i, primitive) in self.document.meshes[mesh].primitives.iter().enumerate() {
            let at = format!("meshes[{mesh}].primitives[{i}]");
            if let Some((positions, corners)) = self.open(primitive, &at)? {
                let geometry = self.geometry(mesh, i, primitive, out);
                match corners.mode {
                    Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                        self.add_strands(geometry, &positions, &corners, &at, out)?;
                    }
                    _ => {
                        let vertices = self.vertices(primitive, positions, geometry, &at, out)?;
                        self.add_triangles(geometry, &vertices, &corners, &at, out)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Counts what a mesh, which must exist, lists.
    pub fn count_mesh(&mut self, mesh: usize) -> Result<MeshCounts> {
        let mut counts = MeshCounts::default();
        for (i, primitive) in self.document.meshes[mesh].primitives.iter().enumerate() {
            let opened = self.open(primitive, &format!("meshes[{mesh}].primitives[{i}]"))?;
            if let Some((positions, corners)) = opened {
                counts.triangles = counts.triangles.saturating_add(corners.primitive_count());
                counts.vertices = counts.vertices.saturating_add(Vertices::count(&positions));
                if primitive.attributes.len() > 1 {
                    counts.attributed_vertices =
                        counts.attributed_vertices.saturating_add(Vertices::count(&positions));
                }
                counts.has_strips |= corners.mode == Mode::TriangleStrip;
            }
        }
        Ok(counts)
    }

    /// The checked parts of a primitive, if it has triangles.
    fn open(&mut self, primitive: &Primitive, at: &str) -> Result<Option<(Accessor<'a>, Corners<'a>)>> {
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
            self.without_positions += 1;
            return Ok(None);
        };
        self.refuse_compressed(primitive, position.value(), at)?;
        let positions = self.accessor(position.value(), Type::Vec3, &format!("{at}.attributes.POSITION"))?;
        let corners = self.corners(primitive, mode, &positions, at)?;
        if let Some(material) = &primitive.material {
            entry(&self.document.materials, material.value(), self.path, format_args!("{at}.material"))?;
        }
        self.incomplete += u64::from(mode == Mode::Triangles && corners.count % 3 != 0);
        self.morphed |= primitive.targets.is_some();
        Ok(Some((positions, corners)))
    }

    fn accessor(&self, index: usize, kind: Type, at: &str) -> Result<Accessor<'a>> {
        Accessor::new(self.path, self.document, self.buffers, index, kind, at)
    }

    /// A compressed primitive whose accessors are empty would come out as a heap of zeros.
    fn refuse_compressed(&self, primitive: &Primitive, position: usize, at: &str) -> Result<()> {
        let Some(extensions) = &primitive.extensions else { return Ok(()) };
        let without_bytes = self.document.accessors.get(position).is_some_and(|a| a.buffer_view.is_none());
        match extensions.others.keys().find(|name| name.ends_with("_compression")) {
            Some(name) if without_bytes => {
                let what = format!("needs {name}, which is not read here; {}", cure(name));
                Err(unsupported(self.path, at, what))
            }
            _ => Ok(()),
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
        geometry: u32,
        at: &str,
        out: &Emitter,
    ) -> Result<PrimitiveVertices<'a>> {
        let tex_coords = material::tex_coords(&out.scene, out.scene.geometries[geometry as usize].material);
        let count = Vertices::count(&positions);
        let find = |semantic: Semantic, kinds: &[Type], name: &str| -> Result<Option<Accessor<'a>>> {
            let Some(index) = primitive.attributes.get(&Checked::Valid(semantic)) else { return Ok(None) };
            let at = format!("{at}.attributes.{name}");
            let found = self.document.accessors.get(index.value()).map(|accessor| &accessor.type_);
            let kind =
                kinds.iter().find(|kind| matches!(found, Some(Checked::Valid(found)) if found == *kind));
            let accessor = self.accessor(index.value(), *kind.unwrap_or(&kinds[0]), &at)?;
            if accessor.count() < count {
                let what = format!("has {} elements for {count} vertices; export again", accessor.count());
                return Err(syntax(self.path, at, what));
            }
            Ok(Some(accessor))
        };
        let tex_coord = |set: u32, stream| match tex_coords.has(stream) {
            true => find(Semantic::TexCoords(set), &[Type::Vec2], &format!("TEXCOORD_{set}")),
            false => Ok(None),
        };
        Ok(PrimitiveVertices {
            positions,
            normals: find(Semantic::Normals, &[Type::Vec3], "NORMAL")?,
            tex_coords: [tex_coord(0, Streams::TEX_COORDS_0)?, tex_coord(1, Streams::TEX_COORDS_1)?],
            colors: find(Semantic::Colors(0), &[Type::Vec4, Type::Vec3], "COLOR_0")?,
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
        for i in 0..corners.primitive_count() {
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
        positions: &Accessor,
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
        if self.morphed {
            out.warn(self.path, "morph targets are not read, meshes have their rest shape");
        }
        self.materials.finish(out);
    }
}
