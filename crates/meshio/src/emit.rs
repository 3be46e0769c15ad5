//! What all readers write into: makes batches of the triangles they find, and collects the scene and the report.

use crate::error::one_line;
use crate::image::Images;
use crate::instances::Instances;
use crate::polygon::triangulate;
use crate::strand::Strands;
use crate::{
    FileStamp, ImageSource, Import, ImportError, ImportOptions, ImportReport, Instance, Place, Progress,
    Result, TriangleBatch, TriangleSink,
};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use raystrips_geom::affine::{is_mirrored, normal_matrix};
use raystrips_geom::scene::{Geometry, Material, SceneDesc};
use raystrips_geom::texture::Texture;
use raystrips_geom::{Attributes, Streams};
use std::path::Path;

/// Enough for long runs of work, little enough that a few batches fit into a cache.
const MAX_TRIANGLES: usize = 1 << 16;
/// So that 16 bits tell positions of a batch apart. Half of [`VertexMap`], so that its probes stay short.
pub(crate) const MAX_POSITIONS: usize = 1 << 16;
/// Beyond this, products of two lengths leave the range of `f32`, which tracing uses.
pub(crate) const MAX_COORDINATE: f64 = 1e18;
const MAX_WARNINGS: usize = 20;
/// A vertex has no other attributes in the batch.
const NO_SIBLING: u32 = u32::MAX;
/// Corners of a polygon, which takes some sixty bytes of memory for each while it is cut.
const MAX_CORNERS: u64 = 1 << 20;

/// Where a reader keeps its vertices.
pub(crate) trait Vertices {
    fn count(&self) -> u64;
    /// Only called with `index < count()`.
    fn position(&self, index: u32) -> [f64; 3];
    /// Called now and then, when positions may leave memory until they are next asked for.
    fn release(&self);
    /// What vertices have besides positions.
    fn streams(&self) -> Streams {
        Streams::NONE
    }
    /// The attributes of corner number `place` of the present polygon, which is vertex `index`; normals and tangents as in the
    /// file.
    fn attributes(&self, _place: usize, _index: u32) -> Attributes {
        Attributes::default()
    }
    /// Whether a vertex may have other attributes in another polygon.
    fn has_seams(&self) -> bool {
        false
    }
}

pub(crate) struct Emitter<'a> {
    pub options: &'a ImportOptions,
    pub scene: SceneDesc,
    report: ImportReport,
    sink: &'a mut dyn TriangleSink,
    progress: Progress,
    /// Bytes of the files before the present one.
    bytes_before: u64,

    /// Where the present file stands in the world.
    placement: DAffine3,
    /// Material of everything in the present file, whatever the file says.
    material_override: Option<u32>,
    /// For faces without one: as it is, and where colors of vertices are all of the color.
    default_materials: [Option<u32>; 2],
    /// Where the present part of the file stands in the world.
    world_from_local: DAffine3,
    mirrored: bool,
    /// What turns normals of the present part to the world; not of unit length.
    normals_from_local: DMat3,
    instances: Instances,

    next_triangle_id: u64,
    strands: Strands,
    batch: TriangleBatch,
    batch_count: u64,
    vertices: VertexMap,
    /// For each position of the batch another one of the same vertex with other attributes, or `NO_SIBLING`.
    siblings: Vec<u32>,
    record: Vec<u8>,
    images: Images,
    polygon: Vec<[f64; 3]>,
    cut: Vec<[u32; 3]>,
}

