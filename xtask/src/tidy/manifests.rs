//! Every Cargo.toml describes its crate and takes license and lints from the workspace.

use super::Finding;
use super::crates::Crate;
use anyhow::{Context, Result};
use std::path::Path;
use toml::Table;

/// Keys that every crate inherits.
const INHERITED: [&str; 2] = ["license", "lints"];

/// What is missing in the manifests of `crates`.
pub fn check(root: &Path, crates: &[Crate]) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    for Crate { manifest, .. } in crates {
        let text =
            std::fs::read_to_string(root.join(manifest)).with_context(|| manifest.display().to_string())?;
        let missing = missing(&text).with_context(|| manifest.display().to_string())?;
        findings.extend(missing.into_iter().map(|what| Finding::new(manifest, 1, what)));
    }
    Ok(findings)
}

fn missing(text: &str) -> Result<Vec<String>> {
    let manifest: Table = text.parse()?;
    let package = manifest.get("package").and_then(toml::Value::as_table).context("no [package]")?;
    let mut missing = Vec::new();
    let description = package.get("description").and_then(toml::Value::as_str);
    if description.is_none_or(|text| text.trim().is_empty()) {
        missing.push("description is missing".to_owned());
    }
    for key in INHERITED {
        // `lints` is a table of its own, the others belong to the package.
        let value = package.get(key).or_else(|| manifest.get(key));
        if value.and_then(|v| v.get("workspace")).and_then(toml::Value::as_bool) != Some(true) {
            missing.push(format!("{key}.workspace = true is missing"));
        }
    }
    Ok(missing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_found() {
        let good = "[package]\ndescription = 'a'\nlicense.workspace = true\n[lints]\nworkspace = true\n";
        assert!(missing(good).unwrap().is_empty());
        assert_eq!(missing(&good.replace("'a'", "' '")).unwrap(), ["description is missing"]);
        assert_eq!(
            missing("[package]\ndescription = 'a'\nlicense = 'MIT'\n").unwrap(),
            ["license.workspace = true is missing", "lints.workspace = true is missing"]
        );
        assert!(missing("[workspace]").is_err());
    }
}
