//! The programs that are compared: found, started, and what they print read.

use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where they are.
pub struct Programs {
    /// Traces rays with Embree; prints the same keys as `raystrips trace --json`.
    pub embree_trace: PathBuf,
    /// Makes ray files of a model.
    pub make_rays: PathBuf,
    /// Ours.
    pub raystrips: PathBuf,
    /// Whether ours can trace packets.
    pub has_packets: bool,
}

impl Programs {
    /// Looks for the peers in `peers`, and for ours beside the program that runs.
    pub fn find(peers: Option<&str>) -> Result<Programs> {
        let peers =
            peers.map(PathBuf::from).or_else(|| std::env::var_os("RAYSTRIPS_PEERS").map(PathBuf::from));
        let peers = peers.context(
            "where Embree is, is not known; build it with peers/setup.sh FOLDER, then give --peers FOLDER or set \
             RAYSTRIPS_PEERS",
        )?;
        // Commands without a slash would be looked for elsewhere.
        let peers = std::path::absolute(&peers).with_context(|| peers.display().to_string())?;
        let peer = |name: &str| existing(peers.join(name), "build it with peers/setup.sh FOLDER");
        let raystrips = raystrips()?;
        let help = output(Command::new(&raystrips).args(["trace", "--help"]))?;
        Ok(Programs {
            embree_trace: peer("embree_trace")?,
            make_rays: peer("make_rays")?,
            raystrips,
            has_packets: help.contains("--packets"),
        })
    }
}

/// Ours, beside the program that runs.
pub fn raystrips() -> Result<PathBuf> {
    let here = std::env::current_exe().context("the folder of this program is not known")?;
    let ours = here.with_file_name(format!("raystrips{}", std::env::consts::EXE_SUFFIX));
    existing(ours, "build it first: cargo build --release -p raystrips")
}

fn existing(path: PathBuf, cure: &str) -> Result<PathBuf> {
    if !path.is_file() {
        bail!("{}: there is no such program; {cure}", path.display());
    }
    Ok(path)
}

/// What a command prints; an error with the last line of its complaint where it fails.
pub fn output(command: &mut Command) -> Result<String> {
    let name = Path::new(command.get_program()).display().to_string();
    let output = command.output().with_context(|| name.clone())?;
    if !output.status.success() {
        let complaint = String::from_utf8_lossy(&output.stderr);
        bail!("{name}: {}", complaint.lines().last().unwrap_or("failed without a word"));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The JSON object that a command prints.
pub fn json(command: &mut Command) -> Result<Value> {
    let name = Path::new(command.get_program()).display().to_string();
    let text = output(command)?;
    serde_json::from_str(&text).with_context(|| format!("{name}: prints no JSON"))
}

/// A number of such an object.
pub fn number(object: &Value, key: &str) -> Result<f64> {
    object[key].as_f64().with_context(|| format!("there is no number '{key}' in {object}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_that_are_not_there_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let error = Programs::find(folder.path().to_str()).err().unwrap().to_string();
        assert!(error.contains("build it"), "{error}");
    }

    #[test]
    fn numbers() {
        let object = serde_json::json!({"a": 1.5, "b": "x"});
        assert_eq!(number(&object, "a").unwrap(), 1.5);
        assert!(number(&object, "b").is_err() && number(&object, "c").is_err());
    }
}
