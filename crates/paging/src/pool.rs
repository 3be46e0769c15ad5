//! Pages of a pack that does not fit in memory: as many as a budget allows, those used last.
//!
//! Whoever looks at pages does so in a *visit*. What it has seen stays in memory until the visit ends, so that pages can
//! be used without asking again; until then their bytes count. There is no lock for all pages: each has its own, which
//! is held for as long as it takes to copy a pointer.

use crate::OpenError;
use crate::page::Page;
use crate::parents::Parents;
use crate::visit::Visit;
use raystrips_extmem::{BlockBuffer, BlockFile, MemoryBudget, Reservation, spare_memory};
use raystrips_pack::{Pack, PackError, PageEntry, PageId, PageView, check_checksum, check_page};
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What the allocator takes beside a page, at most.
const OVERHEAD_BYTES: u64 = 4096;

/// The pages of one pack, of which some are in memory.
pub struct PagePool {
    pack: Pack,
    path: PathBuf,
    file: BlockFile,
    slots: Vec<Slot>,
    parents: Parents,
    /// The next page that may have to go (the hand of CLOCK; Corbató 1968).
    hand: Mutex<usize>,
    budget: MemoryBudget,
    most_bytes: u64,
    blank: Page,
    counters: Counters,
}

/// Where a page is when it is in memory.
#[derive(Default)]
struct Slot {
    page: Mutex<Option<Arc<Page>>>,
    /// Used since the hand came by.
    is_used: AtomicBool,
    /// It came before, and all of it was checked: the checksum tells if these are the same bytes.
    was_good: AtomicBool,
}

#[derive(Default)]
struct Counters {
    read: AtomicU64,
    bytes_read: AtomicU64,
    hits: AtomicU64,
    evicted: AtomicU64,
}

/// What a pool has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoolCounts {
    /// Pages read.
    pub read: u64,
    /// Their bytes.
    pub bytes_read: u64,
    /// Pages that a visit found in memory.
    pub hits: u64,
    /// Pages that had to go.
    pub evicted: u64,
}

impl PagePool {
    /// Opens the pack at `path`, with none of its pages; `bytes` are for pages.
    pub fn open(path: &Path, bytes: u64) -> Result<PagePool, OpenError> {
        let open = || {
            let mut file = File::open(path)?;
            let pack = Pack::open(&mut file)?;
            let is_large = spare_memory().is_some_and(|spare| pack.file_bytes > spare);
            Ok(PagePool {
                slots: pack.directory.iter().map(|_| Slot::default()).collect(),
                parents: Parents::of(&pack),
                path: path.to_owned(),
                file: BlockFile::open(path, is_large)?,
                hand: Mutex::new(0),
                budget: MemoryBudget::new(bytes),
                most_bytes: bytes,
                blank: Page::blank(),
                counters: Counters::default(),
                pack,
            })
        };
        open().map_err(|source| OpenError { path: path.to_owned(), source })
    }

    /// The resident part of the pack.
    pub fn pack(&self) -> &Pack {
        &self.pack
    }

    /// The node above the child with this link, the way back up for rays that were set aside.
    #[inline]
    pub fn parent(&self, link: u32) -> u32 {
        self.parents.get(link)
    }

    /// Bytes of memory that it takes apart from pages, at about.
    pub fn resident_bytes(pack: &Pack) -> u64 {
        pack.resident_bytes() + Parents::bytes(pack) + (pack.directory.len() * size_of::<Slot>()) as u64
    }

    /// Pages of the mean size that fit in memory.
    pub fn capacity(&self) -> usize {
        let directory = &self.pack.directory;
        let bytes: u64 = directory.iter().map(|page| u64::from(page.bytes) + OVERHEAD_BYTES).sum();
        let mean = bytes / (directory.len() as u64).max(1);
        (self.most_bytes / mean.max(1)) as usize
    }

    /// What it has done so far.
    pub fn counts(&self) -> PoolCounts {
        let get = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let Counters { read, bytes_read, hits, evicted } = &self.counters;
        PoolCounts { read: get(read), bytes_read: get(bytes_read), hits: get(hits), evicted: get(evicted) }
    }

