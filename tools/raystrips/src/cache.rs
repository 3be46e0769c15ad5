//! Packs of models that `render` was given, kept so that the next picture need not convert again.
//!
//! A pack is named by a hash of the model's full path and of what decides on its bytes; beside it lies a list
//! of the files that were read with their lengths and times. It is used again while all of them are unchanged.

use crate::args::ConvertOptions;
use crate::commands::convert::convert_with;
use crate::files::write_whole;
use anyhow::{Context, Result};
use raystrips_convert::FileStamp;
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
    if !is_fresh(&pack, &list) {
        let report = convert_with(std::slice::from_ref(&model), &pack, options, threads)?;
        write_whole(&list, &serde_json::to_vec_pretty(&report.files)?)?;
    }
    Ok(pack)
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
    let ConvertOptions { page_size, layout, keep_ids, strip_windows, positions, source, .. } = options;
    (page_size, layout.layout(), keep_ids, strip_windows, positions).hash(&mut hasher);
    (source.drop_out_of_range, source.strand_width.map(f64::to_bits), source.bare).hash(&mut hasher);
    options.proxies().map(|proxies| (proxies.ratio.to_bits(), proxies.memory)).hash(&mut hasher);
    hasher.finish()
}

fn is_fresh(pack: &Path, list: &Path) -> bool {
    let recorded = || -> Option<Vec<FileStamp>> { serde_json::from_slice(&std::fs::read(list).ok()?).ok() };
    pack.is_file() && recorded().is_some_and(|all| !all.is_empty() && all.iter().all(FileStamp::is_current))
}
