//! Continuous page queues: a ray runs until it needs a page that is not in memory, and waits for it in the queue of that
//! page. The page of the longest queue is read next; when it has come, its whole queue goes on at once, and whatever
//! comes of that as well. There are no generations, so the tail of one does not wait for pages by itself.
//!
//! What a page costs is read once for all rays that wait for it: how many those are is set by how many may be in flight.
//! That is the difference to queues of geometry under a fixed grid (Pharr, Kolb, Gershbein, Hanrahan 1997), whose
//! voxels are visited by a schedule, and to sorting whole generations of rays (Moon et al. 2010).

use std::collections::{BTreeSet, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Rays that wait for the same page.
pub trait Parcel: Default + Send {
    /// Takes over all rays of `other`.
    fn append(&mut self, other: &mut Self);

    /// Bytes of memory that they take.
    fn bytes(&self) -> usize;
}

/// What a worker is to do.
#[derive(Debug, PartialEq, Eq)]
pub enum Work<P> {
    /// Go on with the rays that waited for a page.
    Serve(P),
    /// Start a batch of rays, the one of this number.
    Start(u64),
}

/// Queues of rays, one for each page, for workers that trace and readers that bring pages.
pub struct PageQueues<P> {
    state: Mutex<State<P>>,
    /// There may be work.
    work: Condvar,
    /// There may be something to read.
    reads: Condvar,
}

/// Where a page and its queue are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Nobody waits.
    Idle,
    /// Rays wait, and nobody reads.
    Waiting,
    /// A reader has it.
    Reading,
    /// It has come, and no worker has taken its rays.
    Arrived,
}

struct State<P> {
    /// By page.
    queues: Vec<P>,
    stages: Vec<Stage>,
    /// Those that wait, with their bytes.
    waiting: BTreeSet<(usize, u32)>,
    arrived: VecDeque<u32>,
    reading: usize,
    /// Most pages that are read or have come while no worker has taken their rays: queues of others grow meanwhile.
    read_ahead: usize,
    /// Workers that have work.
    at_work: usize,
    /// Bytes of all queues.
    bytes: usize,
    /// From here on nothing is started.
    most_bytes: usize,
    next_start: u64,
    starts: u64,
    is_stopped: bool,
}

impl<P: Parcel> PageQueues<P> {
    /// Empty queues for so many pages and `starts` batches of rays, which are started while queues have less than
    /// `most_bytes`. What is under way already may make them longer. Not more than `read_ahead` pages are read or have come
    /// while nobody goes on with their rays.
    pub fn new(pages: usize, starts: u64, most_bytes: usize, read_ahead: usize) -> PageQueues<P> {
        let state = State {
            queues: (0..pages).map(|_| P::default()).collect(),
            stages: vec![Stage::Idle; pages],
            waiting: BTreeSet::new(),
            arrived: VecDeque::new(),
            reading: 0,
            read_ahead,
            at_work: 0,
            bytes: 0,
            most_bytes,
            next_start: 0,
            starts,
            is_stopped: false,
        };
        PageQueues { state: Mutex::new(state), work: Condvar::new(), reads: Condvar::new() }
    }

