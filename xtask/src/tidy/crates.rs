//! The crates of the workspace and their arrows, as cargo tells them.

use super::repository::normalized;
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A crate of the workspace.
pub struct Crate {
    pub name: String,
    /// Its Cargo.toml, seen from the root of the repository.
    pub manifest: PathBuf,
    /// Crates of the workspace that it depends on outside of its tests, by name.
    pub uses: Vec<String>,
}

/// All crates of the workspace at `root`.
pub fn read(root: &Path) -> Result<Vec<Crate>> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--offline", "--no-deps"])
        .current_dir(root)
        .output()
        .context("cannot run cargo metadata")?;
    if !output.status.success() {
        bail!("cargo metadata: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    parse(&serde_json::from_slice(&output.stdout).context("cargo metadata")?).context("cargo metadata")
}

fn parse(metadata: &Value) -> Result<Vec<Crate>> {
    let root = text(metadata, "workspace_root")?;
    let packages = list(metadata, "packages")?;
    let names: Vec<&str> = packages.iter().map(|package| text(package, "name")).collect::<Result<_>>()?;
    let read = |package: &Value| -> Result<Crate> {
        let manifest = Path::new(text(package, "manifest_path")?).strip_prefix(root)?;
        let mut uses = Vec::new();
        for dependency in list(package, "dependencies")? {
            let name = text(dependency, "name")?;
            // Dependencies of tests have the kind "dev"; those of build scripts count.
            if names.contains(&name) && dependency["kind"] != "dev" {
                uses.push(name.to_owned());
            }
        }
        let manifest = normalized(manifest).context("a crate is outside of the repository")?;
        Ok(Crate { name: text(package, "name")?.to_owned(), manifest, uses })
    };
    packages.iter().map(read).collect()
}

fn text<'a>(value: &'a Value, key: &str) -> Result<&'a str> {
    value[key].as_str().with_context(|| format!("no '{key}'"))
}

fn list<'a>(value: &'a Value, key: &str) -> Result<&'a [Value]> {
    value[key].as_array().map(Vec::as_slice).with_context(|| format!("no '{key}'"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn only_arrows_of_the_program_are_read() {
        let metadata = json!({"workspace_root": "/w", "packages": [
            {"name": "a", "manifest_path": "/w/crates/a/Cargo.toml", "dependencies": [
                {"name": "b", "kind": null}, {"name": "c", "kind": "dev"}, {"name": "serde", "kind": null},
            ]},
            {"name": "b", "manifest_path": "/w/crates/b/Cargo.toml", "dependencies": [{"name": "c", "kind": "build"}]},
            {"name": "c", "manifest_path": "/w/c/Cargo.toml", "dependencies": []},
        ]});
        let crates = parse(&metadata).unwrap();
        assert_eq!(crates[0].manifest, Path::new("crates/a/Cargo.toml"));
        assert_eq!(crates[0].uses, ["b"]);
        assert_eq!(crates[1].uses, ["c"]);
        assert!(crates[2].uses.is_empty());
        assert!(parse(&json!({"packages": []})).is_err());
    }
}
