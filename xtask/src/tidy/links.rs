//! Relative links in Markdown lead to files of the repository, and their anchors to headings.

use super::repository::{Repository, normalized};
use super::{Finding, TextFile};
use std::path::Path;

/// Every link that leads nowhere.
pub fn check(repository: &Repository) -> Vec<Finding> {
    let check_file = |file| {
        let broken = links(file).filter_map(move |(line, target)| {
            let what = problem(repository, file, &target)?;
            Some(Finding::new(&file.path, line, format!("link to {target}: {what}")))
        });
        broken.collect::<Vec<_>>()
    };
    repository.files_ending("md").flat_map(check_file).collect()
}

/// What is wrong with a link in `file`, if anything.
fn problem(repository: &Repository, file: &TextFile, target: &str) -> Option<&'static str> {
    if target.split_once(':').is_some_and(|(scheme, _)| scheme.chars().all(|c| c.is_ascii_alphabetic())) {
        return None;
    }
    let (name, anchor) = target.split_once('#').map_or((target, None), |(name, anchor)| (name, Some(anchor)));
    let folder = file.path.parent().unwrap_or(Path::new(""));
    let path = if name.is_empty() { Some(file.path.clone()) } else { normalized(&folder.join(name)) };
    let Some(path) = path else { return Some("leads out of the repository") };
    if !repository.contains(&path) {
        return Some("there is no such file");
    }
    let has_heading = |anchor| match repository.text(&path) {
        Some(text) if path.extension().is_some_and(|e| e == "md") => anchors(text).any(|a| a == anchor),
        _ => true,
    };
    anchor.filter(|anchor| !has_heading(*anchor)).map(|_| "there is no such heading")
}

/// Line numbers and targets of `[text](target)` and `[name]: target`.
fn links(file: &TextFile) -> impl Iterator<Item = (usize, String)> {
    prose_lines(file).flat_map(|(line, text)| {
        let inline = text.match_indices("](").filter_map(|(at, _)| target(&text[at + 2..], ')'));
        let defined = text.trim_start().strip_prefix('[').and_then(|t| t.split_once("]:"));
        let defined = defined.and_then(|(_, t)| target(&format!("{} ", t.trim_start()), ' '));
        inline.chain(defined).map(|t| (line, t)).collect::<Vec<_>>()
    })
}

/// The target at the start of `text`, without a title.
fn target(text: &str, end: char) -> Option<String> {
    let (target, _) = text.split_once(end)?;
    let target = target.split_whitespace().next()?;
    Some(target.trim_start_matches('<').trim_end_matches('>').to_owned())
}

/// Anchors of the headings, the way code hosts make them: `## The file` is `#the-file`.
fn anchors(file: &TextFile) -> impl Iterator<Item = String> {
    let headings = prose_lines(file).filter(|(_, text)| text.starts_with('#'));
    headings.map(|(_, text)| {
        let kept = text.trim_start_matches('#').trim().to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    })
}

/// Numbered lines outside of code blocks, without code in backticks.
fn prose_lines(file: &TextFile) -> impl Iterator<Item = (usize, String)> {
    let mut in_code = false;
    file.text.lines().enumerate().filter_map(move |(i, line)| {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
            return None;
        }
        // Headings may hold code that belongs to their anchors.
        let is_heading = line.starts_with('#');
        let prose = if is_heading { line.replace('`', "") } else { line.split('`').step_by(2).collect() };
        (!in_code).then_some((i + 1, prose))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn broken(text: &str) -> Vec<String> {
        let other = ("crates/pack/FORMAT.md", "# Format\n\n## The `Big` file, drawn\n");
        let repository = Repository::of(&[("docs/a.md", text), other, ("crates/pack/src/lib.rs", "")]);
        check(&repository).iter().map(Finding::to_string).collect()
    }

    #[test]
    fn links_that_lead_somewhere() {
        let good = "# Here\n[a](../crates/pack/FORMAT.md) [b](<../crates/pack/FORMAT.md#the-big-file-drawn> \"title\")\n\
                    [c](#here) [d](https://example.org/x#y) ![e](../crates/pack/src) [f](mailto:a@example.org)\n\
                    `[g](nowhere)`\n```text\n[h](nowhere)\n```\n[i]: ../crates/pack/src/lib.rs\n";
        assert_eq!(broken(good), [""; 0]);
    }

    #[test]
    fn links_that_do_not() {
        assert_eq!(broken("\n[a](b.md)\n"), ["docs/a.md:2: link to b.md: there is no such file"]);
        assert_eq!(
            broken("[a](../../b.md)"),
            ["docs/a.md:1: link to ../../b.md: leads out of the repository"]
        );
        assert_eq!(broken("[a](#b)"), ["docs/a.md:1: link to #b: there is no such heading"]);
        assert!(broken("[a](../crates/pack/FORMAT.md#b)")[0].ends_with("no such heading"));
        assert!(broken("[a]: b.md")[0].ends_with("no such file"));
    }
}
