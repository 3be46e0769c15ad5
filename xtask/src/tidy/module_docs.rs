//! Every module begins with what it is for.

use super::{Finding, TextFile};

/// A finding unless the first line is documentation of the module.
pub fn check(file: &TextFile) -> Option<Finding> {
    let first = file.text.lines().next().unwrap_or_default();
    let documented = first.strip_prefix("//!").is_some_and(|text| !text.trim().is_empty());
    (!documented).then(|| Finding::new(&file.path, 1, "begin with a `//!` line that says what this is for"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_line_counts() {
        let check = |text: &str| check(&TextFile { path: "a.rs".into(), text: text.into() });
        assert_eq!(check("//! Words.\n"), None);
        for text in ["", "fn main() {}\n", "//!\n", "// Words.\n", "\n//! Words.\n"] {
            assert_eq!(check(text).unwrap().line, 1, "{text}");
        }
    }
}
