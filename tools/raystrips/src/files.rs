//! Files that appear whole or not at all, and errors that name them.

use anyhow::{Context, Result, bail};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Refuses, before any work, an output that cannot be written or would take the place of an input.
pub fn check_output(path: &Path, inputs: &[&Path]) -> Result<()> {
    if path.is_dir() || path.file_name().is_none() {
        bail!("{}: is a folder; name a file in it", path.display());
    }
    if !folder_of(path).is_dir() {
        bail!("{}: there is no such folder; make it first", path.display());
    }
    let same =
        |input: &&Path| matches!((input.canonicalize(), path.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if inputs.iter().any(same) {
        bail!("{}: is an input too; choose another name for the output", path.display());
    }
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Writes `bytes` to a temporary file beside `path` and renames it.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    write_through(path, |out| out.write_all(bytes))
}

/// Has `write` write to a temporary file beside `path` and renames it.
pub fn write_through(path: &Path, write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let make = || -> std::io::Result<()> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".raystrips-").suffix(".partial");
        // Temporary files are private by default; what is written here is an ordinary file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut out = BufWriter::new(builder.tempfile_in(folder_of(path))?);
        write(&mut out)?;
        let file = out.into_inner().map_err(std::io::IntoInnerError::into_error)?;
        file.persist(path).map_err(|e| e.error)?;
        Ok(())
    };
    make().with_context(|| path.display().to_string())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn outputs_have_the_permissions_of_other_files() {
        let folder = tempfile::tempdir().unwrap();
        let [ours, other] = ["ours", "other"].map(|name| folder.path().join(name));
        write_whole(&ours, b"x").unwrap();
        std::fs::write(&other, b"x").unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&other));
    }
}

/// What is behind the last dot of a name, in small letters.
pub fn extension(path: &Path) -> Option<String> {
    path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase)
}
