//! Pages of a pack that does not fit in memory: as many as a budget allows, those used last.
//!
//! Whoever looks at pages does so in a *visit*. What it has seen stays in memory until the visit ends, so that pages can
//! be used without asking again; until then their bytes count. There is no lock for all pages: each has its own, which
//! is held for as long as it takes to copy a pointer.

use crate::OpenError;
use crate::parents::Parents;
use elsa::FrozenMap;
use raystrips_extmem::disk::{advise_random, read_exact_at};
use raystrips_extmem::{MemoryBudget, Reservation};
use raystrips_pack::layout::PageHeader;
use raystrips_pack::{Pack, PackError, PageId, PageView, WideNode, check_checksum, check_page};
use std::cell::Cell;
use std::fs::File;
use std::hash::{BuildHasherDefault, Hasher};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What the allocator takes beside a page, at most.
const OVERHEAD_BYTES: u64 = 4096;

/// The pages of one pack, of which some are in memory.
pub struct PagePool {
    pack: Pack,
    path: PathBuf,
    file: File,
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

/// A page in memory that was checked.
struct Page {
    /// Whole cache lines, for the alignment.
    lines: Vec<WideNode>,
    len: usize,
    /// Its share of the budget.
    _memory: Option<Reservation>,
}

impl Page {
    fn view(&self) -> PageView<'_> {
        PageView::new(&bytemuck::cast_slice(&self.lines)[..self.len])
            .expect("pages are checked when they come")
    }
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
            advise_random(&file);
            Ok(PagePool {
                slots: pack.directory.iter().map(|_| Slot::default()).collect(),
                parents: Parents::of(&pack),
                path: path.to_owned(),
                file,
                hand: Mutex::new(0),
                budget: MemoryBudget::new(bytes),
                most_bytes: bytes,
                blank: blank(),
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
        Visit { pool: self, seen: FrozenMap::default(), count: Cell::new(0) }
    }

    /// Reads page `id` and checks it, unless it is there. Pages that were not used for long go. False, and nothing done,
    /// where visits hold all memory: it is there when they end.
    ///
    /// # Errors
    /// If the page cannot be read or is damaged.
    pub fn load(&self, id: PageId) -> Result<bool, OpenError> {
        if self.slot(id).is_some() {
            return Ok(true);
        }
        let entry = &self.pack.directory[id as usize];
        let Some(memory) = self.make_room(u64::from(entry.bytes) + OVERHEAD_BYTES) else { return Ok(false) };
        let error = |source| OpenError { path: self.path.clone(), source };
        let len = entry.bytes as usize;
        let mut lines: Vec<WideNode> = bytemuck::zeroed_vec(len.div_ceil(size_of::<WideNode>()));
        let bytes = &mut bytemuck::cast_slice_mut(&mut lines)[..len];
        read_exact_at(&self.file, bytes, entry.offset).map_err(|e| error(e.into()))?;
        self.check(bytes, id).map_err(error)?;
        self.counters.read.fetch_add(1, Ordering::Relaxed);
        self.counters.bytes_read.fetch_add(len as u64, Ordering::Relaxed);
        self.slots[id as usize].is_used.store(true, Ordering::Relaxed);
        *self.slot(id) = Some(Arc::new(Page { lines, len, _memory: Some(memory) }));
        Ok(true)
    }

    /// Checks the bytes of a page; all of it when it comes for the first time.
    fn check(&self, bytes: &[u8], id: PageId) -> Result<(), PackError> {
        let entry = &self.pack.directory[id as usize];
        let was_good = &self.slots[id as usize].was_good;
        if was_good.load(Ordering::Relaxed) {
            return check_checksum(bytes, id, entry);
        }
        let manifest = &self.pack.manifest;
        check_page(bytes, id, entry, manifest.scene.geometries.len(), manifest.depth as usize)?;
        was_good.store(true, Ordering::Relaxed);
        Ok(())
    }

    /// Takes `bytes` of the budget; pages go for that.
    fn make_room(&self, bytes: u64) -> Option<Reservation> {
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

    fn slot(&self, id: PageId) -> MutexGuard<'_, Option<Arc<Page>>> {
        self.slots[id as usize].page.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A page without anything in it.
fn blank() -> Page {
    let header_lines = size_of::<PageHeader>().div_ceil(size_of::<WideNode>());
    let mut lines: Vec<WideNode> = bytemuck::zeroed_vec(header_lines + 1);
    let header = PageHeader {
        nodes_offset: (header_lines * size_of::<WideNode>()) as u32,
        max_windows: 1,
        ..bytemuck::Zeroable::zeroed()
    };
    bytemuck::cast_slice_mut(&mut lines)[..size_of::<PageHeader>()]
        .copy_from_slice(bytemuck::bytes_of(&header));
    let len = lines.len() * size_of::<WideNode>();
    Page { lines, len, _memory: None }
}

/// A look at pages: what it has seen stays in memory until it ends.
pub struct Visit<'p> {
    pool: &'p PagePool,
    seen: FrozenMap<PageId, Arc<Page>, BuildHasherDefault<PageHasher>>,
    count: Cell<usize>,
}

impl Visit<'_> {
    /// The pool that it looks at.
    pub fn pool(&self) -> &PagePool {
        self.pool
    }

    /// Page `id` if it is in memory.
    ///
    /// # Panics
    /// If there is no such page.
    #[inline]
    pub fn page(&self, id: PageId) -> Option<PageView<'_>> {
        if let Some(page) = self.seen.get(&id) {
            return Some(page.view());
        }
        let page = self.pool.slot(id).clone()?;
        self.pool.slots[id as usize].is_used.store(true, Ordering::Relaxed);
        self.pool.counters.hits.fetch_add(1, Ordering::Relaxed);
        self.count.set(self.count.get() + 1);
        Some(self.seen.insert(id, page).view())
    }

    /// Pages that it has seen.
    pub fn len(&self) -> usize {
        self.count.get()
    }

    /// True if it has seen none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A page without anything in it.
    pub fn blank(&self) -> PageView<'_> {
        self.pool.blank.view()
    }
}

/// Spreads page numbers (multiplication by the golden ratio; Knuth).
#[derive(Default)]
struct PageHasher(u64);

impl Hasher for PageHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u32(byte.into()));
    }

    fn write_u32(&mut self, number: u32) {
        self.0 = (self.0 ^ u64::from(number)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}
