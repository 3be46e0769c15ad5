//! Meshes: their primitives as triangles.

use super::accessor::Accessor;
use super::buffer::Buffers;
use super::document::{Document, cure, entry};
use super::material::Materials;
use super::{syntax, unsupported};
use crate::emit::{Emitter, Vertices};
use crate::{Place, Result};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use std::collections::HashMap;
use std::path::Path;

/// Makes triangles of the meshes of a document.
pub(super) struct Primitives<'a> {
    path: &'a Path,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    materials: Materials<'a>,
    /// By mesh and primitive.
    geometries: HashMap<(usize, usize), u32>,
    lines_and_points: u64,
    without_positions: u64,
    incomplete: u64,
    morphed: bool,
}

/// What a mesh lists.
#[derive(Clone, Copy, Default)]
pub(super) struct MeshCounts {
    pub triangles: u64,
    pub vertices: u64,
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
    fn triangle_count(&self) -> u64 {
        match self.mode {
            Mode::Triangles => self.count / 3,
            _ => self.count.saturating_sub(2),
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
    ) -> Primitives<'a> {
        Primitives {
            path,
            document,
            buffers,
            materials,
            geometries: HashMap::new(),
            lines_and_points: 0,
            without_positions: 0,
            incomplete: 0,
            morphed: false,
        }
    }

    /// Adds all triangles of a mesh, which must exist.
    pub fn add_mesh(&mut self, mesh: usize, out: &mut Emitter) -> Result<()> {
        for (i, primitive) in self.document.meshes[mesh].primitives.iter().enumerate() {
            let at = format!("meshes[{mesh}].primitives[{i}]");
            if let Some((positions, corners)) = self.open(primitive, &at)? {
                let geometry = self.geometry(mesh, i, primitive, out);
                self.add_triangles(geometry, &positions, &corners, &at, out)?;
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
                counts.triangles = counts.triangles.saturating_add(corners.triangle_count());
                counts.vertices = counts.vertices.saturating_add(Vertices::count(&positions));
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
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.lines_and_points += 1;
            return Ok(None);
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

    fn add_triangles(
        &self,
        geometry: u32,
        positions: &Accessor,
        corners: &Corners,
        at: &str,
        out: &mut Emitter,
    ) -> Result<()> {
        let strip = corners.mode == Mode::TriangleStrip;
        for i in 0..corners.triangle_count() {
            let [a, b, c] = corners.triangle(i);
            // Strips name vertices twice to get from one run to the next; those are no triangles.
            if strip && (a == b || b == c || a == c) {
                continue;
            }
            out.polygon(geometry, positions, &[a, b, c], self.path, || Place::Json(format!("{at}.indices")))?;
        }
        Ok(())
    }

    /// Warns of what was left out.
    pub fn finish(self, out: &mut Emitter) {
        for (count, what) in [
            (self.lines_and_points, "primitives are lines or points and left out"),
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
