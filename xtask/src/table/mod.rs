//! `cargo xtask table NAME MODEL...`: prints a table of docs/RESULTS.md.

mod basics;
mod construction;
mod contestants;
mod gltf;
mod hair;
mod hierarchy;
mod instances;
mod layout;
mod light;
mod limited;
mod massive;
mod memory;
mod models;
mod orders;
mod plot;
pub mod proxy;
mod scratch_watch;
mod speed;

use anyhow::{Result, bail};
use std::path::Path;
use std::process::ExitCode;

/// Prints the table that the first argument names.
pub fn task(root: &Path, arguments: &[String]) -> Result<ExitCode> {
    let (name, models) = match arguments.split_first() {
        Some((name, models)) => (name.as_str(), models),
        None => ("", arguments),
    };
    match name {
        "basics" if !models.is_empty() => basics::print(models)?,
        "memory" => memory::print(models)?,
        "hierarchy" => hierarchy::print(models)?,
        "single" => speed::print(models, speed::Kind::Single)?,
        "packet" => speed::print(models, speed::Kind::Packet)?,
        "construction" => construction::print(models)?,
        "proxy" if !models.is_empty() => proxy::print(models)?,
        "layout" => layout::print(models)?,
        "light" => light::print(root)?,
        "gltf" => gltf::print(models)?,
        "hair" if !models.is_empty() => hair::print(models)?,
        "instances" => instances::print(models)?,
        "massive" => massive::print(models)?,
        "orderings" | "buffer" | "proxy-size" | "io" | "memory-share" | "threads" | "multi-bvh" | "small" => {
            orders::print(name, models)?;
        }
        _ => bail!(
            "usage: cargo xtask table basics MODEL...\n       \
             cargo xtask table memory|hierarchy|single|packet|construction [MODEL...]\n       \
             cargo xtask table light\n       \
             cargo xtask table hair SCENE...\n       {}\n       {}\n       {}\n       {}\n       {}\n       {}",
            gltf::USAGE,
            instances::USAGE,
            layout::USAGE,
            proxy::USAGE,
            massive::USAGE,
            orders::USAGE
        ),
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_the_generated_mesh() {
        memory::print(&[]).unwrap();
        hierarchy::print(&[]).unwrap();
    }

    #[test]
    fn unknown_tables_are_refused() {
        let run = |name: &str| task(Path::new("."), &[name.to_owned()]);
        assert!(run("memories").unwrap_err().to_string().contains("memory|hierarchy"));
        assert!(run("basics").is_err());
    }
}
