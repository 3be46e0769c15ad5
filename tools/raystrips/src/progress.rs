//! Progress bars, on a terminal only.

use crate::interrupt;
use crate::units::{bytes, duration, grouped};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use raystrips_convert::{Observer, Plan, Stage};
use raystrips_extmem::process_memory;
use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::Mutex;

/// Shows how far a conversion has come, and ends it on an interrupt.
pub struct ConvertProgress {
    bar: ProgressBar,
    stage: Mutex<Option<Stage>>,
    tells_plan: bool,
}

impl ConvertProgress {
    /// Shows nothing yet. The plan is told on a terminal, where it needs scratch files, and if `tells_plan`.
    pub fn new(tells_plan: bool) -> ConvertProgress {
        ConvertProgress { bar: ProgressBar::no_length(), stage: Mutex::new(None), tells_plan }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Observer for ConvertProgress {
    fn planned(&self, plan: &Plan) {
        if self.tells_plan || !plan.is_in_memory() || std::io::stderr().is_terminal() {
            eprintln!("raystrips: plan: {}", described(plan));
        }
    }

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

fn described(plan: &Plan) -> String {
    let about = if plan.is_exact { "" } else { "about " };
    let scratch = match plan.scratch_free {
        _ if plan.is_in_memory() => "no scratch files".to_owned(),
        Some(free) => format!(
            "{} of scratch files in {} ({} free)",
            bytes(plan.scratch_bytes),
            plan.scratch.display(),
            bytes(free)
        ),
        None => format!("{} of scratch files in {}", bytes(plan.scratch_bytes), plan.scratch.display()),
    };
    format!(
        "import, partition, distribute, build; {about}{} triangles from {}; {} of memory, {} pieces at a time; {scratch}; \
         about {}",
        grouped(plan.triangles),
        bytes(plan.input_bytes),
        bytes(plan.memory),
        plan.pieces_at_a_time,
        duration(plan.seconds),
    )
}

/// A bar for rendering, which counts samples.
pub fn render_bar(samples: u64) -> ProgressBar {
    ProgressBar::new(samples).with_style(style(false)).with_prefix("render")
}

fn style(counts_bytes: bool) -> ProgressStyle {
    let number = move |n: u64| if counts_bytes { bytes(n) } else { grouped(n) };
    let template = "{prefix:>10} {wide_bar} {done} of {all}, {rate}/s, {eta} left, {memory} in memory";
    let style = ProgressStyle::with_template(template).expect("the template is well-formed");
    style
        .with_key("done", move |s: &ProgressState, w: &mut dyn Write| _ = write!(w, "{}", number(s.pos())))
        .with_key("all", move |s: &ProgressState, w: &mut dyn Write| {
            _ = write!(w, "{}", number(s.len().unwrap_or(0)))
        })
        .with_key("memory", |_: &ProgressState, w: &mut dyn Write| {
            _ = write!(w, "{}", bytes(process_memory()))
        })
        .with_key("rate", move |s: &ProgressState, w: &mut dyn Write| {
            _ = write!(w, "{}", number(s.per_sec() as u64))
        })
}
