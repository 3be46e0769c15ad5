//! `cargo xtask tidy`: checks of the repository itself. Each check is a module; all of them run, and all that
//! they find is printed.

mod code;
mod crates;
mod layering;
mod length;
mod links;
mod manifests;
mod markers;
mod module_docs;
mod repository;

use anyhow::{Result, bail};
use repository::{Repository, TextFile};
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Finding {
    /// Seen from the root of the repository.
    path: PathBuf,
    /// Counted from 1.
    line: usize,
    what: String,
}

impl Finding {
    fn new(path: &Path, line: usize, what: impl Into<String>) -> Finding {
        Finding { path: path.to_owned(), line, what: what.into() }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.path.display(), self.line, self.what)
    }
}

/// The task.
pub fn task(root: &Path, arguments: &[String]) -> Result<ExitCode> {
    if !arguments.is_empty() {
        bail!("tidy takes no arguments");
    }
    let findings = check(root)?;
    findings.iter().for_each(|finding| println!("{finding}"));
    Ok(if findings.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs all checks.
fn check(root: &Path) -> Result<Vec<Finding>> {
    let repository = Repository::read(root)?;
    let crates = crates::read(root)?;
    let mut findings = layering::check(&crates);
    findings.extend(manifests::check(root, &crates)?);
    findings.extend(links::check(&repository));
    for file in repository.files_ending("rs") {
        findings.extend(module_docs::check(file));
        findings.extend(length::check(file));
        findings.extend(markers::check(file));
    }
    findings.sort();
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_repository_is_tidy() {
        let findings = check(&crate::repository_root()).unwrap();
        let lines: Vec<String> = findings.iter().map(Finding::to_string).collect();
        assert!(lines.is_empty(), "\n{}", lines.join("\n"));
    }

    #[test]
    fn findings_can_be_clicked() {
        assert_eq!(Finding::new(Path::new("a/b.rs"), 7, "odd").to_string(), "a/b.rs:7: odd");
    }
}
