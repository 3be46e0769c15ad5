//! Opens a pack: reads the sections that stay in memory and checks them. Pages are not read here.

use crate::PackError;
use crate::layout::*;
use crate::manifest::Manifest;
use crate::proxy::{Part, ProxyKind};
use crate::sections::Sections;
use crate::shading::Shading;
use std::io::{Read, Seek};

/// The resident part of a pack.
///
/// Memory: 32 bytes a page and what [`Shading`] takes, the nodes above the pages, 52 bytes an
/// instance, the emitters and the manifest.
#[derive(Clone, Debug)]
pub struct Pack {
    /// Numbers and names.
    pub manifest: Manifest,
    /// Where the pages are.
    pub directory: Vec<PageEntry>,
    /// Nodes above the pages; node 0 is the root.
    pub top_nodes: Vec<TopNode>,
    /// Ways into pages.
    pub top_entries: Vec<TopEntry>,
    /// Parts of the scene at places of their own.
    pub instances: Vec<Instance>,
    /// The greatest [`Instance::condition`]; 1 if there are no instances.
    pub condition: f32,
    /// Emissive triangles.
    pub emitters: Vec<Emitter>,
    /// Boxes of the geometries; none if they are not kept.
    pub geometry_bounds: Vec<GeometryBounds>,
    /// Length of the file.
    pub file_bytes: u64,
    /// Attributes of vertices and images.
    pub shading: Shading,
    triangle_ids: SectionEntry,
    /// By [`ProxyKind`].
    proxies: [Option<SectionEntry>; 2],
}

impl Pack {
    /// Reads all but the pages and the triangle ids, and checks it. Takes time by the number of pages, not of
    /// triangles.
    pub fn open(file: &mut (impl Read + Seek)) -> Result<Pack, PackError> {
        let mut sections = Sections::find(file)?;
        let directory: Vec<PageEntry> = sections.array(Section::Directory)?;
        let instances: Vec<Instance> = sections.optional_array(Section::Instances)?;
        let pack = Pack {
            manifest: Manifest::decode(&sections.array(Section::Manifest)?)?,
            shading: Shading::open(&mut sections, directory.len())?,
            directory,
            top_nodes: sections.array(Section::TopNodes)?,
            top_entries: sections.array(Section::TopEntries)?,
            condition: instances.iter().map(Instance::condition).fold(1.0, f64::max) as f32,
            instances,
            emitters: sections.array(Section::Emitters)?,
            geometry_bounds: sections.optional_array(Section::GeometryBounds)?,
            proxies: [
                sections.optional_entry(ProxyKind::Fine.section())?,
                sections.optional_entry(ProxyKind::Coarse.section())?,
            ],
            triangle_ids: sections.entry(Section::TriangleIds)?,
            file_bytes: sections.length,
        };
        pack.check_manifest()?;
        pack.check_directory()?;
        pack.check_top()?;
        pack.check_scene()?;
        Ok(pack)
    }

    /// Bytes of memory that the resident part takes, at about.
    pub fn resident_bytes(&self) -> u64 {
        (size_of_val(&self.directory[..])
            + size_of_val(&self.top_nodes[..])
            + size_of_val(&self.top_entries[..])
            + size_of_val(&self.instances[..])
            + 2 * size_of_val(&self.emitters[..])
            + size_of_val(&self.geometry_bounds[..])) as u64
            + self.shading.resident_bytes()
    }

    /// Where the pack of a proxy is in the file: offset and length. `None` if there is none of the kind.
    pub fn proxy(&self, kind: ProxyKind) -> Option<(u64, u64)> {
        self.proxies[kind as usize].map(|entry| (entry.offset, entry.bytes))
    }

    /// Opens the pack of a proxy, which is in the same `file`. Offsets in it count from its beginning.
    pub fn open_proxy(
        &self,
        file: &mut (impl Read + Seek),
        kind: ProxyKind,
    ) -> Result<Option<Pack>, PackError> {
        let Some(entry) = &self.proxies[kind as usize] else { return Ok(None) };
        let wrong = |what: &str| Err(kind.error(PackError::corrupt(what)));
        let pack = Pack::open(&mut Part::new(file, entry)).map_err(|e| kind.error(e))?;
        if pack.proxies.iter().any(Option::is_some) {
            return wrong("it has proxies of its own");
        }
        if pack.manifest.scene.geometries.len() != self.manifest.scene.geometries.len() {
            return wrong("it has other geometries");
        }
        Ok(Some(pack))
    }

    /// Where the original ids of triangles are in the file: offset and length; the length is 0 if none are kept.
    pub fn triangle_ids(&self) -> (u64, u64) {
        (self.triangle_ids.offset, self.triangle_ids.bytes)
    }

