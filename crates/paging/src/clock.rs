//! Which page goes next: one that was not used since the hand came by last (CLOCK; Corbató 1968).

use raystrips_pack::PageId;

/// The pages in memory, in a circle with a hand.
#[derive(Debug, Default)]
pub(crate) struct Clock {
    pages: Vec<PageId>,
    hand: usize,
}

impl Clock {
    /// A page has come.
    pub fn push(&mut self, page: PageId) {
        self.pages.push(page);
    }

    /// Takes out the next page for which `was_used` is false, if there is one. Every page is asked at most twice; after the
    /// first time it must say whether it was used since then.
    pub fn pop(&mut self, was_used: impl Fn(PageId) -> bool) -> Option<PageId> {
        for _ in 0..2 * self.pages.len() {
            if self.hand >= self.pages.len() {
                self.hand = 0;
            }
            if !was_used(self.pages[self.hand]) {
                return Some(self.pages.swap_remove(self.hand));
            }
            self.hand += 1;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::collections::BTreeSet;

    #[test]
    fn used_pages_get_another_round() {
        let mut clock = Clock::default();
        (0..4).for_each(|page| clock.push(page));
        let used = RefCell::new(BTreeSet::from([1, 2]));
        let was_used = |page| used.borrow_mut().remove(&page);
        let gone: Vec<_> = (0..4).map(|_| clock.pop(was_used).unwrap()).collect();
        assert_eq!(gone[..2].iter().collect::<BTreeSet<_>>(), BTreeSet::from([&0, &3]));
        assert_eq!(gone[2..].iter().collect::<BTreeSet<_>>(), BTreeSet::from([&1, &2]));
        assert_eq!(clock.pop(|_| false), None);
    }
}