impl<'a> Emitter<'a> {
    pub fn new(options: &'a ImportOptions, sink: &'a mut dyn TriangleSink, bytes_total: u64) -> Emitter<'a> {
        Emitter {
            options,
            scene: SceneDesc::default(),
            report: ImportReport::default(),
            sink,
            progress: Progress { bytes_done: 0, bytes_total },
            bytes_before: 0,
            placement: DAffine3::IDENTITY,
            material_override: None,
            default_materials: [None; 2],
            world_from_local: DAffine3::IDENTITY,
            mirrored: false,
            normals_from_local: DMat3::IDENTITY,
            instances: Instances::default(),
            next_triangle_id: 0,
            strands: Strands::default(),
            batch: TriangleBatch::default(),
            batch_count: 0,
            vertices: VertexMap::new(),
            siblings: Vec::new(),
            record: Vec::new(),
            images: Images::default(),
            polygon: Vec::new(),
            cut: Vec::new(),
        }
    }

    /// Starts a file, whose strands are as wide as given, if that is.
    pub fn begin_file(
        &mut self,
        placement: DAffine3,
        material_override: Option<u32>,
        strand_width: Option<f64>,
    ) -> Result<()> {
        self.strands.width = strand_width;
        self.placement = placement;
        self.material_override = material_override;
        self.set_transform(DAffine3::IDENTITY)
    }

    /// Ends a file of `bytes`.
    pub fn end_file(&mut self, bytes: u64) -> Result<()> {
        self.flush()?;
        self.bytes_before += bytes;
        self.advance(0);
        Ok(())
    }

    /// Ends the import.
    pub fn finish(mut self) -> Result<Import> {
        self.flush()?;
        let instances = self.instances.all;
        Ok(Import { scene: self.scene, instances, images: self.images.sources, report: self.report })
    }

    /// Where the vertices that follow stand in their file. Needed at the start of each set of vertices.
    pub fn set_transform(&mut self, file_from_local: DAffine3) -> Result<()> {
        self.flush()?;
        let world_from_local = match self.instances.is_in_part() {
            true => file_from_local,
            false => self.placement * file_from_local,
        };
        let matrix = world_from_local.matrix3;
        let determinant = matrix.determinant();
        self.world_from_local = world_from_local;
        self.mirrored = is_mirrored(matrix);
        self.normals_from_local = normal_matrix(matrix);
        self.strands.scale = determinant.abs().cbrt();
        Ok(())
    }

    /// Begins a part, whose space until it ends is that of the file. Gives its number.
    pub fn begin_part(&mut self) -> Result<u32> {
        self.flush()?;
        let part = self.instances.begin_part();
        self.set_transform(DAffine3::IDENTITY)?;
        Ok(part)
    }

    /// True between the beginning and the end of a part.
    pub fn is_in_part(&self) -> bool {
        self.instances.is_in_part()
    }

    /// Ends the part.
    pub fn end_part(&mut self) -> Result<()> {
        self.flush()?;
        self.instances.end_part();
        Ok(())
    }

    /// Shows a part, which has ended, in the present file.
    pub fn instance(&mut self, part: u32, file_from_local: DAffine3) {
        let world_from_local = self.placement * file_from_local;
        self.report.dropped.out_of_range += self.instances.add(Instance { part, world_from_local });
    }

    /// Where things of the present file stand in the world.
    pub fn placement(&self) -> DAffine3 {
        self.placement
    }

    /// A new geometry.
    pub fn geometry(&mut self, name: &str, material: u32) -> u32 {
        let material = self.material_override.unwrap_or(material);
        self.scene.geometries.push(Geometry { name: name.to_owned(), material, has_triangles: false });
        self.scene.geometries.len() as u32 - 1
    }

    pub fn material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// The texture, which shows the image at `source`; the same one for the same.
    pub fn texture(&mut self, source: ImageSource, is_srgb: bool, texture: Texture) -> u32 {
        self.images.texture(&mut self.scene, source, is_srgb, texture)
    }

    /// The material of faces without one: the same for all files. Where vertices have colors it is white.
    pub fn default_material(&mut self, has_colors: bool) -> u32 {
        if let Some(material) = self.default_materials[usize::from(has_colors)] {
            return material;
        }
        let plain = Material::default();
        let base_color = if has_colors { [1.0; 3] } else { plain.base_color };
        let material = self.material(Material { base_color, ..plain });
        *self.default_materials[usize::from(has_colors)].insert(material)
    }

    /// Notes that a file is read, before that is done, or would be if it were there.
    pub fn note_file(&mut self, path: &Path) {
        let stamp = FileStamp::of(path);
        if !self.report.files.iter().any(|file| file.path == stamp.path) {
            self.report.files.push(stamp);
        }
    }

    pub fn warn(&mut self, path: &Path, what: impl std::fmt::Display) {
        let warning = one_line(&format!("{}: {what}", path.display()));
        if self.report.warnings.contains(&warning) {
        } else if self.report.warnings.len() < MAX_WARNINGS {
            self.report.warnings.push(warning);
        } else {
            self.report.warnings_left_out += 1;
        }
    }

    pub fn next_triangle_id(&self) -> u64 {
        self.next_triangle_id
    }

    /// Gives the next triangle this id.
    pub fn set_next_triangle_id(&mut self, id: u64) -> Result<()> {
        if id != self.next_triangle_id {
            self.flush()?;
            self.next_triangle_id = id;
        }
        Ok(())
    }

    /// Reports that `bytes` of the present file are done.
    pub fn advance(&mut self, bytes: u64) {
        let done = (self.bytes_before + bytes).min(self.progress.bytes_total);
        self.progress.bytes_done = done.max(self.progress.bytes_done);
        self.sink.progress(self.progress);
    }

    /// Adds a polygon of at least three corners; `place` is asked for where it stands if it is broken.
    #[inline]
    pub fn polygon(
        &mut self,
        geometry: u32,
        vertices: &impl Vertices,
        corners: &[u32],
        path: &Path,
        place: impl Fn() -> Place,
    ) -> Result<()> {
        let vertex_count = vertices.count();
        if let Some(&bad) = corners.iter().find(|&&corner| u64::from(corner) >= vertex_count) {
            return self.out_of_range(corners.len() as u64 - 2, path, place, i64::from(bad), vertex_count);
        }
        match *corners {
            [a, b, c] => self.triangle(geometry, vertices, [a, b, c], [0, 1, 2]),
            _ => {
                check_corners(corners.len() as u64, path, place)?;
                self.cut_polygon(geometry, vertices, corners)
            }
        }
    }

    fn cut_polygon(&mut self, geometry: u32, vertices: &impl Vertices, corners: &[u32]) -> Result<()> {
        self.polygon.clear();
        self.polygon.extend(corners.iter().map(|&corner| vertices.position(corner)));
        let mut cut = std::mem::take(&mut self.cut);
        cut.clear();
        triangulate(&self.polygon, &mut cut);
        for triangle in &cut {
            let places = triangle.map(|i| i as usize);
            self.triangle(geometry, vertices, places.map(|i| corners[i]), places)?;
        }
        self.cut = cut;
        Ok(())
    }

    /// Drops `count` triangles because of an index, or fails, as the options say. In text it takes time to find out
    /// the place.
    pub fn out_of_range(
        &mut self,
        count: u64,
        path: &Path,
        place: impl FnOnce() -> Place,
        index: i64,
        vertex_count: u64,
    ) -> Result<()> {
        if !self.options.drop_out_of_range {
            return Err(ImportError::IndexOutOfRange {
                path: path.into(),
                place: place(),
                index,
                vertex_count,
            });
        }
        self.report.dropped.out_of_range += count;
        self.set_next_triangle_id(self.next_triangle_id + count)
    }

    /// Adds a triangle with checked indices; `places` are those of its corners in the polygon.
    #[inline]
    fn triangle(
        &mut self,
        geometry: u32,
        vertices: &impl Vertices,
        corners: [u32; 3],
        places: [usize; 3],
    ) -> Result<()> {
        let full =
            self.batch.triangles.len() >= MAX_TRIANGLES || self.batch.positions.len() + 3 > MAX_POSITIONS;
        let streams = if self.options.bare { Streams::NONE } else { vertices.streams() };
        let is_other = self.batch.geometry != geometry || self.batch.streams != streams;
        if full || (is_other && !self.batch.triangles.is_empty()) {
            self.flush()?;
            self.let_go(vertices);
        }
        let positions_before = self.batch.positions.len();
        self.batch.streams = streams;
        let [a, b, c] = corners;
        // No loop: copying small arrays about would take longer than the rest.
        let mut local = |corner, place| match streams.is_empty() {
            true => self.local_index(vertices, corner),
            false => self.local_index_with_attributes(vertices, corner, place),
        };
        let (a, b, c) = match (local(a, places[0]), local(b, places[1]), local(c, places[2])) {
            (Ok(a), Ok(b), Ok(c)) => (a, b, c),
            (Err(position), _, _) | (_, Err(position), _) | (_, _, Err(position)) => {
                return self.drop_triangle(position, positions_before);
            }
        };
        let triangle = if self.mirrored { [a, c, b] } else { [a, b, c] };
        if self.batch.triangles.is_empty() {
            self.batch.geometry = geometry;
            self.batch.first_triangle_id = self.next_triangle_id;
        }
        self.batch.triangles.push(triangle);
        self.next_triangle_id += 1;
        Ok(())
    }

    /// The place of a vertex in the batch, or its position if that cannot be used.
    #[inline(always)]
    fn local_index(&mut self, vertices: &impl Vertices, corner: u32) -> std::result::Result<u32, DVec3> {
        self.vertices.find(corner).or_else(|slot| {
            let position = self.world_from_local.transform_point3(DVec3::from(vertices.position(corner)));
            let [x, y, z] = position.to_array();
            // NaN is not in any range.
            let range = -MAX_COORDINATE..=MAX_COORDINATE;
            if !(range.contains(&x) && range.contains(&y) && range.contains(&z)) {
                return Err(position);
            }
            let local = self.batch.positions.len() as u32;
            self.batch.positions.push([x, y, z]);
            Ok(self.vertices.insert(slot, corner, local))
        })
    }

    /// The same for vertices with attributes.
    fn local_index_with_attributes(
        &mut self,
        vertices: &impl Vertices,
        corner: u32,
        place: usize,
    ) -> std::result::Result<u32, DVec3> {
        let before = self.batch.positions.len();
        let mut local = self.local_index(vertices, corner)?;
        let is_new = self.batch.positions.len() > before;
        if !is_new && !vertices.has_seams() {
            return Ok(local);
        }
        let mut attributes = vertices.attributes(place, corner);
        let turned = |matrix: DMat3, v: Vec3| (matrix * v.as_dvec3()).normalize_or_zero().as_vec3();
        attributes.normal = turned(self.normals_from_local, attributes.normal);
        attributes.tangent = turned(self.world_from_local.matrix3, attributes.tangent);
        self.record.clear();
        attributes.encode(self.batch.streams, &mut self.record);
        if !is_new {
            let bytes = self.record.len();
            let is_wanted =
                |local: u32| self.batch.attributes[local as usize * bytes..][..bytes] == self.record;
            while !is_wanted(local) {
                let next = self.siblings[local as usize];
                if next == NO_SIBLING {
                    self.batch.positions.push(self.batch.positions[local as usize]);
                    self.siblings[local as usize] = before as u32;
                    local = before as u32;
                    break;
                }
                local = next;
            }
        }
        if self.batch.positions.len() > before {
            self.batch.attributes.extend_from_slice(&self.record);
            self.siblings.push(NO_SIBLING);
        }
        Ok(local)
    }

    #[cold]
    fn drop_triangle(&mut self, position: DVec3, positions_before: usize) -> Result<()> {
        let dropped = &mut self.report.dropped;
        *(if position.is_finite() { &mut dropped.out_of_range } else { &mut dropped.non_finite }) += 1;
        self.batch.positions.truncate(positions_before);
        self.batch.attributes.truncate(positions_before * self.batch.streams.record_bytes());
        self.flush()?;
        self.next_triangle_id += 1;
        Ok(())
    }

    fn let_go(&mut self, vertices: &impl Vertices) {
        /// Some ten megabytes of pages where neighbors in the mesh are neighbors in the file; for the worst case there
        /// is [`Resident`](crate::resident::Resident).
        const BATCHES_BETWEEN: u64 = 16;
        self.batch_count += 1;
        if self.batch_count.is_multiple_of(BATCHES_BETWEEN) {
            vertices.release();
        }
    }

    /// Width of the strands of the present file, if it is known from elsewhere.
    pub fn strand_width(&self) -> Option<f64> {
        self.strands.width.or(self.options.strand_width)
    }

    /// Whether colors of vertices are wanted where they are all of the color: a material of the scene file takes their place.
    pub fn wants_colors(&self) -> bool {
        !self.options.bare && self.material_override.is_none()
    }

    /// Adds a strand through `points`, each with its radius in units of the file, and gives it the next numbers. A strand of
    /// fewer than two points has no segments; one with a position or radius that cannot be used is dropped.
    pub fn strand(
        &mut self,
        geometry: u32,
        points: impl ExactSizeIterator<Item = ([f64; 3], f64)>,
    ) -> Result<()> {
        let segments = (points.len() as u64).saturating_sub(1);
        self.strands.points.clear();
        for (position, radius) in points {
            let position = self.world_from_local.transform_point3(DVec3::from(position));
            let radius = radius * self.strands.scale;
            let fits = |x: f64| (-MAX_COORDINATE..=MAX_COORDINATE).contains(&x);
            if !(position.to_array().into_iter().all(fits) && (0.0..=MAX_COORDINATE).contains(&radius)) {
                let dropped = &mut self.report.dropped;
                let is_finite = position.is_finite() && radius.is_finite();
                *(if is_finite { &mut dropped.out_of_range } else { &mut dropped.non_finite }) += segments;
                return self.set_next_triangle_id(self.next_triangle_id + segments);
            }
            self.strands.points.push((position.to_array(), radius as f32));
        }
        if segments == 0 {
            return Ok(());
        }
        let points = std::mem::take(&mut self.strands.points);
        let mut first = 0;
        while first + 1 < points.len() {
            let end = points.len().min(first + MAX_POSITIONS);
            let takes = self.strands.takes(geometry, end - first, self.next_triangle_id);
            if !takes || !self.batch.triangles.is_empty() {
                self.flush()?;
            }
            self.strands.push(geometry, &points[first..end], self.next_triangle_id);
            self.next_triangle_id += (end - first - 1) as u64;
            first = end - 1;
        }
        self.strands.points = points;
        Ok(())
    }

    /// Hands over the present batch.
    fn flush(&mut self) -> Result<()> {
        if let Some(batch) = self.strands.take() {
            self.report.segments += (batch.positions.len() - batch.lengths.len()) as u64;
            self.sink.strands(batch).map_err(ImportError::Sink)?;
        }
        self.vertices.clear();
        self.siblings.clear();
        if self.batch.triangles.is_empty() {
            self.batch.positions.clear();
            self.batch.attributes.clear();
            return Ok(());
        }
        let batch = std::mem::take(&mut self.batch);
        // The next batch is most likely about as large as this one.
        self.batch.positions.reserve(batch.positions.len());
        self.batch.triangles.reserve(batch.triangles.len());
        self.batch.attributes.reserve(batch.attributes.len());
        self.report.triangles += batch.triangles.len() as u64;
        self.scene.geometries[batch.geometry as usize].has_triangles = true;
        let part = self.instances.take(&batch);
        self.sink.batch(TriangleBatch { part, ..batch }).map_err(ImportError::Sink)
    }
}

