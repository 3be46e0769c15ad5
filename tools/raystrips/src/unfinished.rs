//! Pictures that are not finished, beside where they will be: so that an interrupted run can be gone on with.

use crate::files::write_through;
use crate::interrupt;
use anyhow::{Context, Result, anyhow};
use raystrips_pack::Pack;
use raystrips_render::{RenderError, RenderOutput, RenderParams, RenderProgress, Unfinished, Watch};
use std::ffi::OsString;
use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How the work of a picture is numbered: only what is numbered alike can be gone on with.
#[derive(Clone, Copy, Debug, Hash)]
pub enum Numbering {
    Tiles,
    Batches,
}

/// Where what is done is kept, and how often it is written.
pub struct Keeping<'a> {
    file: PathBuf,
    every: Duration,
    /// What is in the file is of this picture.
    is_kept: AtomicBool,
    progress: &'a (dyn Fn(RenderProgress) + Sync),
}

impl<'a> Keeping<'a> {
    /// For the picture `output`. `progress` is told how far it has come. With `restart` what is there is not gone on with.
    pub fn new(
        output: &Path,
        every: Duration,
        restart: bool,
        progress: &'a (dyn Fn(RenderProgress) + Sync),
    ) -> Result<Keeping<'a>> {
        let mut name = OsString::from(output);
        name.push(".unfinished");
        let keeping = Keeping { file: name.into(), every, is_kept: AtomicBool::new(false), progress };
        if restart {
            keeping.remove()?;
        }
        Ok(keeping)
    }

    /// Renders with `part`, which stops when it is told to, until the picture is finished.
    pub fn to_the_end(
        &self,
        params: &RenderParams,
        (pack, numbering): (&Pack, Numbering),
        part: impl Fn(Unfinished, &Watch) -> Result<Unfinished, RenderError>,
    ) -> Result<RenderOutput> {
        let key = key(params, pack, numbering);
        let mut unfinished = self.read(params, key)?.unwrap_or_else(|| Unfinished::new(params));
        loop {
            let begin = Instant::now();
            let is_due = || interrupt::happened() || begin.elapsed() >= self.every;
            let watch = Watch { is_due: &is_due, progress: self.progress };
            unfinished = part(unfinished, &watch).map_err(|error| self.with_what_is_kept(error))?;
            if unfinished.is_finished() {
                return Ok(unfinished.into_output());
            }
            write_through(&self.file, |out| unfinished.write(key, &mut { out }))?;
            self.is_kept.store(true, Ordering::Relaxed);
            if interrupt::happened() {
                eprintln!("raystrips: {}: the same command goes on from here", self.file.display());
                interrupt::exit();
            }
        }
    }

    /// Removes what is kept, once the picture is there.
    pub fn remove(&self) -> Result<()> {
        match std::fs::remove_file(&self.file) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(error).with_context(|| self.file.display().to_string())
            }
            _ => Ok(()),
        }
    }

    fn read(&self, params: &RenderParams, key: u64) -> Result<Option<Unfinished>> {
        let file = match File::open(&self.file) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            file => file,
        };
        let read = file.and_then(|file| Unfinished::read(params, key, &mut BufReader::new(file)));
        let unfinished = read.with_context(|| self.file.display().to_string())?;
        self.is_kept.store(unfinished.is_some(), Ordering::Relaxed);
        let file = self.file.display();
        match unfinished {
            Some(_) => eprintln!("raystrips: going on from {file}"),
            None => eprintln!(
                "raystrips: {file} is of another picture, another pack or another order; beginning anew"
            ),
        }
        Ok(unfinished)
    }

    /// Says where what was done is, if it was kept before the error.
    fn with_what_is_kept(&self, error: RenderError) -> anyhow::Error {
        let error = anyhow::Error::from(error);
        match self.is_kept.load(Ordering::Relaxed) {
            true => anyhow!(
                "{error}; what was done is in {}, and the same command goes on from there",
                self.file.display()
            ),
            false => error,
        }
    }
}

/// Tells pictures apart that are not the same.
fn key(params: &RenderParams, pack: &Pack, numbering: Numbering) -> u64 {
    let mut hasher = DefaultHasher::new();
    // Threads change nothing.
    format!("{:?}", RenderParams { threads: 0, ..params.clone() }).hash(&mut hasher);
    numbering.hash(&mut hasher);
    env!("CARGO_PKG_VERSION").hash(&mut hasher);
    pack.file_bytes.hash(&mut hasher);
    pack.directory.iter().for_each(|page| page.checksum.hash(&mut hasher));
    // Materials, lights and cameras.
    format!("{:?}", pack.manifest).hash(&mut hasher);
    hasher.finish()
}
