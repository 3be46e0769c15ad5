//! Continuous page queues: a ray runs until it needs a page that is not in memory, and waits for it in the queue of that
//! page. The page of the longest queue is read next; when it has come, its whole queue goes on at once, and whatever
//! comes of that as well. There are no generations, so the tail of one does not wait for pages by itself. A page is
//! whatever is read at once: where the disk seeks, a run of several pages of the file.
//!
//! What a page costs is read once for all rays that wait for it: how many those are is set by how many may be in flight.
//! That is the difference to queues of geometry under a fixed grid (Pharr, Kolb, Gershbein, Hanrahan 1997), whose
//! voxels are visited by a schedule, and to sorting whole generations of rays (Moon et al. 2010).

use std::collections::{BTreeSet, VecDeque};
use std::ops::{AddAssign, Range, SubAssign};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Rays that wait for the same page.
pub trait Parcel: Default + Send {
    /// Takes over all rays of `other`.
    fn append(&mut self, other: &mut Self);

    /// How many they are.
    fn rays(&self) -> usize;

    /// Bytes of memory that they take.
    fn bytes(&self) -> usize;
}

/// How many rays, and their memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amount {
    rays: usize,
    bytes: usize,
}

impl Amount {
    /// That of a parcel.
    pub fn of(parcel: &impl Parcel) -> Amount {
        Amount { rays: parcel.rays(), bytes: parcel.bytes() }
    }
}

impl AddAssign for Amount {
    fn add_assign(&mut self, other: Amount) {
        self.rays += other.rays;
        self.bytes += other.bytes;
    }
}

impl SubAssign for Amount {
    fn sub_assign(&mut self, other: Amount) {
        self.rays -= other.rays;
        self.bytes -= other.bytes;
    }
}

/// What a worker is to do.
#[derive(Debug, PartialEq, Eq)]
pub enum Work<P> {
    /// Go on with rays that waited for pages which have come.
    Serve(P),
    /// Start a batch of rays, the one of this number.
    Start(u64),
}

/// How much of what there is at once.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Rays are started while fewer wait. Those that are under way already may become more.
    pub start: usize,
    /// Queues whose pages have come are served together up to this many rays.
    pub serve: usize,
    /// Most pages that are read or have come while nobody goes on with their rays: the queues of others grow meanwhile.
    pub read_ahead: usize,
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
    /// Those that wait, with the number of their rays.
    waiting: BTreeSet<(usize, u32)>,
    arrived: VecDeque<u32>,
    reading: usize,
    limits: Limits,
    /// Those that sleep.
    idle_workers: usize,
    idle_readers: usize,
    /// Workers that have work.
    at_work: usize,
    /// All queues, and what workers got from them.
    total: Amount,
    next_start: u64,
    end_of_starts: u64,
    is_stopped: bool,
}

impl<P: Parcel> PageQueues<P> {
    /// Empty queues for so many pages, and batches of rays with these numbers.
    pub fn new(pages: usize, starts: Range<u64>, limits: Limits) -> PageQueues<P> {
        let state = State {
            queues: (0..pages).map(|_| P::default()).collect(),
            stages: vec![Stage::Idle; pages],
            waiting: BTreeSet::new(),
            arrived: VecDeque::new(),
            reading: 0,
            limits,
            idle_workers: 0,
            idle_readers: 0,
            at_work: 0,
            total: Amount::default(),
            next_start: starts.start,
            end_of_starts: starts.end,
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
            state.idle_workers += 1;
            state = self.work.wait(state).unwrap_or_else(PoisonError::into_inner);
            state.idle_workers -= 1;
        }
    }

    /// The next work if there is some now.
    pub fn try_next_work(&self) -> Option<Work<P>> {
        let mut state = self.lock();
        let work = state.next_work();
        self.wake_one_each(&state);
        work
    }

    /// Puts rays into queues: for each page what adds them to its parcel.
    pub fn put<F: FnOnce(&mut P)>(&self, rays: impl Iterator<Item = (u32, F)>) {
        let mut state = self.lock();
        for (page, add) in rays {
            state.add(page, add);
        }
        self.wake_one_each(&state);
    }

    /// Ends a work that began with so much. What is left of it was [put](PageQueues::put) back.
    pub fn finish(&self, served: Amount) {
        let mut state = self.lock();
        state.at_work -= 1;
        state.total -= served;
        self.wake_one_each(&state);
    }

    /// Bytes of all rays that wait or are served.
    pub fn bytes(&self) -> usize {
        self.lock().total.bytes
    }

