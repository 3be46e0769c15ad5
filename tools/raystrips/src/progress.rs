//! Progress bars, on a terminal only.

use crate::interrupt;
use crate::units::{bytes, grouped};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use raystrips_convert::{Observer, Stage};
use std::fmt::Write;
use std::sync::Mutex;

/// Shows how far a conversion has come, and ends it on an interrupt.
pub struct ConvertProgress {
    bar: ProgressBar,
    stage: Mutex<Option<Stage>>,
}

impl ConvertProgress {
    /// Shows nothing yet.
    pub fn new() -> ConvertProgress {
        ConvertProgress { bar: ProgressBar::no_length(), stage: Mutex::new(None) }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Observer for ConvertProgress {
    fn progress(&self, stage: Stage, done: u64, total: u64) {
        let mut current = self.stage.lock().unwrap_or_else(|e| e.into_inner());
        if *current != Some(stage) {
            *current = Some(stage);
            self.bar.reset();
            self.bar.set_style(style(stage == Stage::Import));
            self.bar.set_prefix(stage.name());
        }
        if self.bar.position() == 0 {
            // Work that cannot be counted may have come first; it says nothing of the rate.
            self.bar.reset_eta();
        }
        self.bar.set_length(total);
        self.bar.set_position(done);
    }

    fn is_cancelled(&self) -> bool {
        interrupt::happened()
    }
}

/// A bar for rendering, which counts samples.
pub fn render_bar(samples: u64) -> ProgressBar {
    ProgressBar::new(samples).with_style(style(false)).with_prefix("render")
}

fn style(counts_bytes: bool) -> ProgressStyle {
    let number = move |n: u64| if counts_bytes { bytes(n) } else { grouped(n) };
    let template = "{prefix:>8} {wide_bar} {done} of {all}, {rate}/s, {eta} left";
    let style = ProgressStyle::with_template(template).expect("the template is well-formed");
    style
        .with_key("done", move |s: &ProgressState, w: &mut dyn Write| _ = write!(w, "{}", number(s.pos())))
        .with_key("all", move |s: &ProgressState, w: &mut dyn Write| {
            _ = write!(w, "{}", number(s.len().unwrap_or(0)))
        })
        .with_key("rate", move |s: &ProgressState, w: &mut dyn Write| {
            _ = write!(w, "{}", number(s.per_sec() as u64))
        })
}