    /// Checks the bytes at [`Pack::triangle_ids`]: their checksum, and that each names one of three corners.
    pub fn check_triangle_ids(&self, ids: &[u8]) -> Result<(), PackError> {
        if crc32c::crc32c(ids) != self.triangle_ids.checksum {
            return Err(PackError::corrupt("TriangleIds section: its checksum does not match"));
        }
        let width = usize::from(self.manifest.id_bytes.max(1));
        match ids.chunks(width).position(|id| id[0] & 3 == 3) {
            Some(i) => Err(PackError::corrupt(format!("triangle id {i} names a corner that does not exist"))),
            None => Ok(()),
        }
    }

    fn check_manifest(&self) -> Result<(), PackError> {
        let wrong = |what: &str| Err(PackError::corrupt(format!("manifest: {what}")));
        let m = &self.manifest;
        let in_order = |(min, max): (&f32, &f32)| min.is_finite() && max.is_finite() && min <= max;
        if !m.bounds_min.iter().zip(&m.bounds_max).all(in_order) {
            return wrong("bad bounds");
        }
        if !m.scene_offset.iter().all(|x| x.is_finite())
            || !m.position_error.is_finite()
            || !m.radius_error.is_finite()
        {
            return wrong("bad scene offset");
        }
        if m.depth as usize > MAX_DEPTH {
            return wrong("too deep");
        }
        if m.clusters > m.strips || m.strips > m.primitives || m.segments > m.primitives {
            return wrong("more clusters than strips, or strips or segments than primitives");
        }
        if m.bytes.total().is_none_or(|total| total > self.file_bytes) {
            return wrong("byte counts beyond the length of the file");
        }
        if !m.strand_bytes.is_part_of(&m.bytes) {
            return wrong("more bytes of strands than of all");
        }
        Ok(())
    }

    fn check_directory(&self) -> Result<(), PackError> {
        let mut triangles = 0u64;
        let mut places = Vec::with_capacity(self.directory.len());
        let wrong =
            |page: PageId| Err(PackError::CorruptPage { page, what: "its directory entry is wrong".into() });
        for (page, entry) in (0..).zip(&self.directory) {
            let good = entry.offset >= FILE_HEADER_BYTES as u64
                && entry.offset.is_multiple_of(ALIGNMENT)
                && entry.first_triangle == triangles
                && entry.node_count as usize <= MAX_PAGE_NODES;
            let end = entry.offset.checked_add(u64::from(entry.bytes));
            let Some(end) = end.filter(|&end| good && end <= self.file_bytes) else { return wrong(page) };
            triangles += u64::from(entry.triangle_count);
            places.push((entry.offset, end, page));
        }
        // Pages never overlap, so checking all of them takes time by the length of the file.
        places.sort_unstable();
        if let Some(pair) = places.windows(2).find(|pair| pair[1].0 < pair[0].1) {
            return wrong(pair[0].2.max(pair[1].2));
        }
        let pages = self.directory.len() as u64;
        let instances = self.instances.len() as u64;
        if triangles != self.manifest.primitives
            || pages != self.manifest.pages
            || pages > MAX_PAGES
            || instances != self.manifest.instances
        {
            return Err(PackError::corrupt("directory and manifest differ"));
        }
        let ids = triangles.checked_mul(u64::from(self.manifest.id_bytes));
        if ids != Some(self.triangle_ids.bytes) || ![0, 4, 8].contains(&self.manifest.id_bytes) {
            return Err(PackError::corrupt("wrong number of triangle ids"));
        }
        Ok(())
    }

    fn check_scene(&self) -> Result<(), PackError> {
        let scene = &self.manifest.scene;
        if scene.geometries.iter().any(|g| g.material as usize >= scene.materials.len()) {
            return Err(PackError::corrupt("a geometry has no material"));
        }
        self.shading.check(scene)?;
        if self.emitters.iter().any(|e| e.geometry as usize >= scene.geometries.len()) {
            return Err(PackError::corrupt("an emitter has no geometry"));
        }
        let is_box = |b: &GeometryBounds| b.min.iter().chain(&b.max).all(|x| !x.is_nan());
        let count = self.geometry_bounds.len();
        if count > 0 && count != scene.geometries.len() || !self.geometry_bounds.iter().all(is_box) {
            return Err(PackError::corrupt("boxes of geometries are wrong"));
        }
        if !self.emitters.iter().flat_map(|e| e.corners.as_flattened()).all(|x| x.is_finite()) {
            return Err(PackError::corrupt("a corner of an emitter is not finite"));
        }
        Ok(())
    }
}
