//! Builds pieces, some at a time, and adds them to the pack in their order.

use crate::distribute::PieceSource;
use crate::job::Job;
use crate::output::Output;
use crate::piece::{self, BuiltPiece, Context};
use crate::{ConvertError, Observer, Stage};
use rayon::Scope;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What the builders share.
pub(crate) struct Queue<'a, 'o> {
    context: &'a Context<'a>,
    sources: &'a [PieceSource],
    observer: &'a dyn Observer,
    at_a_time: usize,
    /// Triangles in strips, and those there are.
    done: AtomicU64,
    total: u64,
    state: Mutex<State<'a, 'o>>,
}

struct State<'a, 'o> {
    /// The next piece to build, and the number of its first triangle.
    next: usize,
    first_triangle: u64,
    /// Pieces that wait for those before them.
    waiting: BTreeMap<usize, BuiltPiece>,
    /// Most pieces from the one to be added next to the one to be built next: bounds those that wait.
    window: usize,
    /// Builders that ended because the window was full.
    idle: usize,
    output: &'a mut Output<'o>,
    job: &'a mut Job,
    error: Option<ConvertError>,
}

impl<'a, 'o> Queue<'a, 'o> {
    /// All pieces of `sources` that are not in `output` yet, to be built `at_a_time`.
    pub fn new(
        context: &'a Context<'a>,
        sources: &'a [PieceSource],
        output: &'a mut Output<'o>,
        job: &'a mut Job,
        observer: &'a dyn Observer,
        at_a_time: usize,
    ) -> Queue<'a, 'o> {
        let count = |sources: &[PieceSource]| sources.iter().map(|piece| piece.triangles).sum::<u64>();
        let next = output.piece_count();
        let first_triangle = count(&sources[..next]);
        let state = State {
            next,
            first_triangle,
            waiting: BTreeMap::new(),
            window: 2 * at_a_time + 1,
            idle: 0,
            output,
            job,
            error: None,
        };
        Queue {
            context,
            sources,
            observer,
            at_a_time,
            done: AtomicU64::new(first_triangle),
            total: count(sources),
            state: Mutex::new(state),
        }
    }

    /// Builds and adds them.
    pub fn run(self) -> Result<(), ConvertError> {
        rayon::scope(|scope| (0..self.at_a_time).for_each(|_| scope.spawn(|scope| self.build_next(scope))));
        let state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        state.error.map_or(Ok(()), Err)
    }

    /// Builds a piece and leaves the next one to a task of its own. One task that built all of its pieces in a row might
    /// begin on the stack of another, which waits for the other half of its work, and keep that from ending.
    fn build_next<'s>(&'s self, scope: &Scope<'s>) {
        let Some((number, first_triangle)) = self.take() else { return };
        let finished = |triangles: usize| {
            let before = self.done.fetch_add(triangles as u64, Ordering::Relaxed);
            self.observer.progress(Stage::Build, before + triangles as u64, self.total);
        };
        let built = piece::build(self.context, number, &self.sources[number], first_triangle, &finished);
        let builders = self.lock().add(number, built);
        (0..builders).for_each(|_| scope.spawn(|scope| self.build_next(scope)));
    }

    /// The next piece and the number of its first triangle; none after an error or when too many wait already.
    fn take(&self) -> Option<(usize, u64)> {
        let mut state = self.lock();
        if self.observer.is_cancelled() {
            state.error.get_or_insert(ConvertError::Cancelled);
        }
        if state.error.is_some() {
            return None;
        }
        if state.next >= state.output.piece_count() + state.window {
            state.idle += 1;
            return None;
        }
        let (number, first_triangle) = (state.next, state.first_triangle);
        state.first_triangle += self.sources.get(number)?.triangles;
        state.next += 1;
        Some((number, first_triangle))
    }

    fn lock(&self) -> MutexGuard<'_, State<'a, 'o>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State<'_, '_> {
    /// Takes a built piece, and adds all to the pack that are next in order. Tells how many builders are to go on.
    fn add(&mut self, number: usize, built: Result<BuiltPiece, ConvertError>) -> usize {
        let added = built.and_then(|piece| {
            self.waiting.insert(number, piece);
            while let Some(piece) = self.waiting.remove(&self.output.piece_count()) {
                self.output.add(piece, self.job)?;
            }
            Ok(())
        });
        if let Err(error) = added {
            self.error.get_or_insert(error);
        }
        1 + std::mem::take(&mut self.idle)
    }
}
