//! Brings pages while a worker goes on with rays that need none of these.

use crate::world::World;
use raystrips_tracer::{OpenError, PageId};
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::Scope;

/// A thread that reads, seen from the worker that asks it.
pub(super) struct Reader {
    requests: Sender<Vec<PageId>>,
    answers: Receiver<Result<(), OpenError>>,
    /// What was asked for and has not come, the oldest first.
    asked: VecDeque<Vec<PageId>>,
}

impl Reader {
    /// Starts the thread, which ends with this.
    pub fn spawn<'scope>(scope: &'scope Scope<'scope, '_>, world: &'scope dyn World) -> Reader {
        let (requests, wanted) = channel::<Vec<PageId>>();
        let (brought, answers) = channel();
        scope.spawn(move || {
            for pages in wanted {
                if brought.send(world.bring(&pages)).is_err() {
                    return;
                }
            }
        });
        Reader { requests, answers, asked: VecDeque::new() }
    }

    /// Asks for the first `most` of `pages` that it was not asked for yet; false if there are none.
    pub fn ask(&mut self, mut pages: Vec<PageId>, most: usize) -> bool {
        pages.retain(|page| !self.asked.iter().flatten().any(|asked| asked == page));
        pages.truncate(most);
        let has_some = !pages.is_empty();
        if has_some {
            self.asked.push_back(pages.clone());
            self.requests.send(pages).expect("it reads until this is gone");
        }
        has_some
    }

    /// How often it was asked without having answered.
    pub fn outstanding(&self) -> usize {
        self.asked.len()
    }

    /// Waits for what it was asked for first.
    pub fn wait(&mut self) -> Result<(), OpenError> {
        self.asked.pop_front();
        self.answers.recv().expect("it answers as often as it is asked")
    }
}
