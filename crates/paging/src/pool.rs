//! Pages of a pack that does not fit in memory: as many as a budget allows, those used last.
//!
//! Whoever looks at pages does so in a *visit*. What it has seen stays in memory until the visit ends, so that pages can
//! be used without asking again; until then their bytes count. There is no lock for all pages: each has its own, which
//! is held for as long as it takes to copy a pointer.

use crate::OpenError;
use crate::clock::Clock;
use crate::frames::{Frame, Frames};
use crate::loan::Loan;
use crate::page::{self, Page};
use crate::parents::Parents;
use crate::probe;
use crate::side_blocks::SideBlocks;
use crate::visit::Visit;
use raystrips_extmem::{BlockBuffer, BlockFile, spare_memory};
use raystrips_pack::{Pack, PackError, PageEntry, PageId, PageView, WideNode, check_checksum, check_page};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Frames are whole pages of the system's.
const FRAME_UNIT: u64 = 4096;
/// Most bytes that are read at a time: a disk that seeks does not gain by more.
const MOST_READ_BYTES: u64 = 1 << 20;

/// The pages of one pack, of which some are in memory.
pub struct PagePool {
    pack: Pack,
    path: PathBuf,
    file: BlockFile,
    slots: Vec<Slot>,
    parents: Parents,
    clock: Mutex<Clock>,
    frames: Frames,
    most_bytes: u64,
    /// Of the largest page.
    frame_bytes: u64,
    /// Bytes of them that are in other use.
    lent: Arc<AtomicU64>,
    blank: Vec<WideNode>,
    side_blocks: SideBlocks,
    counters: Counters,
}

