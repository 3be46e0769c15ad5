//! Tasks of the workspace that are no part of the program: `cargo xtask help` lists them.

// Printing is what tasks are run for.
#![allow(clippy::print_stdout)]

mod cache;
mod clock;
mod compare;
mod flags;
mod output;
mod paper;
mod rays;
mod sample_mesh;
mod scene;
mod simulation;
mod table;
mod tidy;

use anyhow::{Result, bail};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Something to be run by name.
struct Task {
    name: &'static str,
    help: &'static str,
    /// Gets the root of the repository and the arguments after the name.
    run: fn(&Path, &[String]) -> Result<ExitCode>,
}

const TASKS: &[Task] = &[
    Task {
        name: "tidy",
        help: "check what the compiler does not: crate arrows, manifests, documentation, links, sizes",
        run: tidy::task,
    },
    Task {
        name: "table",
        help: "print a table: cargo run --release -p xtask -- table basics|memory|hierarchy|single|packet|construction|proxy MODEL... or table massive -o DIR",
        run: table::task,
    },
    Task {
        name: "simplify",
        help: "simplify a model in memory with one of the kernels of table proxy: simplify KERNEL IN OUT.ply TRIANGLES",
        run: table::proxy::kernels::task,
    },
    Task {
        name: "compare",
        help: "ours beside Embree on the same rays, or beside Mitsuba in pictures; run with --release: compare embree [--peers DIR] MODEL.ply... or compare mitsuba -o DIR",
        run: compare::task,
    },
    Task {
        name: "scene",
        help: "make a scene of any size; run with --release: scene atrium|cornell|isosurface|pipes|statue --triangles N -o DIR [--seed S]",
        run: scene::task,
    },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    run(&arguments).unwrap_or_else(|error| {
        eprintln!("xtask: error: {error:#}");
        ExitCode::FAILURE
    })
}

fn run(arguments: &[String]) -> Result<ExitCode> {
    let Some((name, rest)) = arguments.split_first() else {
        eprint!("{}", help());
        return Ok(ExitCode::from(2));
    };
    if matches!(name.as_str(), "help" | "--help" | "-h") {
        print!("{}", help());
        return Ok(ExitCode::SUCCESS);
    }
    match TASKS.iter().find(|task| task.name == name) {
        Some(task) => (task.run)(&repository_root(), rest),
        None => bail!("there is no task '{name}'; `cargo xtask help` lists them"),
    }
}

fn help() -> String {
    let tasks: String = TASKS.iter().map(|task| format!("  {:10} {}\n", task.name, task.help)).collect();
    format!("usage: cargo xtask TASK [ARGUMENT...]\n\n{tasks}  {:10} print this\n", "help")
}

fn repository_root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().expect("xtask is a folder of the repository").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_are_found_by_name() {
        let run = |name: &str| run(&[name.to_owned()]);
        assert!(run("help").is_ok());
        assert!(run("tidi").unwrap_err().to_string().contains("no task 'tidi'"));
        assert!(help().contains("tidy"));
    }
}
