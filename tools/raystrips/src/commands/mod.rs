//! One module a verb.

pub mod convert;
pub mod info;
pub mod proxy;
pub mod render;
pub mod trace;
pub mod verify;

use std::io::Write;

/// Prints one JSON object to standard output.
pub fn print_json(value: &serde_json::Value) -> anyhow::Result<()> {
    writeln!(std::io::stdout(), "{value}")?;
    Ok(())
}
