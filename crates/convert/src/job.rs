//! What is on disk while a conversion runs, and what the next run of the same conversion finds there.
//!
//! Beside the output OUT.rsp there is a folder OUT.rsp.partial with the unfinished pack, its sidecars and a journal.
//! Scratch files are there too, or in a folder under [`ConvertParams::scratch`]. Each record of the journal says that
//! something is whole: the import, the gathered pieces, a piece in the pack. What the first two speak of was brought to
//! the disk before; pieces in the pack have checksums.

use crate::distribute::{PieceSource, Pieces};
use crate::flat_tree::FlatTree;
use crate::gathered::Gathered;
use crate::import::Imported;
use crate::output::{Files, PieceRecord};
use crate::partition::Census;
use crate::{ConvertError, ConvertParams};
use raystrips_extmem::{Begun, Journal, MemoryBudget, ScratchDir, Spool, disk};
use raystrips_meshio::FileStamp;
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const JOURNAL: &str = "journal";
const IMPORTED: &str = "imported";
const GATHERED: &str = "gathered";
const GATHERED_STRANDS: &str = "gathered-strands";
const GATHERED_PARTS: &str = "gathered-parts";

/// What a record says.
#[derive(Serialize, Deserialize)]
enum Record {
    /// The files that were read: what follows is of no use when one has changed.
    Files(Vec<FileStamp>),
    /// Where scratch files may be, if not beside the pack.
    Scratch(PathBuf),
    Imported(Box<Imported>),
    /// The triangles of the import are being consumed.
    ImportGone,
    Gathered(GatheredRecord),
    Piece(PieceRecord),
}

/// Pieces that are gathered on disk: of triangles, of strands, and of parts.
#[derive(Serialize, Deserialize)]
struct GatheredRecord {
    triangles: Option<PiecesRecord>,
    strands: Option<PiecesRecord>,
    parts: Vec<Option<PiecesRecord>>,
}

/// Pieces of one kind.
#[derive(Serialize, Deserialize)]
struct PiecesRecord {
    tree: FlatTree,
    sources: Vec<PieceSource>,
    spool_bytes: u64,
    census: Census,
}

impl PiecesRecord {
    fn of(pieces: &Pieces) -> PiecesRecord {
        PiecesRecord {
            tree: FlatTree::of(&pieces.tree),
            sources: pieces.sources.clone(),
            spool_bytes: pieces.spool.length(),
            census: pieces.census.clone(),
        }
    }

    /// The pieces, which are in `spool`.
    fn pieces(self, spool: &Arc<Spool>) -> Option<Pieces> {
        let spool = spool.clone();
        let tree = self.tree.tree().filter(|tree| tree.leaves().len() == self.sources.len())?;
        Some(Pieces { tree, sources: self.sources, spool, census: self.census })
    }
}

/// What an earlier run has done.
#[derive(Default)]
pub(crate) struct Found {
    /// The files that it has read.
    pub files: Vec<FileStamp>,
    /// Where it may have scratch files, if not beside the pack.
    scratch: Vec<PathBuf>,
    /// The import but for its triangles.
    pub imported: Option<Imported>,
    gathered: Option<GatheredRecord>,
    /// Pieces that were in the pack.
    pub pieces: Vec<PieceRecord>,
}

impl Found {
    fn recall(&mut self, record: Record) {
        match record {
            Record::Files(files) => self.files = files,
            Record::Scratch(path) => {
                self.scratch.retain(|earlier| *earlier != path);
                self.scratch.push(path);
            }
            Record::Imported(imported) => self.imported = Some(*imported),
            Record::ImportGone => self.imported = None,
            Record::Gathered(gathered) => self.gathered = Some(gathered),
            // A piece after one that is not known is of no use.
            Record::Piece(piece) if piece.number <= self.pieces.len() as u64 => {
                self.pieces.truncate(piece.number as usize);
                self.pieces.push(piece);
            }
            Record::Piece(_) => {}
        }
    }
}

/// A conversion on disk.
pub(crate) struct Job {
    folder: ScratchDir,
    scratch: Option<ScratchDir>,
    journal: Journal,
    /// There is something that the next run need not do again.
    useful: bool,
}

impl Job {
    /// Takes up the conversion of `inputs` to `output`, or begins it.
    pub fn open(
        inputs: &[PathBuf],
        output: &Path,
        params: &ConvertParams,
    ) -> Result<(Job, Found), ConvertError> {
        let identity = identity(inputs, params);
        let (folder, begun) = open_folder(&folder_of(output), &identity)?;
        let open_journal = || Journal::open(&folder.file(JOURNAL)).map_err(ConvertError::Scratch);
        let (mut journal, records) = open_journal()?;
        let mut found = Found::default();
        // A record that cannot be read is as good as none.
        records.iter().map_while(|bytes| decode(bytes)).for_each(|record| found.recall(record));
        let is_new = begun == Begun::New || params.restart || !found.files.iter().all(FileStamp::is_current);
        if is_new {
            found = Found { scratch: found.scratch, ..Found::default() };
            folder.clear().map_err(ConvertError::Scratch)?;
            journal = open_journal()?.0;
        }
        let mut job = Job { folder, scratch: None, journal, useful: !is_new && !records.is_empty() };
        let scratch = params.scratch.as_ref().map(|place| scratch_folder(place, output));
        job.open_scratch(&found.scratch, scratch, &identity)?;
        if let Some(scratch) = job.scratch.as_ref().filter(|_| is_new) {
            scratch.clear().map_err(ConvertError::Scratch)?;
        }
        Ok((job, found))
    }