    /// The next work, or `None` when all is done. Waits for it. Every work must be [finished](PageQueues::finish).
    pub fn next_work(&self) -> Option<Work<P>> {
        let mut state = self.lock();
        loop {
            if let Some(work) = state.next_work() {
                self.wake_one_each(&state);
                return Some(work);
            }
            if state.is_over() {
                self.work.notify_all();
                self.reads.notify_all();
                return None;
            }
            state = self.work.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The next work if there is some now.
    pub fn try_next_work(&self) -> Option<Work<P>> {
        let mut state = self.lock();
        let work = state.next_work();
        self.wake_one_each(&state);
        work
    }

    /// Ends a work, of which these rays are left, by the page that they wait for.
    pub fn finish(&self, left: impl Iterator<Item = (u32, P)>) {
        let mut state = self.lock();
        state.at_work -= 1;
        for (page, mut rays) in left {
            state.add(page, &mut rays);
        }
        self.wake_one_each(&state);
    }

    /// The page to read next, or `None` when all is done. Waits for it. It must have [arrived](PageQueues::arrived), or be
    /// [put back](PageQueues::put_back), after that.
    pub fn next_read(&self) -> Option<u32> {
        let mut state = self.lock();
        loop {
            if state.is_over() {
                return None;
            }
            if state.can_read() {
                let (_, page) = state.waiting.pop_last().expect("there is one to read");
                state.stages[page as usize] = Stage::Reading;
                state.reading += 1;
                self.wake_one_each(&state);
                return Some(page);
            }
            state = self.reads.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A page is in memory.
    pub fn arrived(&self, page: u32) {
        let mut state = self.lock();
        state.reading -= 1;
        state.stages[page as usize] = Stage::Arrived;
        state.arrived.push_back(page);
        self.work.notify_one();
    }

    /// A page could not be read now.
    pub fn put_back(&self, page: u32) {
        let mut state = self.lock();
        state.reading -= 1;
        state.stages[page as usize] = Stage::Waiting;
        let bytes = state.queues[page as usize].bytes();
        state.waiting.insert((bytes, page));
    }

    /// Ends all work.
    pub fn stop(&self) {
        self.lock().is_stopped = true;
        self.work.notify_all();
        self.reads.notify_all();
    }

    /// Wakes a worker and a reader where there is something for them; who comes wakes the next one.
    fn wake_one_each(&self, state: &State<P>) {
        if state.can_work() {
            self.work.notify_one();
        }
        if state.can_read() {
            self.reads.notify_one();
        }
    }

    fn lock(&self) -> MutexGuard<'_, State<P>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<P: Parcel> State<P> {
    fn next_work(&mut self) -> Option<Work<P>> {
        if self.is_stopped {
            return None;
        }
        let work = if let Some(page) = self.arrived.pop_front() {
            self.stages[page as usize] = Stage::Idle;
            let rays = std::mem::take(&mut self.queues[page as usize]);
            self.bytes -= rays.bytes();
            Work::Serve(rays)
        } else if self.can_start() {
            self.next_start += 1;
            Work::Start(self.next_start - 1)
        } else {
            return None;
        };
        self.at_work += 1;
        Some(work)
    }

    fn add(&mut self, page: u32, rays: &mut P) {
        let queue = &mut self.queues[page as usize];
        let before = queue.bytes();
        queue.append(rays);
        let after = queue.bytes();
        self.bytes = self.bytes + after - before;
        let stage = &mut self.stages[page as usize];
        if matches!(stage, Stage::Idle | Stage::Waiting) {
            *stage = Stage::Waiting;
            self.waiting.remove(&(before, page));
            self.waiting.insert((after, page));
        }
    }

    fn can_start(&self) -> bool {
        self.next_start < self.starts && (self.bytes < self.most_bytes || self.is_quiet())
    }

    fn can_work(&self) -> bool {
        !self.arrived.is_empty() || self.can_start()
    }

    fn can_read(&self) -> bool {
        !self.waiting.is_empty() && self.reading + self.arrived.len() < self.read_ahead
    }

    /// True if no ray is under way anywhere.
    fn is_quiet(&self) -> bool {
        self.at_work == 0 && self.reading == 0 && self.waiting.is_empty() && self.arrived.is_empty()
    }

    fn is_over(&self) -> bool {
        self.is_stopped || (self.is_quiet() && self.next_start == self.starts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Parcel for Vec<u8> {
        fn append(&mut self, other: &mut Vec<u8>) {
            Vec::append(self, other);
        }

        fn bytes(&self) -> usize {
            self.len()
        }
    }

    #[test]
    fn the_longest_queue_is_read_first_and_served_whole() {
        let queues = PageQueues::<Vec<u8>>::new(3, 2, 4, 2);
        assert_eq!(queues.next_work(), Some(Work::Start(0)));
        assert_eq!(queues.try_next_work(), Some(Work::Start(1)));
        queues.finish([(0, vec![1]), (2, vec![2, 3])].into_iter());
        queues.finish([(0, vec![4, 5])].into_iter());
        assert_eq!(queues.next_read(), Some(0));
        assert_eq!(queues.next_read(), Some(2));
        queues.arrived(2);
        queues.put_back(0);
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![2, 3])));
        assert_eq!(queues.try_next_work(), None);
        queues.finish([(0, vec![6])].into_iter());
        assert_eq!(queues.next_read(), Some(0));
        queues.arrived(0);
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![1, 4, 5, 6])));
        queues.finish(std::iter::empty());
        assert_eq!((queues.next_work(), queues.next_read()), (None, None));
    }

    #[test]
    fn nothing_is_started_while_queues_are_long_unless_nothing_else_is_left() {
        let queues = PageQueues::<Vec<u8>>::new(1, 3, 2, 2);
        assert_eq!(queues.next_work(), Some(Work::Start(0)));
        queues.finish([(0, vec![1, 2])].into_iter());
        assert_eq!(queues.try_next_work(), None);
        assert_eq!(queues.next_read(), Some(0));
        queues.arrived(0);
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![1, 2])));
        assert_eq!(queues.try_next_work(), Some(Work::Start(1)));
        queues.stop();
        assert_eq!((queues.next_work(), queues.next_read()), (None, None));
    }
}
