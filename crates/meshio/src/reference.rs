//! Names of other files inside model files. They come from strangers, so they may only name files in the folder of
//! the model or below it.

use std::path::{Component, Path, PathBuf};

/// The file that `name` means when written in `model`, or why it is refused.
pub(crate) fn resolve(model: &Path, name: &str) -> Result<PathBuf, &'static str> {
    resolve_in(model, model, name)
}

/// The same where it is written in `file`, which `model` named.
pub(crate) fn resolve_in(model: &Path, file: &Path, name: &str) -> Result<PathBuf, &'static str> {
    // Files from Windows separate folders by backslashes.
    let name = name.replace('\\', "/");
    if has_scheme(&name) {
        return Err("only files next to the model are read, no URLs and no drives");
    }
    if name.is_empty() || name.contains('\0') {
        return Err("is not a file name");
    }
    let [root, folder] = [model, file].map(|path| path.parent().unwrap_or(Path::new("")));
    let below = folder.strip_prefix(root).unwrap_or(Path::new(""));
    let mut depth = below.components().filter(|c| matches!(c, Component::Normal(_))).count() as i64;
    for component in Path::new(&name).components() {
        depth += match component {
            Component::Normal(_) => 1,
            Component::ParentDir => -1,
            Component::CurDir => 0,
            Component::RootDir | Component::Prefix(_) => return Err("absolute paths are not followed"),
        };
        if depth < 0 {
            return Err("paths out of the model's folder are not followed");
        }
    }
    let path = folder.join(name);
    match is_below(root, &path) {
        true => Ok(path),
        false => Err("links out of the model's folder are not followed; copy the file there"),
    }
}

/// False for what is elsewhere by way of a link.
fn is_below(root: &Path, path: &Path) -> bool {
    let root = if root == Path::new("") { Path::new(".") } else { root };
    // What is not there cannot be read either.
    let (Ok(root), Ok(path)) = (root.canonicalize(), path.canonicalize()) else { return true };
    path.starts_with(root)
}

/// True for `https:...` and `C:...`.
fn has_scheme(name: &str) -> bool {
    name.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    })
}

/// `text` with `%20` and the like decoded; as it stands where that gives no UTF-8.
pub(crate) fn percent_decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        let hex = |c: &u8| (*c as char).to_digit(16);
        match (first, tail) {
            (b'%', [high, low, after @ ..]) if hex(high).is_some() && hex(low).is_some() => {
                bytes.push((hex(high).unwrap_or(0) * 16 + hex(low).unwrap_or(0)) as u8);
                rest = after;
            }
            _ => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_below_the_model_are_named() {
        let resolve = |name| resolve(Path::new("dir/a.gltf"), name);
        assert_eq!(resolve("b.bin"), Ok("dir/b.bin".into()));
        assert_eq!(resolve("sub\\b.bin"), Ok("dir/sub/b.bin".into()));
        assert_eq!(resolve("sub/../b.bin"), Ok("dir/sub/../b.bin".into()));
        for name in
            ["", "../b", "sub/../../b", "/etc/passwd", "C:\\b", "http://x/b", "file:b", "..\\b", "a\0b"]
        {
            assert!(resolve(name).is_err(), "{name}");
        }
    }

    #[test]
    fn files_of_files_are_below_the_model_too() {
        let resolve = |name| resolve_in(Path::new("dir/a.obj"), Path::new("dir/mtl/a.mtl"), name);
        assert_eq!(resolve("b.png"), Ok("dir/mtl/b.png".into()));
        assert_eq!(resolve("../b.png"), Ok("dir/mtl/../b.png".into()));
        assert!(resolve("../../b.png").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_nowhere_else() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("model/sub")).unwrap();
        std::fs::write(at("secret"), "").unwrap();
        std::fs::write(at("model/sub/b"), "").unwrap();
        for (target, name) in [("../secret", "link"), ("sub/b", "inside"), ("..", "up")] {
            std::os::unix::fs::symlink(target, at("model").join(name)).unwrap();
        }
        let resolve = |name| resolve(&at("model/a.gltf"), name);
        assert!(resolve("link").is_err() && resolve("up/secret").is_err() && resolve("sub/../link").is_err());
        assert!(resolve("inside").is_ok() && resolve("sub/b").is_ok() && resolve("missing").is_ok());
    }

    #[test]
    fn percent_codes() {
        assert_eq!(percent_decoded("a%20b%C3%A9%2"), "a b\u{e9}%2");
        assert_eq!(percent_decoded("%ff%"), "%ff%");
    }
}