    /// The page of the longest queue, to be read next, or `None` when all is done. Waits for it. It must have
    /// [arrived](PageQueues::arrived), or be [put back](PageQueues::put_back), after that.
    pub fn next_read(&self) -> Option<u32> {
        self.next_read_by(|waiting| waiting.last().copied())
    }

    /// The same for the page of the most rays by cost, the benefit by cost of Pharr et al. 1997. All costs are asked for, so
    /// this is for few pages.
    pub fn next_read_by_benefit(&self, cost: impl Fn(u32) -> u64) -> Option<u32> {
        let benefit = |&(rays, page): &(usize, u32)| rays as f64 / (cost(page) + 1) as f64;
        self.next_read_by(|waiting| waiting.iter().copied().max_by(|a, b| benefit(a).total_cmp(&benefit(b))))
    }

    fn next_read_by(&self, choose: impl Fn(&BTreeSet<(usize, u32)>) -> Option<(usize, u32)>) -> Option<u32> {
        let mut state = self.lock();
        loop {
            if state.is_over() {
                return None;
            }
            if state.can_read() {
                let next = choose(&state.waiting).expect("there is one to read");
                state.waiting.remove(&next);
                let (_, page) = next;
                state.stages[page as usize] = Stage::Reading;
                state.reading += 1;
                self.wake_one_each(&state);
                return Some(page);
            }
            state.idle_readers += 1;
            state = self.reads.wait(state).unwrap_or_else(PoisonError::into_inner);
            state.idle_readers -= 1;
        }
    }

    /// A page is in memory.
    pub fn arrived(&self, page: u32) {
        let mut state = self.lock();
        state.reading -= 1;
        state.stages[page as usize] = Stage::Arrived;
        state.arrived.push_back(page);
        self.wake_one_each(&state);
    }

    /// A page could not be read now.
    pub fn put_back(&self, page: u32) {
        let mut state = self.lock();
        state.reading -= 1;
        state.stages[page as usize] = Stage::Waiting;
        let rays = state.queues[page as usize].rays();
        state.waiting.insert((rays, page));
    }

    /// From here on nothing is started. What is under way is finished.
    pub fn close(&self) {
        let mut state = self.lock();
        state.end_of_starts = state.next_start;
    }

    /// The number of the batch that would be started next.
    pub fn next_start(&self) -> u64 {
        self.lock().next_start
    }

    /// Ends all work.
    pub fn stop(&self) {
        self.lock().is_stopped = true;
        self.work.notify_all();
        self.reads.notify_all();
    }

