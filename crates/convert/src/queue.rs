//! Work that is done by several threads at a time and taken over in its order.

use crate::{ConvertError, Observer};
use rayon::Scope;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Makes what `take` gets of an item.
type Work<'a, T> = &'a (dyn Fn(usize) -> Result<T, ConvertError> + Sync);
/// Gets the items in their order, each with what `work` made of it.
type Take<'a, T> = &'a mut (dyn FnMut(usize, T) -> Result<(), ConvertError> + Send);

/// Does `work` for each of `items`, `at_a_time`, and gives the results to `take` in the order of the items. Not more than
/// twice as many results wait as are worked on. Ends at the first error, and when the observer says so.
pub(crate) fn in_order<T: Send>(
    items: Range<usize>,
    at_a_time: usize,
    observer: &dyn Observer,
    work: Work<T>,
    take: Take<T>,
) -> Result<(), ConvertError> {
    in_order_within(items, (at_a_time, 2 * at_a_time + 1), observer, work, take)
}

/// The same with at most `most` items that are worked on or wait.
pub(crate) fn in_order_within<T: Send>(
    items: Range<usize>,
    (at_a_time, most): (usize, usize),
    observer: &dyn Observer,
    work: Work<T>,
    take: Take<T>,
) -> Result<(), ConvertError> {
    let state = State {
        next: items.start,
        taken: items.start,
        waiting: BTreeMap::new(),
        window: most,
        idle: 0,
        take,
        error: None,
    };
    let queue = Queue { end: items.end, observer, work, state: Mutex::new(state) };
    rayon::scope(|scope| (0..at_a_time).for_each(|_| scope.spawn(|scope| queue.work_on_next(scope))));
    let state = queue.state.into_inner().unwrap_or_else(PoisonError::into_inner);
    state.error.map_or(Ok(()), Err)
}

/// What the workers share.
struct Queue<'a, T> {
    end: usize,
    observer: &'a dyn Observer,
    work: Work<'a, T>,
    state: Mutex<State<'a, T>>,
}

struct State<'a, T> {
    /// The next item to work on.
    next: usize,
    /// The next item to be taken over.
    taken: usize,
    /// Results that wait for those before them.
    waiting: BTreeMap<usize, T>,
    /// Most items from the one to be taken over next to the one to be worked on next: bounds those that wait.
    window: usize,
    /// Workers that ended because the window was full.
    idle: usize,
    take: Take<'a, T>,
    error: Option<ConvertError>,
}

impl<'a, T: Send> Queue<'a, T> {
    /// Works on an item and leaves the next one to a task of its own. One task that worked on all of its items in a row
    /// might begin on the stack of another, which waits for the other half of its work, and keep that from ending.
    fn work_on_next<'s>(&'s self, scope: &Scope<'s>) {
        let Some(item) = self.next() else { return };
        let result = (self.work)(item);
        let workers = self.lock().add(item, result);
        (0..workers).for_each(|_| scope.spawn(|scope| self.work_on_next(scope)));
    }

    /// The next item; none after an error or when too many results wait already.
    fn next(&self) -> Option<usize> {
        let mut state = self.lock();
        if self.observer.is_cancelled() {
            state.error.get_or_insert(ConvertError::Cancelled);
        }
        if state.error.is_some() || state.next == self.end {
            return None;
        }
        if state.next >= state.taken + state.window {
            state.idle += 1;
            return None;
        }
        state.next += 1;
        Some(state.next - 1)
    }

    fn lock(&self) -> MutexGuard<'_, State<'a, T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> State<'_, T> {
    /// Adds a result, and gives away all that are next in order. Tells how many workers are to go on.
    fn add(&mut self, item: usize, result: Result<T, ConvertError>) -> usize {
        let added = result.and_then(|result| {
            self.waiting.insert(item, result);
            while let Some(result) = self.waiting.remove(&self.taken) {
                (self.take)(self.taken, result)?;
                self.taken += 1;
            }
            Ok(())
        });
        if let Err(error) = added {
            self.error.get_or_insert(error);
        }
        1 + std::mem::take(&mut self.idle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unobserved;

    #[test]
    fn results_come_in_order_until_there_is_an_error() {
        for (at_a_time, failing) in [(1, 100), (3, 100), (4, 7)] {
            let work = |i: usize| {
                std::thread::sleep(std::time::Duration::from_micros((i * 7 % 5) as u64 * 50));
                if i == failing { Err(ConvertError::Cancelled) } else { Ok(i * i) }
            };
            let mut taken = Vec::new();
            let result = in_order(3..40, at_a_time, &Unobserved, &work, &mut |i, square| {
                taken.push((i, square));
                Ok(())
            });
            assert_eq!(result.is_err(), failing < 40);
            let expected: Vec<(usize, usize)> = (3..failing.min(40)).map(|i| (i, i * i)).collect();
            assert_eq!(taken, expected);
        }
    }
}
