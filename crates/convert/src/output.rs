//! The unfinished pack: pieces go in one after the other, and the next run finds them there.

use crate::ConvertError;
use crate::assemble::Root;
use crate::blocks::Blocks;
use crate::borders;
use crate::flat_tree::FlatTree;
use crate::forest::Forest;
use crate::instances::placed_emitters;
use crate::piece::BuiltPiece;
use crate::proxy::PackedProxy;
use crate::sidecar::{Added, Sidecar};
use crate::textures::Tiles;
use crate::top::{Entry, Top};
use bytemuck::Zeroable;
use raystrips_extmem::{Extent, Spool};
use raystrips_geom::scene::SceneDesc;
use raystrips_pack::{Emitter, GeometryBounds, Manifest, PackContents, PackWriter, PageRecord, TopEntry};
use raystrips_strips::Bvh;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

const PACK: &str = "pack";
const IDS: &str = "ids";
const EMITTERS: &str = "emitters";
const SHARED: &str = "shared";
const SIMPLIFIED: &str = "simplified";
const ATTRIBUTES: &str = "attributes";
const ATTRIBUTE_DIRECTORY: &str = "attribute_directory";

/// Where the parts of an unfinished pack are.
pub(crate) struct Files {
    pub folder: PathBuf,
    /// Tells packs in one folder apart.
    pub prefix: &'static str,
    /// Folder for sorting.
    pub scratch: PathBuf,
}

impl Files {
    /// A file with this name, after the prefix.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{}{name}", self.prefix))
    }
}

/// What must be known of a piece that is in the pack.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct PieceRecord {
    pub number: u64,
    pages: Vec<PageRecord>,
    tree: FlatTree,
    roots: Vec<Root>,
    own_vertices: u64,
    ids: Added,
    emitters: Added,
    shared_vertices: Added,
    attributes: Added,
    attribute_directory: Added,
    simplified: Added,
    simplified_triangles: u64,
}

/// A pack that is being written.
pub(crate) struct Output<'a> {
    path: &'a Path,
    files: Files,
    writer: PackWriter,
    ids: Sidecar,
    emitters: Sidecar,
    /// Vertices that several pieces may have.
    shared_vertices: Sidecar,
    /// Attributes of pages.
    attributes: Sidecar,
    attribute_directory: Sidecar,
    /// First level of the proxy.
    simplified: Sidecar,
    /// Pieces in it.
    pieces: Vec<PieceRecord>,
}