    /// Wakes a worker and a reader where there is something for them; who comes wakes the next one.
    fn wake_one_each(&self, state: &State<P>) {
        // To wake nobody would be a system call.
        if state.idle_workers > 0 && state.can_work() {
            self.work.notify_one();
        }
        if state.idle_readers > 0 && state.can_read() {
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
        let work = if self.can_start() {
            self.next_start += 1;
            Work::Start(self.next_start - 1)
        } else if let Some(page) = self.arrived.pop_front() {
            let mut rays = self.take_queue(page);
            while rays.rays() < self.limits.serve
                && let Some(page) = self.arrived.pop_front()
            {
                let mut more = self.take_queue(page);
                self.total -= Amount::of(&rays);
                self.total -= Amount::of(&more);
                rays.append(&mut more);
                self.total += Amount::of(&rays);
            }
            Work::Serve(rays)
        } else {
            return None;
        };
        self.at_work += 1;
        Some(work)
    }

    fn take_queue(&mut self, page: u32) -> P {
        self.stages[page as usize] = Stage::Idle;
        std::mem::take(&mut self.queues[page as usize])
    }

    fn add(&mut self, page: u32, add: impl FnOnce(&mut P)) {
        let queue = &mut self.queues[page as usize];
        let before = Amount::of(queue);
        add(queue);
        let after = Amount::of(queue);
        self.total += after;
        self.total -= before;
        let stage = &mut self.stages[page as usize];
        if matches!(stage, Stage::Idle | Stage::Waiting) {
            *stage = Stage::Waiting;
            self.waiting.remove(&(before.rays, page));
            self.waiting.insert((after.rays, page));
        }
    }

    fn can_start(&self) -> bool {
        self.next_start < self.end_of_starts && (self.total.rays < self.limits.start || self.is_quiet())
    }

    fn can_work(&self) -> bool {
        !self.arrived.is_empty() || self.can_start()
    }

    fn can_read(&self) -> bool {
        !self.waiting.is_empty() && self.reading + self.arrived.len() < self.limits.read_ahead
    }

    /// True if no ray is under way anywhere.
    fn is_quiet(&self) -> bool {
        self.at_work == 0 && self.reading == 0 && self.waiting.is_empty() && self.arrived.is_empty()
    }

    fn is_over(&self) -> bool {
        self.is_stopped || (self.is_quiet() && self.next_start == self.end_of_starts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Parcel for Vec<u8> {
        fn append(&mut self, other: &mut Vec<u8>) {
            Vec::append(self, other);
        }

        fn rays(&self) -> usize {
            self.len()
        }

        fn bytes(&self) -> usize {
            2 * self.len()
        }
    }

    fn limits(start: usize, read_ahead: usize) -> Limits {
        Limits { start, serve: 1, read_ahead }
    }

    fn finish(queues: &PageQueues<Vec<u8>>, served: usize, left: &[(u32, &[u8])]) {
        let served = Amount { rays: served, bytes: 2 * served };
        queues.put(left.iter().map(|(page, rays)| (*page, |queue: &mut Vec<u8>| queue.extend(*rays))));
        queues.finish(served);
    }

    #[test]
    fn the_longest_queue_is_read_first_and_served_whole() {
        let queues = PageQueues::new(3, 0..2, limits(4, 2));
        assert_eq!(queues.next_work(), Some(Work::Start(0)));
        assert_eq!(queues.try_next_work(), Some(Work::Start(1)));
        finish(&queues, 0, &[(0, &[1]), (2, &[2, 3])]);
        finish(&queues, 0, &[(0, &[4, 5])]);
        assert_eq!(queues.next_read(), Some(0));
        assert_eq!(queues.next_read(), Some(2));
        queues.arrived(2);
        queues.put_back(0);
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![2, 3])));
        assert_eq!(queues.try_next_work(), None);
        finish(&queues, 2, &[(0, &[6])]);
        assert_eq!(queues.bytes(), 8);
        assert_eq!(queues.next_read(), Some(0));
        queues.arrived(0);
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![1, 4, 5, 6])));
        finish(&queues, 4, &[]);
        assert_eq!((queues.next_work(), queues.next_read()), (None, None));
    }

    #[test]
    fn benefit_by_cost_can_decide_what_is_read() {
        let queues = PageQueues::new(3, 0..1, limits(1, 3));
        assert_eq!(queues.next_work(), Some(Work::Start(0)));
        finish(&queues, 0, &[(0, &[1, 1, 1]), (1, &[2, 2]), (2, &[3])]);
        let cost = |page: u32| [30, 10, 0][page as usize];
        let order = [(); 3].map(|()| queues.next_read_by_benefit(cost));
        assert_eq!(order, [Some(2), Some(1), Some(0)]);
    }

    #[test]
    fn short_queues_are_served_together() {
        let queues = PageQueues::new(3, 0..1, Limits { serve: 3, ..limits(1, 3) });
        assert_eq!(queues.next_work(), Some(Work::Start(0)));
        finish(&queues, 0, &[(0, &[1, 1, 1]), (1, &[2, 2]), (2, &[3])]);
        (0..3).for_each(|page| assert_eq!(queues.next_read(), Some(page)));
        [2, 1, 0].into_iter().for_each(|page| queues.arrived(page));
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![3, 2, 2])));
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![1, 1, 1])));
    }

    #[test]
    fn nothing_is_started_while_queues_are_long_unless_nothing_else_is_left() {
        let queues = PageQueues::new(1, 0..3, limits(2, 2));
        assert_eq!(queues.next_work(), Some(Work::Start(0)));
        finish(&queues, 0, &[(0, &[1, 2])]);
        assert_eq!(queues.try_next_work(), None);
        assert_eq!(queues.next_read(), Some(0));
        queues.arrived(0);
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![1, 2])));
        assert_eq!(queues.try_next_work(), None);
        finish(&queues, 2, &[]);
        assert_eq!(queues.try_next_work(), Some(Work::Start(1)));
        queues.stop();
        assert_eq!((queues.next_work(), queues.next_read()), (None, None));
    }

    #[test]
    fn what_is_under_way_is_finished_when_nothing_more_is_to_be_started() {
        let queues = PageQueues::<Vec<u8>>::new(1, 5..9, limits(2, 2));
        assert_eq!(queues.next_work(), Some(Work::Start(5)));
        queues.close();
        finish(&queues, 0, &[(0, &[1])]);
        assert_eq!(queues.try_next_work(), None);
        assert_eq!(queues.next_read(), Some(0));
        queues.arrived(0);
        assert_eq!(queues.next_work(), Some(Work::Serve(vec![1])));
        finish(&queues, 1, &[]);
        assert_eq!((queues.next_work(), queues.next_start()), (None, 6));
    }
}
