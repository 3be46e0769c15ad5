//! The folder of a job: what it needs on disk while it runs, and what the next run of the same job goes on from.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Tells a folder of ours from one that somebody keeps things in.
const MAGIC: &[u8] = b"raystrips job\n";
const JOB: &str = "job";

/// How a folder was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begun {
    /// Nothing was there, or things of another job, which are gone now.
    New,
    /// The same job was here before and was not finished.
    Again,
}

/// A folder that one process has for itself; removed when dropped, unless it is kept.
#[derive(Debug)]
pub struct ScratchDir {
    path: PathBuf,
    kept: bool,
    /// Holds the lock.
    _job: File,
}

impl ScratchDir {
    /// Makes the folder `path`, or takes over the one of an earlier run. What that left behind stays if it was the
    /// same job, else it is removed.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if another process has it; [`io::ErrorKind::AlreadyExists`] if it is something
    /// else than a folder of a job.
    pub fn open(path: &Path, job: &[u8]) -> io::Result<(ScratchDir, Begun)> {
        let is_new = match fs::create_dir(path) {
            Ok(()) => true,
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => path.is_dir() && is_empty(path)?,
            Err(e) => return Err(e),
        };
        let mut options = OpenOptions::new();
        let mut file =
            match options.read(true).write(true).create(is_new).truncate(false).open(path.join(JOB)) {
                Ok(file) => file,
                Err(e) if is_new => return Err(e),
                Err(_) => return Err(somebody_elses()),
            };
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(io::ErrorKind::WouldBlock.into()),
            Err(TryLockError::Error(e)) => return Err(e),
        }
        let mut found = Vec::new();
        file.read_to_end(&mut found)?;
        let begun = if found == [MAGIC, job].concat() {
            Begun::Again
        } else if is_new || MAGIC.starts_with(&found[..found.len().min(MAGIC.len())]) {
            clear(path)?;
            file.set_len(0)?;
            io::Seek::rewind(&mut file)?;
            file.write_all(&[MAGIC, job].concat())?;
            Begun::New
        } else {
            return Err(somebody_elses());
        };
        Ok((ScratchDir { path: path.to_owned(), kept: false, _job: file }, begun))
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Says whether the folder stays for a later run.
    pub fn keep(&mut self, kept: bool) {
        self.kept = kept;
    }

    /// Removes everything in it, as if it were new.
    pub fn clear(&self) -> io::Result<()> {
        clear(&self.path)
    }
}

impl Drop for ScratchDir {
    fn drop(&mut self) {
        if !self.kept {
            // The file that names the job goes last, so that the next run knows what is left as ours if this is cut short.
            // Nobody is there to be told if it fails.
            _ = clear(&self.path)
                .and_then(|()| fs::remove_file(self.path.join(JOB)))
                .and_then(|()| fs::remove_dir(&self.path));
        }
    }
}

fn is_empty(path: &Path) -> io::Result<bool> {
    Ok(fs::read_dir(path)?.next().is_none())
}

fn somebody_elses() -> io::Error {
    io::Error::new(
        io::ErrorKind::AlreadyExists,
        "is there already and is no folder of an unfinished conversion; remove it or choose another output",
    )
}

/// Removes all files but the one that names the job.
fn clear(path: &Path) -> io::Result<()> {
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        if entry.file_name() != JOB {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_job_goes_on_and_another_begins_anew() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("job");
        let (mut dir, begun) = ScratchDir::open(&path, b"a").unwrap();
        assert_eq!(begun, Begun::New);
        assert_eq!(ScratchDir::open(&path, b"a").unwrap_err().kind(), io::ErrorKind::WouldBlock);
        fs::write(dir.file("x"), b"1").unwrap();
        dir.keep(true);
        drop(dir);
        let (mut dir, begun) = ScratchDir::open(&path, b"a").unwrap();
        assert_eq!((begun, fs::read(dir.file("x")).unwrap()), (Begun::Again, b"1".to_vec()));
        dir.keep(true);
        drop(dir);
        let (dir, begun) = ScratchDir::open(&path, b"b").unwrap();
        assert_eq!((begun, dir.file("x").exists()), (Begun::New, false));
        drop(dir);
        assert!(!path.exists());
    }

    #[test]
    fn a_folder_of_somebody_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("letter"), b"dear").unwrap();
        assert_eq!(ScratchDir::open(folder.path(), b"a").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        fs::write(folder.path().join(JOB), b"apply by Monday").unwrap();
        assert_eq!(ScratchDir::open(folder.path(), b"a").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(folder.path().join("letter")).unwrap(), b"dear");
    }
}
