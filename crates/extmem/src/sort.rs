//! Sorting more than fits: sorted runs go to a file and are merged.

use crate::disk::read_exact_at;
use bytemuck::Pod;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Most runs merged at a time: with more, the pieces read of each get too small for a disk with seeks.
const MAX_RUNS: usize = 64;

/// Takes items in any order and gives them back sorted. Equal items are indistinguishable, so the result does not
/// depend on the memory.
#[derive(Debug)]
pub struct ExternalSort<T> {
    folder: PathBuf,
    /// Most items in memory.
    capacity: usize,
    items: Vec<T>,
    runs: Option<Runs>,
}

/// Sorted runs, one after the other in an unnamed file.
#[derive(Debug)]
struct Runs {
    file: File,
    length: u64,
    /// Where each run ends.
    ends: Vec<u64>,
}

impl<T: Pod + Ord + Send> ExternalSort<T> {
    /// Sorts in `memory_bytes`, with a file in `folder` for what does not fit.
    pub fn new(folder: &Path, memory_bytes: usize) -> ExternalSort<T> {
        let capacity = (memory_bytes / size_of::<T>()).max(2 * MAX_RUNS);
        ExternalSort { folder: folder.to_owned(), capacity, items: Vec::new(), runs: None }
    }

    /// Adds an item.
    pub fn push(&mut self, item: T) -> io::Result<()> {
        if self.items.len() == self.capacity {
            self.spill()?;
        }
        self.items.push(item);
        Ok(())
    }

    /// Writes what is in memory as a run.
    fn spill(&mut self) -> io::Result<()> {
        self.items.par_sort_unstable();
        let runs = match &mut self.runs {
            Some(runs) => runs,
            none => none.insert(Runs::new(&self.folder)?),
        };
        runs.write(&self.items)?;
        runs.end();
        self.items.clear();
        Ok(())
    }

    /// Calls `f` with every item, the least first.
    pub fn finish(mut self, mut f: impl FnMut(T)) -> io::Result<()> {
        if self.runs.is_none() {
            self.items.par_sort_unstable();
            self.items.into_iter().for_each(f);
            return Ok(());
        }
        self.spill()?;
        drop(std::mem::take(&mut self.items));
        let mut runs = self.runs.take().expect("there are runs");
        while runs.ends.len() > MAX_RUNS {
            runs = merge_groups::<T>(&runs, &self.folder, self.capacity)?;
        }
        let all = 0..runs.ends.len();
        runs.merge(all, self.capacity, |item: T| {
            f(item);
            Ok(())
        })
    }
}

/// Runs merged in groups, to fewer.
fn merge_groups<T: Pod + Ord>(runs: &Runs, folder: &Path, capacity: usize) -> io::Result<Runs> {
    let mut merged = Runs::new(folder)?;
    let count = runs.ends.len();
    for first in (0..count).step_by(MAX_RUNS) {
        // Half of the memory is for what is read, half for what is written.
        let mut buffer: Vec<T> = Vec::with_capacity(capacity / 2);
        runs.merge(first..(first + MAX_RUNS).min(count), capacity / 2, |item| {
            if buffer.len() == capacity / 2 {
                merged.write(&buffer)?;
                buffer.clear();
            }
            buffer.push(item);
            Ok(())
        })?;
        merged.write(&buffer)?;
        merged.end();
    }
    Ok(merged)
}

impl Runs {
    fn new(folder: &Path) -> io::Result<Runs> {
        Ok(Runs { file: tempfile::tempfile_in(folder)?, length: 0, ends: Vec::new() })
    }

    /// Adds to the present run.
    fn write<T: Pod>(&mut self, items: &[T]) -> io::Result<()> {
        self.file.write_all(bytemuck::cast_slice(items))?;
        self.length += size_of_val(items) as u64;
        Ok(())
    }

    /// Ends the present run.
    fn end(&mut self) {
        self.ends.push(self.length);
    }

    /// Calls `f` with the items of the runs `range`, the least first, holding `capacity` items.
    fn merge<T: Pod + Ord>(
        &self,
        range: Range<usize>,
        capacity: usize,
        mut f: impl FnMut(T) -> io::Result<()>,
    ) -> io::Result<()> {
        let capacity = capacity / range.len();
        let mut cursors: Vec<Cursor<T>> = range
            .map(|run| {
                let begin = if run == 0 { 0 } else { self.ends[run - 1] };
                Cursor { file: &self.file, left: begin..self.ends[run], capacity, items: Vec::new(), next: 0 }
            })
            .collect();
        let mut heads = BinaryHeap::with_capacity(cursors.len());
        for (i, cursor) in cursors.iter_mut().enumerate() {
            heads.extend(cursor.next()?.map(|item| Reverse((item, i))));
        }
        while let Some(Reverse((item, i))) = heads.pop() {
            f(item)?;
            heads.extend(cursors[i].next()?.map(|item| Reverse((item, i))));
        }
        Ok(())
    }
}

/// Reads a run.
struct Cursor<'a, T> {
    file: &'a File,
    /// Bytes not read yet.
    left: Range<u64>,
    capacity: usize,
    items: Vec<T>,
    next: usize,
}

impl<T: Pod> Cursor<'_, T> {
    fn next(&mut self) -> io::Result<Option<T>> {
        if self.next == self.items.len() {
            let bytes = (self.left.end - self.left.start).min((self.capacity * size_of::<T>()) as u64);
            self.items.resize(bytes as usize / size_of::<T>(), T::zeroed());
            read_exact_at(self.file, bytemuck::cast_slice_mut(&mut self.items), self.left.start)?;
            self.left.start += bytes;
            self.next = 0;
        }
        self.next += 1;
        Ok(self.items.get(self.next - 1).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sorted(items: &[[u32; 3]], memory_bytes: usize) -> Vec<[u32; 3]> {
        let folder = tempfile::tempdir().unwrap();
        let mut sort = ExternalSort::new(folder.path(), memory_bytes);
        items.iter().for_each(|&item| sort.push(item).unwrap());
        let mut sorted = Vec::new();
        sort.finish(|item| sorted.push(item)).unwrap();
        sorted
    }

    proptest! {
        #[test]
        fn sorts_whatever_the_memory(mut items in prop::collection::vec(prop::array::uniform3(0u32..50), 0..2000)) {
            let [little, enough] = [1, 1 << 20].map(|bytes| sorted(&items, bytes));
            items.sort_unstable();
            prop_assert_eq!(&little, &items);
            prop_assert_eq!(&enough, &items);
        }
    }

    #[test]
    fn more_runs_than_are_merged_at_a_time() {
        let mut items: Vec<[u32; 3]> =
            (0..40_000u32).map(|i| [i.wrapping_mul(2_654_435_761), i, 0]).collect();
        let found = sorted(&items, 1);
        items.sort_unstable();
        assert_eq!(found, items);
    }
}
