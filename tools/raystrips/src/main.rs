//! The command line of raystrips: flags and glue. All real work is in the crates.

mod args;
mod cache;
mod camera;
mod commands;
mod files;
mod interrupt;
mod process;
mod progress;
mod rendering;
mod residency;
mod unfinished;
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
        Command::Proxy(args) => commands::proxy::run(args),
        Command::Render(args) => commands::render::run(args),
        Command::Trace(args) => commands::trace::run(args),
        Command::Info(args) => commands::info::run(args),
        Command::Verify(args) => commands::verify::run(args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("raystrips: error: {}", one_line(&error));
            ExitCode::from(FAILED)
        }
    }
}

/// The error with its causes on one line, each said once: some messages tell their cause themselves.
fn one_line(error: &anyhow::Error) -> String {
    let mut message = String::new();
    for cause in error.chain().map(|cause| cause.to_string().replace(['\n', '\r'], " ")) {
        if !message.contains(&cause) {
            let separator = if message.is_empty() { "" } else { ": " };
            message.push_str(separator);
            message.push_str(&cause);
        }
    }
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_are_said_once() {
        let error = anyhow::anyhow!("disk\nfull").context("a.rsp: disk full").context("b");
        assert_eq!(one_line(&error), "b: a.rsp: disk full");
    }
}
