//! Runs of neighboring pages, which are read together.

use raystrips_pack::{PageEntry, PageId};
use std::ops::Range;

/// The pages of a pack, cut into runs of neighbors in the file.
#[derive(Debug)]
pub struct Runs {
    /// The first page of each, and at the end the number of pages.
    starts: Vec<PageId>,
}

impl Runs {
    /// Runs of at most `bytes`, or of one page if that is larger.
    pub fn new(directory: &[PageEntry], bytes: u64) -> Runs {
        let mut starts = vec![0];
        let mut begin = directory.first().map_or(0, |page| page.offset);
        for (id, page) in directory.iter().enumerate().skip(1) {
            if page.offset + u64::from(page.bytes) - begin > bytes {
                starts.push(id as PageId);
                begin = page.offset;
            }
        }
        if !directory.is_empty() {
            starts.push(directory.len() as PageId);
        }
        Runs { starts }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The run that a page is in.
    pub fn of(&self, page: PageId) -> u32 {
        (self.starts.partition_point(|&start| start <= page) - 1) as u32
    }

    /// The pages of a run.
    pub fn pages(&self, run: u32) -> Range<PageId> {
        self.starts[run as usize]..self.starts[run as usize + 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn every_page_is_in_one_run() {
        let page = |offset, bytes| PageEntry { offset, bytes, ..Zeroable::zeroed() };
        let directory = [page(0, 100), page(128, 72), page(256, 10), page(300, 500), page(800, 1)];
        let runs = Runs::new(&directory, 200);
        let pages: Vec<_> = (0..runs.len() as u32).map(|run| runs.pages(run)).collect();
        assert_eq!(pages, [0..2, 2..3, 3..4, 4..5]);
        for (run, pages) in pages.into_iter().enumerate() {
            assert!(pages.into_iter().all(|page| runs.of(page) == run as u32));
        }
        assert!(Runs::new(&[], 1).is_empty());
    }
}
