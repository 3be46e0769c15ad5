//! Runs of neighboring pages, which are read together.

use raystrips_pack::{PageEntry, PageId};

/// The pages of a pack, cut into runs of neighbors in the file.
///
/// Memory: 8 bytes a page.
#[derive(Debug)]
pub struct Runs {
    /// Pages as they lie in the file.
    order: Vec<PageId>,
    /// The place of each page in `order`.
    places: Vec<u32>,
    /// Where each run begins in `order`, and at the end the number of pages.
    starts: Vec<u32>,
}

impl Runs {
    /// Runs of at most `bytes`, or of one page if that is larger.
    pub fn new(directory: &[PageEntry], bytes: u64) -> Runs {
        let entry = |id: PageId| &directory[id as usize];
        let mut order: Vec<PageId> = (0..directory.len() as PageId).collect();
        order.sort_unstable_by_key(|&id| entry(id).offset);
        let mut places = vec![0; order.len()];
        let mut starts = Vec::new();
        let mut begin = 0;
        for (place, &id) in (0..).zip(&order) {
            places[id as usize] = place;
            let end = entry(id).offset + u64::from(entry(id).bytes);
            if place == 0 || end - begin > bytes {
                starts.push(place);
                begin = entry(id).offset;
            }
        }
        starts.push(order.len() as u32);
        Runs { order, places, starts }
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
        let place = self.places[page as usize];
        (self.starts.partition_point(|&start| start <= place) - 1) as u32
    }

    /// The pages of a run, as they lie in the file.
    pub fn pages(&self, run: u32) -> &[PageId] {
        let run = run as usize;
        &self.order[self.starts[run] as usize..self.starts[run + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn every_page_is_in_one_run() {
        let page = |offset, bytes| PageEntry { offset, bytes, ..Zeroable::zeroed() };
        let directory = [page(256, 10), page(0, 100), page(128, 72), page(300, 500), page(800, 1)];
        let runs = Runs::new(&directory, 200);
        let pages: Vec<_> = (0..runs.len() as u32).map(|run| runs.pages(run).to_vec()).collect();
        assert_eq!(pages, [vec![1, 2], vec![0], vec![3], vec![4]]);
        for (run, pages) in pages.into_iter().enumerate() {
            assert!(pages.into_iter().all(|page| runs.of(page) == run as u32));
        }
        assert!(Runs::new(&[], 1).is_empty());
    }
}
