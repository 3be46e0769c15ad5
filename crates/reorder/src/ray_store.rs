//! Rays that wait to be sorted: in memory, and what has no room there in sorted runs in a file (Moon et al. 2010,
//! section 4.4).

use crate::radix_sort::{Keyed, radix_sort};
use bytemuck::Pod;
use raystrips_extmem::disk::read_exact_at;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Takes rays in any order and gives them back by their keys. `R` is a ray with its errand.
#[derive(Debug)]
pub struct RayStore<R> {
    folder: PathBuf,
    /// Most rays in memory.
    capacity: usize,
    /// By number of the record.
    keys: Vec<Keyed>,
    records: Vec<R>,
    runs: Runs,
    len: u64,
}

impl<R: Pod> RayStore<R> {
    /// Bytes that a ray takes in memory while it is sorted.
    pub const RAY_BYTES: usize = size_of::<R>() + 2 * size_of::<Keyed>();

    /// A store that takes `memory_bytes` at most, and a file in `folder` that is gone when the store is.
    pub fn new(folder: &Path, memory_bytes: usize) -> RayStore<R> {
        let capacity = (memory_bytes / Self::RAY_BYTES).clamp(1024, u32::MAX as usize);
        let (keys, records) = (Vec::new(), Vec::new());
        RayStore { folder: folder.to_owned(), capacity, keys, records, runs: Runs::default(), len: 0 }
    }

    /// Rays in it.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds rays with their keys.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn extend(&mut self, rays: impl Iterator<Item = (u64, R)>) -> io::Result<()> {
        for (key, record) in rays {
            if self.records.len() == self.capacity {
                self.spill()?;
            }
            if self.records.capacity() < self.capacity {
                // All at once: what is not used takes no memory, and growing would take it twice.
                self.keys.reserve_exact(self.capacity);
                self.records.reserve_exact(self.capacity);
            }
            self.keys.push((key, self.records.len() as u32));
            self.records.push(record);
            self.len += 1;
        }
        Ok(())
    }

    /// Writes what is in memory as a sorted run.
    fn spill(&mut self) -> io::Result<()> {
        radix_sort(&mut self.keys);
        let sorted = self.keys.iter().map(|&(key, i)| (key, self.records[i as usize]));
        self.runs.write(&self.folder, sorted)?;
        self.keys.clear();
        self.records.clear();
        Ok(())
    }

    /// All rays by their keys; the store is empty then, and can be filled again meanwhile, with other memory.
    ///
    /// # Errors
    /// If the file cannot be written or read.
    pub fn take_sorted(&mut self) -> io::Result<SortedRays<R>> {
        self.len = 0;
        if self.runs.ends.is_empty() {
            radix_sort(&mut self.keys);
            let (keys, records) = (std::mem::take(&mut self.keys), std::mem::take(&mut self.records));
            return Ok(SortedRays(Source::InMemory { keys, records, next: 0 }));
        }
        // The arrays stay: given back and taken anew, by one thread or another, they would leave holes in memory.
        self.spill()?;
        let runs = std::mem::take(&mut self.runs);
        let most = (self.capacity / 2 / runs.ends.len()).max(1);
        Ok(SortedRays(Source::InFile(runs.merge(most)?)))
    }
}

/// Rays by their keys.
#[derive(Debug)]
pub struct SortedRays<R>(Source<R>);

#[derive(Debug)]
enum Source<R> {
    InMemory {
        keys: Vec<Keyed>,
        records: Vec<R>,
        next: usize,
    },
    /// Merged from runs.
    InFile(Merge<R>),
}

impl<R: Pod> SortedRays<R> {
    /// Appends the next rays to `rays`, up to `most`; none are left when it appends none.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn next(&mut self, most: usize, rays: &mut Vec<R>) -> io::Result<()> {
        match &mut self.0 {
            Source::InMemory { keys, records, next } => {
                let end = keys.len().min(*next + most);
                rays.extend(keys[*next..end].iter().map(|&(_, i)| records[i as usize]));
                *next = end;
            }
            Source::InFile(merge) => {
                for _ in 0..most {
                    let Some(ray) = merge.next()? else { return Ok(()) };
                    rays.push(ray);
                }
            }
        }
        Ok(())
    }
}

/// Sorted runs of keys and records, one after the other in a file without a name.
#[derive(Debug, Default)]
struct Runs {
    file: Option<File>,
    length: u64,
    /// Where each run ends.
    ends: Vec<u64>,
}

