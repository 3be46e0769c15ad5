//! Names of other files inside model files. They come from strangers, so they may only name files in the folder of
//! the model or below it.

use std::path::{Component, Path, PathBuf};

/// The file that `name` means when written in `model`, or why it is refused.
pub(crate) fn resolve(model: &Path, name: &str) -> Result<PathBuf, &'static str> {
    // Files from Windows separate folders by backslashes.
    let name = name.replace('\\', "/");
    if has_scheme(&name) {
        return Err("only files next to the model are read, no URLs and no drives");
    }
    if name.is_empty() || name.contains('\0') {
        return Err("is not a file name");
    }
    let mut depth = 0i64;
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
    Ok(model.parent().unwrap_or(Path::new("")).join(name))
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
    fn percent_codes() {
        assert_eq!(percent_decoded("a%20b%C3%A9%2"), "a b\u{e9}%2");
        assert_eq!(percent_decoded("%ff%"), "%ff%");
    }
}
