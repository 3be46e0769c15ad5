//! Files that appear whole or not at all.

use anyhow::{Context, Result};
use std::io::Write;
use std::path::Path;
use tempfile::NamedTempFile;

/// A temporary file beside `path`, to be given its name by [`rename`] when it is complete.
pub fn temporary(path: &Path) -> Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".xtask-").suffix(".partial");
    // Temporary files are private by default; what is written here is an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(path)).with_context(|| path.display().to_string())
}

/// Gives a complete temporary file its name.
pub fn rename(file: NamedTempFile, path: &Path) -> Result<()> {
    file.persist(path).map_err(|e| e.error).with_context(|| path.display().to_string())?;
    Ok(())
}

/// Writes all of a file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = temporary(path)?;
    file.write_all(bytes).with_context(|| path.display().to_string())?;
    rename(file, path)
}

/// The folder that holds `path`.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
