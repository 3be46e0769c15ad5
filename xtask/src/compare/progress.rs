//! A line on standard error that tells how far a long task is; only on a terminal.

use std::io::{IsTerminal, Write};

/// Counts steps.
pub struct Progress {
    done: usize,
    total: usize,
    shown: bool,
}

impl Progress {
    /// Of so many steps.
    pub fn new(total: usize) -> Progress {
        Progress { done: 0, total, shown: std::io::stderr().is_terminal() }
    }

    /// Tells what is begun.
    pub fn step(&mut self, what: &str) {
        self.done += 1;
        self.show(&format!("{}/{} {what}", self.done, self.total));
    }

    fn show(&self, line: &str) {
        if self.shown {
            // Back to the begin of the line, which is cleared.
            let _ = write!(std::io::stderr(), "\r\x1b[K{line}");
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.show("");
    }
}
