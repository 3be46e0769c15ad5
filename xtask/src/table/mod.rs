//! `cargo xtask table NAME MODEL...`: prints a table of docs/RESULTS.md.

mod basics;

use anyhow::{Result, bail};
use std::path::Path;
use std::process::ExitCode;

/// Prints the table that the first argument names.
pub fn task(_root: &Path, arguments: &[String]) -> Result<ExitCode> {
    match arguments.split_first() {
        Some((name, models)) if name == "basics" && !models.is_empty() => basics::print(models)?,
        _ => bail!("usage: cargo xtask table basics MODEL..."),
    }
    Ok(ExitCode::SUCCESS)
}