    /// Begins to look at pages.
    pub fn visit(&self) -> Visit<'_> {
        Visit::new(self)
    }

    /// A page without anything in it.
    pub(crate) fn blank(&self) -> PageView<'_> {
        self.blank.view()
    }

    /// Page `id` if it is in memory.
    pub(crate) fn get(&self, id: PageId) -> Option<Arc<Page>> {
        let page = self.slot(id).clone()?;
        self.slots[id as usize].is_used.store(true, Ordering::Relaxed);
        self.counters.hits.fetch_add(1, Ordering::Relaxed);
        Some(page)
    }

    /// Reads those of `pages` that are not there, in one go, and checks them. Pages that were not used for long go. False,
    /// and nothing done, where visits hold all memory: it is there when they end. `buffer` is for what is read.
    ///
    /// # Errors
    /// If a page cannot be read or is damaged.
    pub fn load(&self, pages: Range<PageId>, buffer: &mut BlockBuffer) -> Result<bool, OpenError> {
        let absent: Vec<PageId> = pages.filter(|&id| self.slot(id).is_none()).collect();
        let (Some(&first), Some(&last)) = (absent.first(), absent.last()) else { return Ok(true) };
        let memory: Option<Vec<Reservation>> =
            absent.iter().map(|&id| self.take(u64::from(self.entry(id).bytes) + OVERHEAD_BYTES)).collect();
        let Some(memory) = memory else { return Ok(false) };
        let error = |source| OpenError { path: self.path.clone(), source };
        let begin = self.entry(first).offset;
        let end = self.entry(last).offset + u64::from(self.entry(last).bytes);
        let bytes = self.file.read(begin..end, buffer).map_err(|e| error(e.into()))?;
        for (id, memory) in absent.into_iter().zip(memory) {
            let entry = self.entry(id);
            let bytes = &bytes[(entry.offset - begin) as usize..][..entry.bytes as usize];
            self.check(bytes, id).map_err(error)?;
            self.slots[id as usize].is_used.store(true, Ordering::Relaxed);
            *self.slot(id) = Some(Arc::new(Page::new(bytes, memory)));
            self.counters.read.fetch_add(1, Ordering::Relaxed);
            self.counters.bytes_read.fetch_add(u64::from(entry.bytes), Ordering::Relaxed);
        }
        Ok(true)
    }

    /// Checks the bytes of a page; all of it when it comes for the first time.
    fn check(&self, bytes: &[u8], id: PageId) -> Result<(), PackError> {
        let entry = self.entry(id);
        let was_good = &self.slots[id as usize].was_good;
        if was_good.load(Ordering::Relaxed) {
            return check_checksum(bytes, id, entry);
        }
        let manifest = &self.pack.manifest;
        check_page(bytes, id, entry, manifest.scene.geometries.len(), manifest.depth as usize)?;
        was_good.store(true, Ordering::Relaxed);
        Ok(())
    }

    /// Takes `bytes` of the memory of the pool, for a page or for something else; pages go for that. `None` where visits
    /// hold too many.
    pub fn take(&self, bytes: u64) -> Option<Reservation> {
        let mut hand = self.hand.lock().unwrap_or_else(PoisonError::into_inner);
        // In two rounds every page is asked once without having been used.
        for _ in 0..2 * self.slots.len() + 1 {
            if let Some(memory) = self.budget.take(bytes) {
                return Some(memory);
            }
            *hand = (*hand + 1) % self.slots.len();
            let slot = &self.slots[*hand];
            if !slot.is_used.swap(false, Ordering::Relaxed) && self.slot(*hand as PageId).take().is_some() {
                self.counters.evicted.fetch_add(1, Ordering::Relaxed);
            }
        }
        None
    }

    fn entry(&self, id: PageId) -> &PageEntry {
        &self.pack.directory[id as usize]
    }

    fn slot(&self, id: PageId) -> MutexGuard<'_, Option<Arc<Page>>> {
        self.slots[id as usize].page.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
