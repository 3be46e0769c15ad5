//! No unfinished code, and no test that is left out without a reason.

use super::code::code_only;
use super::{Finding, TextFile};

/// What must not be in code, and what to do instead.
const MARKERS: &[(&str, &str)] = &[
    ("todo!", "finish it"),
    ("unimplemented!", "finish it"),
    ("dbg!", "remove it"),
    ("#[ignore]", "give the reason: #[ignore = \"...\"]"),
];

/// A finding for every marker in the code of `file`.
pub fn check(file: &TextFile) -> Vec<Finding> {
    let code = code_only(&file.text);
    let lines = code.lines().enumerate();
    let found = lines.flat_map(|(i, line)| {
        let here = MARKERS.iter().filter(move |(marker, _)| contains_word(line, marker));
        here.map(move |(marker, cure)| Finding::new(&file.path, i + 1, format!("{marker}: {cure}")))
    });
    found.collect()
}

/// True where `marker` is not the end of a longer word.
fn contains_word(line: &str, marker: &str) -> bool {
    line.match_indices(marker).any(|(at, _)| !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_are_found_in_code_only() {
        let lines = |text: &str| -> Vec<usize> {
            check(&TextFile { path: "a.rs".into(), text: text.into() }).iter().map(|f| f.line).collect()
        };
        assert_eq!(lines("fn a() {\n    todo!();\n    dbg!(1);\n}\n"), [2, 3]);
        assert_eq!(lines("#[test]\n#[ignore]\nfn a() { unimplemented!() }\n"), [2, 3]);
        assert!(lines("// todo!\nlet a = \"dbg!\"; #[ignore = \"slow\"]\nnot_todo!();\n").is_empty());
    }
}