/// Bytes of memory that a page takes.
fn frame_bytes(entry: &PageEntry) -> u64 {
    u64::from(entry.bytes.max(1)).next_multiple_of(FRAME_UNIT)
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
    /// Opens the pack at `path`, with none of its pages; `bytes` are for pages, `side_bytes` for attributes and images.
    pub fn open(path: &Path, bytes: u64, side_bytes: u64) -> Result<PagePool, OpenError> {
        let open = || {
            let mut file = File::open(path)?;
            let pack = Pack::open(&mut file)?;
            let is_large = spare_memory().is_some_and(|spare| pack.file_bytes > spare);
            Ok(PagePool {
                slots: pack.directory.iter().map(|_| Slot::default()).collect(),
                parents: Parents::of(&pack),
                path: path.to_owned(),
                file: BlockFile::open(path, is_large)?,
                clock: Mutex::default(),
                frames: Frames::new(bytes),
                most_bytes: bytes,
                frame_bytes: PagePool::frame_bytes(&pack),
                lent: Arc::default(),
                blank: page::blank(),
                side_blocks: SideBlocks::new(BlockFile::open(path, is_large)?, path.to_owned(), side_bytes),
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

    /// Least bytes for attributes and images.
    pub fn least_side_bytes(pack: &Pack) -> u64 {
        SideBlocks::least_bytes(pack)
    }

    /// The attributes of a page, for [`AttributeView`](raystrips_pack::AttributeView); empty if it has none.
    ///
    /// # Errors
    /// If they cannot be read or are damaged.
    pub fn attributes(&self, page: PageId) -> Result<Arc<[u8]>, OpenError> {
        self.side_blocks.attributes(&self.pack, page)
    }

    /// A tile of an image.
    ///
    /// # Errors
    /// If it cannot be read or is damaged.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn tile(&self, tile: u64) -> Result<Arc<[u8]>, OpenError> {
        self.side_blocks.tile(&self.pack, tile)
    }

    /// Bytes that the largest page takes in the pool.
    pub fn frame_bytes(pack: &Pack) -> u64 {
        pack.directory.iter().map(frame_bytes).max().unwrap_or(FRAME_UNIT)
    }

    /// Bytes of memory for pages.
    pub fn bytes(&self) -> u64 {
        self.most_bytes - self.lent.load(Ordering::Relaxed)
    }

    /// Pages that surely fit in memory.
    pub fn capacity(&self) -> usize {
        (self.bytes() / self.frame_bytes) as usize
    }

    /// How much to read at a time, found by reading some: 0 for single pages, more where the disk has to seek.
    ///
    /// # Errors
    /// If the pack cannot be read.
    pub fn probe(&self) -> Result<u64, OpenError> {
        probe::read_bytes(&self.file, &self.pack.directory)
            .map_err(|e| OpenError { path: self.path.clone(), source: e.into() })
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
        PageView::new(bytemuck::cast_slice(&self.blank)).expect("it has a header")
    }

    /// Page `id` if it is in memory.
    pub(crate) fn get(&self, id: PageId) -> Option<Arc<Page>> {
        let page = self.slot(id).clone()?;
        self.slots[id as usize].is_used.store(true, Ordering::Relaxed);
        self.counters.hits.fetch_add(1, Ordering::Relaxed);
        Some(page)
    }

    /// Whether page `id` is in memory now.
    pub fn has(&self, id: PageId) -> bool {
        self.slot(id).is_some()
    }

    /// Bytes of those of `pages` that are not in memory.
    pub fn absent_bytes(&self, pages: &[PageId]) -> u64 {
        pages.iter().filter(|&&id| self.slot(id).is_none()).map(|&id| u64::from(self.entry(id).bytes)).sum()
    }

    /// Reads those of `pages`, neighbors as they lie in the file, that are not there, in one go or a few, and checks them. Pages that were not used for long go.
    /// False where visits hold all memory: it is there when they end. `buffer` is for what is read.
    ///
    /// # Errors
    /// If a page cannot be read or is damaged.
    pub fn load(&self, pages: &[PageId], buffer: &mut BlockBuffer) -> Result<bool, OpenError> {
        let mut absent: Vec<PageId> = pages.iter().copied().filter(|&id| self.slot(id).is_none()).collect();
        while let Some(&first) = absent.first() {
            let begin = self.entry(first).offset;
            let fits = |&id: &PageId| self.end(id) - begin <= MOST_READ_BYTES;
            let count = absent.iter().take_while(|id| fits(id)).count().max(1);
            let read = self.read(&absent[..count], buffer)?;
            if read == 0 {
                return Ok(false);
            }
            absent.drain(..read);
        }
        Ok(true)
    }

    /// Reads the first of `pages`, as many as there is memory for, in one go. Tells how many.
    fn read(&self, pages: &[PageId], buffer: &mut BlockBuffer) -> Result<usize, OpenError> {
        // As many as there are frames for; the others are read after them.
        let mut frames: Vec<Frame> = pages.iter().map_while(|&id| self.take_frame(id)).collect();
        let pages = &pages[..frames.len()];
        let (Some(&first), Some(&last)) = (pages.first(), pages.last()) else { return Ok(0) };
        let error = |source| OpenError { path: self.path.clone(), source };
        let begin = self.entry(first).offset;
        if let [frame] = &mut frames[..] {
            // What was read of other pages is no more than the padding behind this one.
            let wanted = self.entry(first).bytes as usize;
            self.file.fill(frame.bytes_mut(), begin, wanted).map_err(|e| error(e.into()))?;
        } else {
            let bytes = self.file.read(begin..self.end(last), buffer).map_err(|e| error(e.into()))?;
            for (&id, frame) in pages.iter().zip(&mut frames) {
                let entry = self.entry(id);
                let bytes = &bytes[(entry.offset - begin) as usize..][..entry.bytes as usize];
                frame.bytes_mut()[..bytes.len()].copy_from_slice(bytes);
            }
        }
        for (&id, frame) in pages.iter().zip(frames) {
            self.put(id, frame).map_err(error)?;
        }
        Ok(pages.len())
    }

    /// Checks the page in `frame` and lets others have it.
    fn put(&self, id: PageId, mut frame: Frame) -> Result<(), PackError> {
        let len = self.entry(id).bytes;
        self.check(&frame.bytes_mut()[..len as usize], id)?;
        self.counters.read.fetch_add(1, Ordering::Relaxed);
        self.counters.bytes_read.fetch_add(u64::from(len), Ordering::Relaxed);
        self.slots[id as usize].is_used.store(true, Ordering::Relaxed);
        let mut slot = self.slot(id);
        if slot.is_none() {
            *slot = Some(Arc::new(Page::new(frame, len as usize)));
            self.clock().push(id);
        }
        Ok(())
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

    /// A frame for a page; others go if there is no memory for one more. `None` where visits hold too many.
    fn take_frame(&self, id: PageId) -> Option<Frame> {
        let bytes = frame_bytes(self.entry(id));
        loop {
            if let Some(frame) = self.frames.take(bytes) {
                return Some(frame);
            }
            if !self.make_room() {
                return None;
            }
        }
    }

    /// Lends `bytes` of the memory of the pool; pages go for that. `None` where visits hold too many, or where not one page
    /// would fit beside it.
    pub fn lend(&self, bytes: u64) -> Option<Loan> {
        if self.bytes().checked_sub(bytes).is_none_or(|rest| rest < self.frame_bytes) {
            return None;
        }
        loop {
            if let Some(memory) = self.frames.take_memory(bytes) {
                return Some(Loan::new(memory, self.lent.clone()));
            }
            if !self.make_room() {
                return None;
            }
        }
    }

    /// Lets the page go that is to go next, or memory that no page is in; false if there is none.
    fn make_room(&self) -> bool {
        match self.evict().map(Arc::try_unwrap) {
            Some(Ok(page)) => self.frames.put(page.into_frame()),
            // Somebody began to look at it just now: its memory comes back when that ends.
            Some(Err(_)) => (),
            None => return self.frames.drop_spare(),
        }
        true
    }

    /// Takes the page out of the pool that is to go next, if there are any.
    fn evict(&self) -> Option<Arc<Page>> {
        // A page that somebody looks at is used, and would not give its memory back.
        let is_seen = |id: PageId| self.slot(id).as_ref().is_some_and(|page| Arc::strong_count(page) > 1);
        let was_used =
            |id: PageId| self.slots[id as usize].is_used.swap(false, Ordering::Relaxed) || is_seen(id);
        let id = self.clock().pop(was_used)?;
        self.counters.evicted.fetch_add(1, Ordering::Relaxed);
        self.slot(id).take()
    }

    fn clock(&self) -> MutexGuard<'_, Clock> {
        self.clock.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn entry(&self, id: PageId) -> &PageEntry {
        &self.pack.directory[id as usize]
    }

    /// Where a page ends in the file.
    fn end(&self, id: PageId) -> u64 {
        self.entry(id).offset + u64::from(self.entry(id).bytes)
    }

    fn slot(&self, id: PageId) -> MutexGuard<'_, Option<Arc<Page>>> {
        self.slots[id as usize].page.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