impl Runs {
    fn write<R: Pod>(&mut self, folder: &Path, sorted: impl Iterator<Item = (u64, R)>) -> io::Result<()> {
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(tempfile::tempfile_in(folder)?),
        };
        let mut writer = BufWriter::with_capacity(1 << 18, file);
        for (key, record) in sorted {
            writer.write_all(bytemuck::bytes_of(&key))?;
            writer.write_all(bytemuck::bytes_of(&record))?;
            self.length += entry_bytes::<R>() as u64;
        }
        writer.flush()?;
        // What the system still has to write is memory of this process.
        writer.get_ref().sync_data()?;
        self.ends.push(self.length);
        Ok(())
    }

    /// Merges all runs, of each of which up to `most` rays are in memory.
    fn merge<R: Pod>(self, most: usize) -> io::Result<Merge<R>> {
        let file = Arc::new(self.file.expect("there are runs"));
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        let cursor = |(begin, &end)| Cursor {
            file: Arc::clone(&file),
            left: begin..end,
            most,
            bytes: Vec::new(),
            next: 0,
            record: std::marker::PhantomData,
        };
        let cursors = begins.zip(&self.ends).map(cursor).collect();
        let mut merge = Merge { cursors, heads: BinaryHeap::new() };
        (0..merge.cursors.len()).try_for_each(|run| merge.advance(run))?;
        Ok(merge)
    }
}

fn entry_bytes<R>() -> usize {
    size_of::<u64>() + size_of::<R>()
}

/// Runs that are merged.
#[derive(Debug)]
struct Merge<R> {
    cursors: Vec<Cursor<R>>,
    /// The next key of each run that has one.
    heads: BinaryHeap<Reverse<(u64, usize)>>,
}

impl<R: Pod> Merge<R> {
    fn next(&mut self) -> io::Result<Option<R>> {
        let Some(Reverse((_, run))) = self.heads.pop() else { return Ok(None) };
        let record = self.cursors[run].take();
        self.advance(run)?;
        Ok(Some(record))
    }

    /// Puts the next key of a run among the heads.
    fn advance(&mut self, run: usize) -> io::Result<()> {
        if let Some(key) = self.cursors[run].peek()? {
            self.heads.push(Reverse((key, run)));
        }
        Ok(())
    }
}

/// Reads a run.
#[derive(Debug)]
struct Cursor<R> {
    file: Arc<File>,
    /// Bytes not read yet.
    left: std::ops::Range<u64>,
    /// Most rays read at a time.
    most: usize,
    bytes: Vec<u8>,
    next: usize,
    record: std::marker::PhantomData<R>,
}

impl<R: Pod> Cursor<R> {
    /// The next key.
    fn peek(&mut self) -> io::Result<Option<u64>> {
        if self.next == self.bytes.len() {
            let bytes = (self.left.end - self.left.start).min((self.most * entry_bytes::<R>()) as u64);
            self.bytes.resize(bytes as usize, 0);
            read_exact_at(&self.file, &mut self.bytes, self.left.start)?;
            self.left.start += bytes;
            self.next = 0;
        }
        let key = self.bytes.get(self.next..self.next + size_of::<u64>());
        Ok(key.map(bytemuck::pod_read_unaligned))
    }

    /// The next record, whose key was peeked at.
    fn take(&mut self) -> R {
        let begin = self.next + size_of::<u64>();
        self.next += entry_bytes::<R>();
        bytemuck::pod_read_unaligned(&self.bytes[begin..self.next])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_come_back_by_their_keys_from_memory_and_from_a_file() {
        let folder = tempfile::tempdir().unwrap();
        for memory in [0, 1 << 20] {
            let mut store = RayStore::<[u32; 3]>::new(folder.path(), memory);
            for round in 0..2u32 {
                let ray = |i: u32| (u64::from(i.wrapping_mul(2_654_435_761)), [i, round, 0]);
                store.extend((0..5000).map(ray)).unwrap();
                assert_eq!(store.len(), 5000);
                let mut sorted = store.take_sorted().unwrap();
                assert!(store.is_empty() && matches!(sorted.0, Source::InMemory { .. }) == (memory > 0));
                let mut rays = Vec::new();
                while {
                    let before = rays.len();
                    sorted.next(700, &mut rays).unwrap();
                    rays.len() > before
                } {}
                let mut expected: Vec<_> = (0..5000).map(ray).collect();
                expected.sort();
                assert_eq!(rays, expected.into_iter().map(|(_, ray)| ray).collect::<Vec<_>>());
            }
        }
    }
}