    /// Opens the folder of scratch files at `now`, and removes those `earlier` ones that are elsewhere. Whenever this
    /// process ends, all that there are are noted: each before it is made.
    fn open_scratch(
        &mut self,
        earlier: &[PathBuf],
        now: Option<PathBuf>,
        identity: &str,
    ) -> Result<(), ConvertError> {
        let others: Vec<&PathBuf> = earlier.iter().filter(|&path| Some(path) != now.as_ref()).collect();
        for path in others.iter().copied().chain(&now) {
            self.append(&Record::Scratch(path.clone()))?;
        }
        self.scratch = now.map(|path| open_folder(&path, identity)).transpose()?.map(|(scratch, _)| scratch);
        for path in others.into_iter().filter(|path| path.is_dir()) {
            drop(open_folder(path, identity)?);
        }
        Ok(())
    }

    fn append(&mut self, record: &Record) -> Result<(), ConvertError> {
        self.journal.append(&encode(record)).map_err(ConvertError::Scratch)
    }

    /// Does `work`. After an error that may pass, files stay for the next run if there is any use in them.
    pub fn run<T>(
        &mut self,
        work: impl FnOnce(&mut Job) -> Result<T, ConvertError>,
    ) -> Result<T, ConvertError> {
        work(self).map_err(|error| {
            let resumable = error.may_pass() && self.keep_if_useful();
            let error = error.in_folder(self.scratch_path());
            if resumable { ConvertError::Resumable(Box::new(error)) } else { error }
        })
    }

    /// Decides that the files stay for the next run if there is any use in them; tells whether.
    fn keep_if_useful(&mut self) -> bool {
        self.folder.keep(self.useful);
        if let Some(scratch) = &mut self.scratch {
            scratch.keep(self.useful);
        }
        self.useful
    }

    /// Files of the unfinished pack, or of another one that goes into it, whose name begins with `prefix`.
    pub fn files(&self, prefix: &'static str) -> Files {
        let folder = self.folder.path().to_owned();
        Files { folder, prefix, scratch: self.scratch_path().to_owned() }
    }

    /// Folder for scratch files.
    pub fn scratch_path(&self) -> &Path {
        self.scratch.as_ref().unwrap_or(&self.folder).path()
    }

    /// An empty spool for the import.
    pub fn import_spool(&self, budget: Option<&MemoryBudget>) -> Spool {
        Spool::new(&self.scratch_path().join(IMPORTED), budget)
    }

    /// The triangles of an import, if they are still there.
    pub fn imported(&self, imported: &Imported) -> Option<Spool> {
        Spool::reopen(&self.scratch_path().join(IMPORTED), imported.spool_bytes()).ok()
    }

    /// Notes which files were read, and the import, if it is on disk.
    pub fn note_import(&mut self, imported: &Imported, spool: &Spool) -> Result<(), ConvertError> {
        self.append(&Record::Files(imported.files.clone()))?;
        self.note_synced(&[spool], || vec![Record::Imported(Box::new(imported.clone()))])
    }

    /// Notes that the triangles of the import are going to be consumed.
    pub fn note_import_gone(&mut self) -> Result<(), ConvertError> {
        self.append(&Record::ImportGone)?;
        self.journal.sync().map_err(ConvertError::Scratch)
    }

    /// An empty spool for gathering pieces of triangles.
    pub fn triangle_spool(&self, budget: Option<&MemoryBudget>) -> Spool {
        Spool::new(&self.scratch_path().join(GATHERED), budget)
    }

    /// An empty spool for gathering pieces of strands.
    pub fn strand_spool(&self, budget: Option<&MemoryBudget>) -> Spool {
        Spool::new(&self.scratch_path().join(GATHERED_STRANDS), budget)
    }

    /// An empty spool for gathering pieces of all parts.
    pub fn part_spool(&self, budget: Option<&MemoryBudget>) -> Spool {
        Spool::new(&self.scratch_path().join(GATHERED_PARTS), budget)
    }

    /// The pieces that are gathered, if they are.
    pub fn gathered(&self, found: &mut Found) -> Option<Gathered> {
        let GatheredRecord { triangles, strands, parts } = found.gathered.take()?;
        let pieces = |records: Vec<Option<PiecesRecord>>, name: &str| -> Option<Vec<Option<Pieces>>> {
            let Some(bytes) = records.iter().flatten().map(|record| record.spool_bytes).max() else {
                return Some(records.iter().map(|_| None).collect());
            };
            let spool = Arc::new(Spool::reopen(&self.scratch_path().join(name), bytes).ok()?);
            let pieces = |record: Option<PiecesRecord>| match record {
                Some(record) => record.pieces(&spool).map(Some),
                None => Some(None),
            };
            records.into_iter().map(pieces).collect()
        };
        let triangles = pieces(vec![triangles], GATHERED)?.pop()?;
        let strands = pieces(vec![strands], GATHERED_STRANDS)?.pop()?;
        Gathered::new(triangles, strands, pieces(parts, GATHERED_PARTS)?)
    }

