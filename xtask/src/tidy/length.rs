//! Files stay short enough to be read at a sitting.

use super::{Finding, TextFile};

/// Longer files are better split, tests and tables first.
const MAX_LINES: usize = 600;

/// A finding for a file that is too long, at the first line that is too many.
pub fn check(file: &TextFile) -> Option<Finding> {
    let lines = file.text.lines().count();
    let what = format!("{lines} lines, {MAX_LINES} at most; split the file");
    (lines > MAX_LINES).then(|| Finding::new(&file.path, MAX_LINES + 1, what))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_line_too_many() {
        let check = |lines| check(&TextFile { path: "a.rs".into(), text: "//\n".repeat(lines) });
        assert_eq!(check(MAX_LINES), None);
        assert_eq!(check(MAX_LINES + 1).unwrap().line, MAX_LINES + 1);
    }
}
