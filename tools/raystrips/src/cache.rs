//! Packs of models that `render` was given, kept so that the next picture need not convert again.
//!
//! A pack is named by a hash of the model's full path and of what decides on its bytes; beside it lies a list
//! of the files that were read, or missed, with their lengths and times. It is used again while all of them are unchanged.

use crate::args::{ConvertOptions, SourceOptions};
use crate::commands::convert::{convert_with, notes, tell};
use crate::files::write_whole;
use anyhow::{Context, Result};
use raystrips_convert::FileStamp;
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// The pack of `model`, converted now unless the one in the cache is still good.
pub fn pack_of(
    model: &Path,
    cache: Option<&Path>,
    options: &ConvertOptions,
    threads: usize,
) -> Result<PathBuf> {
    let folder = match cache {
        Some(folder) => folder.to_owned(),
        None => default_folder().context("no cache folder is known; name one with --cache")?,
    };
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let model = model.canonicalize().with_context(|| model.display().to_string())?;
    let name = format!("{:016x}", key(&model, options));
    let pack = folder.join(format!("{name}.rsp"));
    let list = folder.join(format!("{name}.json"));
    match kept(&list).filter(|kept| pack.is_file() && kept.is_fresh()) {
        Some(kept) => tell(&kept.notes),
        None => {
            let report = convert_with(std::slice::from_ref(&model), &pack, options, threads)?;
            let notes = notes(&report);
            write_whole(&list, &serde_json::to_vec_pretty(&Kept { files: report.files, notes })?)?;
        }
    }
    Ok(pack)
}

/// What is known of a pack in the cache.
#[derive(Serialize, Deserialize)]
struct Kept {
    files: Vec<FileStamp>,
    /// What was told when it was made.
    notes: Vec<String>,
}

impl Kept {
    fn is_fresh(&self) -> bool {
        !self.files.is_empty() && self.files.iter().all(FileStamp::is_current)
    }
}

fn kept(list: &Path) -> Option<Kept> {
    serde_json::from_slice(&std::fs::read(list).ok()?).ok()
}

fn default_folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let caches =
        set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache"))).or_else(|| set("LOCALAPPDATA"));
    Some(caches?.join("raystrips"))
}

fn key(model: &Path, options: &ConvertOptions) -> u64 {
    let mut hasher = DefaultHasher::new();
    (model, raystrips_pack::layout::FORMAT_VERSION, env!("CARGO_PKG_VERSION")).hash(&mut hasher);
    let ConvertOptions {
        page_size,
        layout,
        keep_ids,
        strip_windows,
        positions,
        no_proxy,
        proxy_ratio,
        proxy_memory,
        no_instances,
        source,
    } = options;
    (page_size, layout.layout(), keep_ids, strip_windows, positions).hash(&mut hasher);
    (no_proxy, proxy_ratio.to_bits(), proxy_memory, no_instances).hash(&mut hasher);
    let SourceOptions { drop_out_of_range, strand_width, bare, memory: _, scratch: _, restart: _ } = source;
    (drop_out_of_range, strand_width.map(f64::to_bits), bare).hash(&mut hasher);
    hasher.finish()
}