impl<'a> Output<'a> {
    /// Begins the pack, or goes on after those of `pieces` that are whole.
    pub fn open(
        path: &'a Path,
        files: Files,
        manifest: Manifest,
        mut pieces: Vec<PieceRecord>,
    ) -> Result<Output<'a>, ConvertError> {
        let sidecar = |name, added: fn(&PieceRecord) -> Added| {
            Sidecar::open(&files.path(name), pieces.iter().map(added)).map_err(ConvertError::Scratch)
        };
        let (ids, ids_whole) = sidecar(IDS, |piece| piece.ids)?;
        let (emitters, emitters_whole) = sidecar(EMITTERS, |piece| piece.emitters)?;
        let (shared_vertices, shared_whole) = sidecar(SHARED, |piece| piece.shared_vertices)?;
        let (simplified, simplified_whole) = sidecar(SIMPLIFIED, |piece| piece.simplified)?;
        let (attributes, attributes_whole) = sidecar(ATTRIBUTES, |piece| piece.attributes)?;
        let (attribute_directory, directory_whole) =
            sidecar(ATTRIBUTE_DIRECTORY, |piece| piece.attribute_directory)?;
        let whole = [ids_whole, emitters_whole, shared_whole, attributes_whole, directory_whole];
        pieces.truncate(whole.into_iter().fold(simplified_whole, usize::min));
        let partial = files.path(PACK);
        let (writer, whole) = if pieces.is_empty() || !partial.exists() {
            (PackWriter::create(&partial, manifest).map_err(ConvertError::write(path))?, 0)
        } else {
            let pages: Vec<&[PageRecord]> = pieces.iter().map(|piece| piece.pages.as_slice()).collect();
            PackWriter::reopen(&partial, manifest, &pages).map_err(ConvertError::write(path))?
        };
        pieces.truncate(whole);
        let mut output = Output {
            path,
            files,
            writer,
            ids,
            emitters,
            shared_vertices,
            attributes,
            attribute_directory,
            simplified,
            pieces,
        };
        output.cut().map_err(ConvertError::Scratch)?;
        Ok(output)
    }

    /// Cuts off what follows the pieces that are whole.
    fn cut(&mut self) -> io::Result<()> {
        self.ids.cut(self.pieces.iter().map(|piece| piece.ids))?;
        self.emitters.cut(self.pieces.iter().map(|piece| piece.emitters))?;
        self.simplified.cut(self.pieces.iter().map(|piece| piece.simplified))?;
        self.attributes.cut(self.pieces.iter().map(|piece| piece.attributes))?;
        self.attribute_directory.cut(self.pieces.iter().map(|piece| piece.attribute_directory))?;
        self.shared_vertices.cut(self.pieces.iter().map(|piece| piece.shared_vertices))
    }

    /// Pieces in the pack.
    pub fn piece_count(&self) -> usize {
        self.pieces.len()
    }

    /// Adds the next piece. Gives the record by which the next run finds it.
    pub fn add(&mut self, piece: BuiltPiece) -> Result<PieceRecord, ConvertError> {
        let pages = self.writer.pages(&piece.assembled.pages, piece.assembled.file_order.order());
        let pages = pages.and_then(|pages| self.writer.flush().map(|()| pages));
        let mut sidecars = || -> io::Result<[Added; 6]> {
            Ok([
                self.ids.add(&piece.ids)?,
                self.emitters.add(bytemuck::cast_slice(&piece.emitters))?,
                self.shared_vertices.add(bytemuck::cast_slice(&piece.shared_vertices))?,
                self.simplified.add(&piece.simplified.bytes)?,
                self.attributes.add(&piece.attributes.1)?,
                self.attribute_directory.add(bytemuck::cast_slice(&piece.attributes.0))?,
            ])
        };
        let [ids, emitters, shared_vertices, simplified, attributes, attribute_directory] =
            sidecars().map_err(ConvertError::Scratch)?;
        let record = PieceRecord {
            number: self.pieces.len() as u64,
            pages: pages.map_err(ConvertError::write(self.path))?,
            tree: FlatTree::of(&piece.assembled.tree),
            roots: piece.assembled.roots,
            own_vertices: piece.own_vertices,
            ids,
            emitters,
            shared_vertices,
            attributes,
            attribute_directory,
            simplified,
            simplified_triangles: piece.simplified.triangles,
        };
        self.pieces.push(record.clone());
        Ok(record)
    }

    /// The first level of the proxy, of these pieces; `at_a_time` chunks are worked on at a time.
    pub fn simplified(&self, pieces: Range<usize>, at_a_time: usize) -> Result<Blocks, ConvertError> {
        let place = |end: &mut u64, piece: &PieceRecord| {
            let extent = Extent { offset: *end, bytes: piece.simplified.bytes() };
            *end += extent.bytes;
            Some(extent)
        };
        let chunks: Vec<Extent> = self.pieces.iter().scan(0, place).collect();
        let length = chunks.last().map_or(0, |last| last.offset + last.bytes);
        Ok(Blocks {
            spool: Spool::reopen(&self.files.path(SIMPLIFIED), length).map_err(ConvertError::Scratch)?.into(),
            chunks: chunks[pieces.clone()].to_vec(),
            triangles: self.pieces[pieces].iter().map(|piece| piece.simplified_triangles).sum(),
            at_a_time,
            is_consumed: false,
            keeps_flat: true,
        })
    }

    /// A new file beside the pack that nobody else sees, and the scene, for images to be put there.
    pub fn images(&mut self) -> Result<(File, &mut SceneDesc), ConvertError> {
        let file = tempfile::tempfile_in(&self.files.folder).map_err(ConvertError::Scratch)?;
        Ok((file, &mut self.writer.manifest_mut().scene))
    }

    /// Completes the pack; `forest` has the hierarchies over its pieces. Gives its manifest and length.
    pub fn finish(
        mut self,
        forest: Forest,
        memory_bytes: u64,
        geometry_bounds: &[GeometryBounds],
        proxies: &[PackedProxy],
        mut tiles: Option<Tiles>,
    ) -> Result<(Manifest, u64), ConvertError> {
        let emitters =
            self.emitters.read().and_then(|emitters| with_instances(emitters, &self.pieces, &forest));
        let mut emitters = emitters.map_err(ConvertError::Scratch)?;
        let (forest, entries) = forest_and_entries(forest, &self.pieces)?;
        let top = Top::over(&forest, &entries).map_err(ConvertError::write(self.path))?;
        let shared_vertices = self.shared_vertices.read().map_err(ConvertError::Scratch)?;
        let shared = borders::count_different(shared_vertices, &self.files.scratch, memory_bytes as usize);
        let manifest = self.writer.manifest_mut();
        manifest.depth = top.depth;
        manifest.vertices += shared.map_err(ConvertError::Scratch)?
            + self.pieces.iter().map(|piece| piece.own_vertices).sum::<u64>();
        manifest.shown = forest.shown;
        (manifest.bounds_min, manifest.bounds_max) = (top.bounds.min.to_array(), top.bounds.max.to_array());
        let open = |proxy: &PackedProxy| Ok((proxy.kind, File::open(&proxy.path)?));
        let files: io::Result<Vec<_>> = proxies.iter().map(open).collect();
        let mut files = files.map_err(ConvertError::Scratch)?;
        let has_attributes = self.pieces.iter().any(|piece| piece.attributes.bytes() > 0);
        let mut attributes = [
            self.attribute_directory.read().map_err(ConvertError::Scratch)?,
            self.attributes.read().map_err(ConvertError::Scratch)?,
        ];
        let [directory, blocks] = &mut attributes;
        let contents = PackContents {
            top_nodes: &top.nodes,
            top_entries: &top.entries,
            instances: &top.instances,
            emitters: &mut emitters,
            triangle_ids: &mut self.ids.read().map_err(ConvertError::Scratch)?,
            geometry_bounds,
            proxies: files.iter_mut().map(|(kind, file)| (*kind, file as &mut dyn Read)).collect(),
            attributes: has_attributes.then_some([directory as &mut dyn Read, blocks]),
            tiles: tiles.as_mut().map(|Tiles { entries, file }| (&entries[..], file as &mut dyn Read)),
        };
        self.writer.finish(self.path, contents).map_err(ConvertError::write(self.path))
    }
}