    /// Notes gathered pieces of an import, if they are on disk.
    pub fn note_gathered(&mut self, gathered: &Gathered, imported: &Imported) -> Result<(), ConvertError> {
        self.note_synced(&gathered.spools(), || {
            let record = GatheredRecord {
                triangles: gathered.triangles.as_ref().map(PiecesRecord::of),
                strands: gathered.strands.as_ref().map(PiecesRecord::of),
                parts: gathered.parts.iter().map(|part| part.as_ref().map(PiecesRecord::of)).collect(),
            };
            // All but the triangles of the import is still needed.
            vec![Record::Imported(Box::new(imported.clone())), Record::Gathered(record)]
        })
    }

    /// Removes the triangles of the import, which are not needed any more.
    pub fn remove_import(&self) -> Result<(), ConvertError> {
        match std::fs::remove_file(self.scratch_path().join(IMPORTED)) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => Err(ConvertError::Scratch(e)),
            _ => Ok(()),
        }
    }

    /// Notes a piece in the pack.
    pub fn note_piece(&mut self, piece: PieceRecord) -> Result<(), ConvertError> {
        self.append(&Record::Piece(piece))?;
        self.useful = true;
        Ok(())
    }

    /// Notes what is in `spools` once that is on disk; nothing if part of it is in memory.
    fn note_synced(
        &mut self,
        spools: &[&Spool],
        records: impl FnOnce() -> Vec<Record>,
    ) -> Result<(), ConvertError> {
        let note = || {
            let are_on_disk: io::Result<Vec<bool>> = spools.iter().map(|spool| spool.sync()).collect();
            if are_on_disk?.iter().all(|&is_on_disk| is_on_disk) {
                records().iter().try_for_each(|record| self.journal.append(&encode(record)))?;
                self.journal.sync()?;
                self.useful = true;
            }
            Ok(())
        };
        note().map_err(ConvertError::Scratch)
    }
}

fn encode(record: &Record) -> Vec<u8> {
    bincode::serde::encode_to_vec(record, bincode::config::standard()).expect("records are plain data")
}

fn decode(bytes: &[u8]) -> Option<Record> {
    let (record, used) = bincode::serde::decode_from_slice(bytes, bincode::config::standard()).ok()?;
    (used == bytes.len()).then_some(record)
}

fn open_folder(path: &Path, identity: &str) -> Result<(ScratchDir, Begun), ConvertError> {
    ScratchDir::open(path, identity.as_bytes()).map_err(|source| {
        let path = path.to_owned();
        match source.kind() {
            io::ErrorKind::WouldBlock => ConvertError::Busy { path },
            _ => ConvertError::Folder { path, source },
        }
    })
}

/// Folder of the unfinished pack.
fn folder_of(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".partial");
    name.into()
}

/// Folder of the scratch files in `place`: outputs of the same name elsewhere have others.
fn scratch_folder(place: &Path, output: &Path) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    std::path::absolute(output).unwrap_or(output.to_owned()).hash(&mut hasher);
    place.join(format!("raystrips-{:016x}.partial", hasher.finish()))
}

/// Bytes in the folder of the unfinished pack `output`, and of its scratch files in `place`.
pub(crate) fn used_bytes(output: &Path, place: &Path) -> (u64, u64) {
    (disk::used_bytes(&folder_of(output)), disk::used_bytes(&scratch_folder(place, output)))
}

/// Says what the conversion does. Whatever of this changes, what was done before is of no use. Threads and memory are
/// not in it: they change nothing.
fn identity(inputs: &[PathBuf], params: &ConvertParams) -> String {
    let ConvertParams { page_size, layout, strips, positions, keep_ids, proxies, import, .. } = params;
    let mut text = format!(
        "raystrips {}, format {}\n{page_size} {layout:?} {strips:?} {positions:?} {keep_ids} {proxies:?} {} {:?} {} {}\n",
        env!("CARGO_PKG_VERSION"),
        raystrips_pack::layout::FORMAT_VERSION,
        import.drop_out_of_range,
        import.strand_width,
        import.bare,
        import.instances,
    );
    for path in inputs {
        text += &format!("{:?}\n", FileStamp::of(path));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_changes_the_pack_is_in_the_identity() {
        let inputs = [PathBuf::from("a.ply")];
        let params = ConvertParams::default();
        let of = |params: &ConvertParams| identity(&inputs, params);
        let same = ConvertParams { memory: Some(1), restart: true, ..params.clone() };
        assert_eq!(of(&params), of(&same));
        let other = ConvertParams { keep_ids: true, ..params.clone() };
        assert_ne!(of(&params), of(&other));
        assert_ne!(of(&params), identity(&[PathBuf::from("b.ply")], &params));
    }
}
