//! The unfinished pack: pieces go in one after the other, and the next run finds them there.

use crate::ConvertError;
use crate::assemble::Root;
use crate::borders;
use crate::flat_tree::FlatTree;
use crate::job::Job;
use crate::piece::BuiltPiece;
use crate::sidecar::{Added, Sidecar};
use crate::top::{Entry, Top};
use raystrips_pack::{Manifest, PackContents, PackError, PackWriter, PageRecord, TopEntry};
use raystrips_strips::Bvh;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;

const PACK: &str = "pack";
const IDS: &str = "ids";
const EMITTERS: &str = "emitters";
const SHARED: &str = "shared";

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
}

/// A pack that is being written.
pub(crate) struct Output<'a> {
    path: &'a Path,
    writer: PackWriter,
    ids: Sidecar,
    emitters: Sidecar,
    /// Vertices that several pieces may have.
    shared_vertices: Sidecar,
    /// Pieces in it.
    pieces: Vec<PieceRecord>,
}

impl<'a> Output<'a> {
    /// Begins the pack, or goes on after those of `pieces` that are whole.
    pub fn open(
        path: &'a Path,
        job: &Job,
        manifest: Manifest,
        mut pieces: Vec<PieceRecord>,
    ) -> Result<Output<'a>, ConvertError> {
        let sidecar = |name, added: fn(&PieceRecord) -> Added| {
            Sidecar::open(&job.file(name), pieces.iter().map(added)).map_err(ConvertError::Scratch)
        };
        let (ids, ids_whole) = sidecar(IDS, |piece| piece.ids)?;
        let (emitters, emitters_whole) = sidecar(EMITTERS, |piece| piece.emitters)?;
        let (shared_vertices, shared_whole) = sidecar(SHARED, |piece| piece.shared_vertices)?;
        pieces.truncate(ids_whole.min(emitters_whole).min(shared_whole));
        let partial = job.file(PACK);
        let (writer, whole) = if pieces.is_empty() || !partial.exists() {
            (PackWriter::create(&partial, manifest).map_err(ConvertError::write(path))?, 0)
        } else {
            let pages: Vec<&[PageRecord]> = pieces.iter().map(|piece| piece.pages.as_slice()).collect();
            PackWriter::reopen(&partial, manifest, &pages).map_err(ConvertError::write(path))?
        };
        pieces.truncate(whole);
        let mut output = Output { path, writer, ids, emitters, shared_vertices, pieces };
        output.cut().map_err(ConvertError::Scratch)?;
        Ok(output)
    }

    /// Cuts off what follows the pieces that are whole.
    fn cut(&mut self) -> io::Result<()> {
        self.ids.cut(self.pieces.iter().map(|piece| piece.ids))?;
        self.emitters.cut(self.pieces.iter().map(|piece| piece.emitters))?;
        self.shared_vertices.cut(self.pieces.iter().map(|piece| piece.shared_vertices))
    }

    /// Pieces in the pack.
    pub fn piece_count(&self) -> usize {
        self.pieces.len()
    }

    /// Adds the next piece and notes that it is there.
    pub fn add(&mut self, piece: BuiltPiece, job: &mut Job) -> Result<(), ConvertError> {
        let pages = piece.assembled.pages.iter().map(|page| self.writer.page(page));
        let pages: Result<Vec<PageRecord>, PackError> = pages.collect();
        let pages = pages.and_then(|pages| self.writer.flush().map(|()| pages));
        let mut sidecars = || -> io::Result<[Added; 3]> {
            Ok([
                self.ids.add(&piece.ids)?,
                self.emitters.add(bytemuck::cast_slice(&piece.emitters))?,
                self.shared_vertices.add(bytemuck::cast_slice(&piece.shared_vertices))?,
            ])
        };
        let [ids, emitters, shared_vertices] = sidecars().map_err(ConvertError::Scratch)?;
        let record = PieceRecord {
            number: self.pieces.len() as u64,
            pages: pages.map_err(ConvertError::write(self.path))?,
            tree: FlatTree::of(&piece.assembled.tree),
            roots: piece.assembled.roots,
            own_vertices: piece.own_vertices,
            ids,
            emitters,
            shared_vertices,
        };
        job.note_piece(record.clone())?;
        self.pieces.push(record);
        Ok(())
    }

    /// Completes the pack; `tree` is the hierarchy over its pieces. Gives its manifest and length.
    pub fn finish(
        mut self,
        tree: Bvh,
        job: &Job,
        memory_bytes: u64,
    ) -> Result<(Manifest, u64), ConvertError> {
        let (tree, entries) = self.tree_and_entries(tree)?;
        let top = Top::over(&tree, &entries).map_err(ConvertError::write(self.path))?;
        let shared_vertices = self.shared_vertices.read().map_err(ConvertError::Scratch)?;
        let shared = borders::count_different(shared_vertices, job.scratch_path(), memory_bytes as usize);
        let manifest = self.writer.manifest_mut();
        manifest.depth = top.depth;
        manifest.vertices = shared.map_err(ConvertError::Scratch)?
            + self.pieces.iter().map(|piece| piece.own_vertices).sum::<u64>();
        let bounds = tree.bounds();
        (manifest.bounds_min, manifest.bounds_max) = (bounds.min.to_array(), bounds.max.to_array());
        let contents = PackContents {
            top_nodes: &top.nodes,
            top_entries: &top.entries,
            emitters: &mut self.emitters.read().map_err(ConvertError::Scratch)?,
            triangle_ids: &mut self.ids.read().map_err(ConvertError::Scratch)?,
        };
        self.writer.finish(self.path, contents).map_err(ConvertError::write(self.path))
    }

    /// The hierarchies of all pieces in one, and the ways into pages that its leaves lead to.
    fn tree_and_entries(&self, tree: Bvh) -> Result<(Bvh, Vec<Entry>), ConvertError> {
        let mut entries = Vec::new();
        let mut trees = Vec::with_capacity(self.pieces.len());
        let mut first_page = 0;
        for piece in &self.pieces {
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
        let tree = tree.graft(&mut |_, _| trees.next().expect("a tree for each piece"));
        Ok((tree, entries))
    }
}