/// The hierarchies down into the pieces, and the ways into pages that their leaves lead to.
fn forest_and_entries(forest: Forest, pieces: &[PieceRecord]) -> Result<(Forest, Vec<Entry>), ConvertError> {
    let mut entries = Vec::new();
    let mut trees = Vec::with_capacity(pieces.len());
    let mut first_page = 0;
    for piece in pieces {
        let tree = piece.tree.tree().filter(|tree| tree.items().end == piece.roots.len());
        trees.push(tree.ok_or_else(|| {
            let what = "the journal of the conversion is damaged; begin anew with --restart";
            ConvertError::Scratch(io::Error::new(io::ErrorKind::InvalidData, what))
        })?);
        entries.extend(piece.roots.iter().map(|root| Entry {
            entry: TopEntry { page: first_page + root.page, node: root.node },
            depth: root.depth,
        }));
        first_page += piece.pages.len() as u32;
    }
    let mut trees = trees.into_iter();
    Ok((forest.down_to_pages(|| trees.next().expect("a tree for each piece")), entries))
}

/// The lamps of the scene, which `emitters` begins with, then those of parts as instances show them.
fn with_instances(
    mut emitters: BufReader<File>,
    pieces: &[PieceRecord],
    forest: &Forest,
) -> io::Result<impl Read + use<>> {
    let pieces_of = |tree: Option<&Bvh>| tree.map_or(0, |tree| tree.items().end);
    let (in_scene, mut in_parts) = pieces.split_at(pieces_of(forest.scene.as_ref()));
    let scene_bytes: u64 = in_scene.iter().map(|piece| piece.emitters.bytes()).sum();
    emitters.seek(SeekFrom::Start(scene_bytes))?;
    let mut of_parts = Vec::with_capacity(forest.parts.len());
    for part in &forest.parts {
        let (own, others) = in_parts.split_at(pieces_of(part.as_ref()));
        in_parts = others;
        let bytes: u64 = own.iter().map(|piece| piece.emitters.bytes()).sum();
        let mut lamps = vec![Emitter::zeroed(); bytes as usize / size_of::<Emitter>()];
        emitters.read_exact(bytemuck::cast_slice_mut(&mut lamps))?;
        of_parts.push(lamps);
    }
    let shown = forest.instances().iter().flat_map(|i| placed_emitters(i, &of_parts[i.root as usize]));
    let shown: Vec<u8> = bytemuck::allocation::pod_collect_to_vec(&shown.collect::<Vec<Emitter>>());
    emitters.rewind()?;
    Ok(emitters.take(scene_bytes).chain(io::Cursor::new(shown)))
}
