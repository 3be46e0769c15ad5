//! The command line of raystrips: flags and glue. All real work is in the crates.

mod args;
mod cache;
mod camera;
mod commands;
mod files;
mod interrupt;
mod process;
mod progress;
mod units;

use args::{Arguments, Command};
use clap::Parser;
use std::process::ExitCode;

/// The command did not do what it was asked to, or found damage.
const FAILED: u8 = 1;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match &arguments.command {
        Command::Convert(args) => commands::convert::run(args),
        Command::Render(args) => commands::render::run(args),
        Command::Trace(args) => commands::trace::run(args),
        Command::Info(args) => commands::info::run(args),
        Command::Verify(args) => commands::verify::run(args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // One line, whatever a library put into its message.
            let message = format!("{error:#}").replace(['\n', '\r'], " ");
            eprintln!("raystrips: error: {message}");
            ExitCode::from(FAILED)
        }
    }
}