/// Refuses polygons that would take too much memory.
pub(crate) fn check_corners(count: u64, path: &Path, place: impl FnOnce() -> Place) -> Result<()> {
    if count <= MAX_CORNERS {
        return Ok(());
    }
    let what =
        format!("a face has {count} corners, {MAX_CORNERS} at most are read; cut it into smaller ones");
    Err(ImportError::unsupported(path, place(), what))
}

/// Finds the place in the batch of a vertex of the file: a hash table of fixed size.
///
/// The first try is the index itself, so that neighbors in the file are neighbors in the table and stay in cache.
/// Where another vertex has that slot, linear probing from a hash of the index goes on: runs of indices that meet
/// in the table would otherwise have to step over each other.
struct VertexMap {
    /// File index in the upper half, batch index + 1 in the lower; 0 where free.
    slots: Vec<u64>,
    used: Vec<u32>,
}

impl VertexMap {
    const BITS: u32 = MAX_POSITIONS.ilog2() + 1;
    const MASK: usize = (1 << Self::BITS) - 1;

    fn new() -> VertexMap {
        VertexMap { slots: vec![0; 1 << Self::BITS], used: Vec::new() }
    }

    /// The batch index, or the slot where the vertex belongs.
    #[inline]
    fn find(&self, vertex: u32) -> std::result::Result<u32, usize> {
        let slot = vertex as usize & Self::MASK;
        match self.slots[slot] {
            0 => Err(slot),
            entry if (entry >> 32) as u32 == vertex => Ok(entry as u32 - 1),
            _ => self.find_elsewhere(vertex),
        }
    }

    fn find_elsewhere(&self, vertex: u32) -> std::result::Result<u32, usize> {
        // Fibonacci hashing.
        let mut slot = (vertex.wrapping_mul(0x9e37_79b9) >> (32 - Self::BITS)) as usize;
        loop {
            match self.slots[slot] {
                0 => return Err(slot),
                entry if (entry >> 32) as u32 == vertex => return Ok(entry as u32 - 1),
                _ => slot = (slot + 1) & Self::MASK,
            }
        }
    }

    #[inline]
    fn insert(&mut self, slot: usize, vertex: u32, local: u32) -> u32 {
        self.slots[slot] = u64::from(vertex) << 32 | u64::from(local + 1);
        self.used.push(slot as u32);
        local
    }

    fn clear(&mut self) {
        for slot in self.used.drain(..) {
            self.slots[slot as usize] = 0;
        }
    }
}
