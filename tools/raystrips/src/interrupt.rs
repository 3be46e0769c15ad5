//! Ctrl-C and termination: the first one lets work end and clean up after itself, the second ends at once.

use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Exit status of a shell for a program ended by Ctrl-C.
const INTERRUPTED_STATUS: i32 = 130;

/// From now on interrupts are noted.
pub fn watch() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            exit();
        }
    })?;
    Ok(())
}

/// Ends the process the way an interrupt does.
pub fn exit() -> ! {
    std::process::exit(INTERRUPTED_STATUS);
}

/// True once there was one.
pub fn happened() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}
