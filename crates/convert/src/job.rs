//! What is on disk while a conversion runs, and what the next run of the same conversion finds there.
//!
//! Beside the output OUT.rsp there is a folder OUT.rsp.partial with the unfinished pack, its sidecars and a journal.
//! Scratch files are there too, or in a folder under [`ConvertParams::scratch`]. Each record of the journal says that
//! something is whole: the import, the gathered pieces, a piece in the pack. What the first two speak of was brought to
//! the disk before; pieces in the pack have checksums.

use crate::distribute::{PieceSource, Pieces};
use crate::flat_tree::FlatTree;
use crate::import::Imported;
use crate::output::PieceRecord;
use crate::stamp::FileStamp;
use crate::{ConvertError, ConvertParams};
use raystrips_extmem::{Begun, Journal, MemoryBudget, ScratchDir, Spool};
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};

const JOURNAL: &str = "journal";
const IMPORTED: &str = "imported";
const GATHERED: &str = "gathered";

/// What a record says.
#[derive(Serialize, Deserialize)]
enum Record {
    /// The files that were read: what follows is of no use when one has changed.
    Files(Vec<FileStamp>),
    Imported(Imported),
    Gathered(Gathered),
    Piece(PieceRecord),
}

/// Pieces that are gathered on disk.
#[derive(Serialize, Deserialize)]
struct Gathered {
    tree: FlatTree,
    sources: Vec<PieceSource>,
    spool_bytes: u64,
    degenerate: u64,
    position_error: f64,
}

/// What an earlier run has done.
#[derive(Default)]
pub(crate) struct Found {
    files: Vec<FileStamp>,
    /// The import but for its triangles.
    pub imported: Option<Imported>,
    gathered: Option<Gathered>,
    /// Pieces that were in the pack.
    pub pieces: Vec<PieceRecord>,
}

impl Found {
    fn recall(&mut self, record: Record) {
        match record {
            Record::Files(files) => self.files = files,
            Record::Imported(imported) => self.imported = Some(imported),
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
        let scratch =
            params.scratch.as_ref().map(|place| open_folder(&scratch_folder(place, output), &identity));
        let (scratch, begun_there) = scratch.transpose()?.unzip();
        let is_new = begun == Begun::New || begun_there == Some(Begun::New) || params.restart;
        let prepare = || {
            if is_new {
                folder.clear()?;
                scratch.as_ref().map_or(Ok(()), ScratchDir::clear)?;
            }
            Journal::open(&folder.file(JOURNAL))
        };
        let (journal, records) = prepare().map_err(ConvertError::Scratch)?;
        let mut found = Found::default();
        // A record that cannot be read is as good as none.
        records.iter().map_while(|bytes| decode(bytes)).for_each(|record| found.recall(record));
        let mut job = Job { folder, scratch, journal, useful: !records.is_empty() };
        if !found.files.iter().all(FileStamp::is_current) {
            job.forget()?;
            found = Found::default();
        }
        Ok((job, found))
    }

    /// Forgets all that was noted.
    fn forget(&mut self) -> Result<(), ConvertError> {
        self.useful = false;
        self.journal.clear().and_then(|()| self.journal.sync()).map_err(ConvertError::Scratch)
    }

    /// Decides that the files stay for the next run if there is any use in them; tells whether.
    pub fn keep_if_useful(&mut self) -> bool {
        self.folder.keep(self.useful);
        if let Some(scratch) = &mut self.scratch {
            scratch.keep(self.useful);
        }
        self.useful
    }

    /// A file of the unfinished pack.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.file(name)
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

    /// Notes a finished import, if it is on disk; in any case which files it has read.
    pub fn note_import(&mut self, imported: &Imported, spool: &Spool) -> Result<(), ConvertError> {
        self.note_files(imported)?;
        self.note_synced(spool, || Record::Imported(imported.clone()))
    }

    /// Notes that there is no import any more.
    pub fn forget_import(&mut self, imported: &Imported) -> Result<(), ConvertError> {
        self.forget()?;
        self.note_files(imported)
    }

    fn note_files(&mut self, imported: &Imported) -> Result<(), ConvertError> {
        let record = Record::Files(imported.files.iter().map(|path| FileStamp::of(path)).collect());
        self.journal.append(&encode(&record)).map_err(ConvertError::Scratch)
    }

    /// An empty spool for gathering pieces.
    pub fn gather_spool(&self, budget: Option<&MemoryBudget>) -> Spool {
        Spool::new(&self.scratch_path().join(GATHERED), budget)
    }

    /// The pieces that are gathered, if they are.
    pub fn gathered(&self, found: &mut Found) -> Option<Pieces> {
        let Gathered { tree, sources, spool_bytes, degenerate, position_error } = found.gathered.take()?;
        let spool = Spool::reopen(&self.scratch_path().join(GATHERED), spool_bytes).ok()?;
        let tree = tree.tree().filter(|tree| tree.leaves().len() == sources.len())?;
        Some(Pieces { tree, sources, spool, degenerate, position_error })
    }

    /// Notes gathered pieces, if they are on disk, and removes the import, which is not needed any more.
    pub fn note_gathered(&mut self, pieces: &Pieces) -> Result<(), ConvertError> {
        self.note_synced(&pieces.spool, || {
            Record::Gathered(Gathered {
                tree: FlatTree::of(&pieces.tree),
                sources: pieces.sources.clone(),
                spool_bytes: pieces.spool.length(),
                degenerate: pieces.degenerate,
                position_error: pieces.position_error,
            })
        })?;
        match std::fs::remove_file(self.scratch_path().join(IMPORTED)) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => Err(ConvertError::Scratch(e)),
            _ => Ok(()),
        }
    }

    /// Notes a piece in the pack.
    pub fn note_piece(&mut self, piece: PieceRecord) -> Result<(), ConvertError> {
        self.journal.append(&encode(&Record::Piece(piece))).map_err(ConvertError::Scratch)?;
        self.useful = true;
        Ok(())
    }

    fn note_synced(&mut self, spool: &Spool, record: impl FnOnce() -> Record) -> Result<(), ConvertError> {
        let note = || {
            if spool.sync()? {
                self.journal.append(&encode(&record()))?;
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

/// Bytes in the folders of the conversion to `output` with scratch files in `place`.
pub(crate) fn used_bytes(output: &Path, place: &Path) -> u64 {
    let folders = [folder_of(output), scratch_folder(place, output)];
    let files = folders.iter().flat_map(std::fs::read_dir).flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).map(|metadata| metadata.len()).sum()
}

/// Says what the conversion does. Whatever of this changes, what was done before is of no use. Threads and memory are
/// not in it: they change nothing.
fn identity(inputs: &[PathBuf], params: &ConvertParams) -> String {
    let ConvertParams { page_size, strips, positions, keep_ids, import, .. } = params;
    let mut text = format!(
        "raystrips {}, format {}\n{page_size} {strips:?} {positions:?} {keep_ids} {}\n",
        env!("CARGO_PKG_VERSION"),
        raystrips_pack::layout::FORMAT_VERSION,
        import.drop_out_of_range,
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
