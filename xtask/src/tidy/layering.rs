//! Which crate may depend on which. Dependencies of tests are free.

use super::Finding;
use super::crates::Crate;
use std::collections::BTreeSet;

/// Names of the crates under `crates/` without their prefix, and what they may use. A new arrow between crates is
/// a decision: it belongs here first.
const ARROWS: &[(&str, &[&str])] = &[
    ("geom", &[]),
    ("extmem", &[]),
    ("meshio", &["geom"]),
    ("strips", &["geom"]),
    ("simplify", &["geom"]),
    ("layout", &["geom"]),
    ("pack", &["geom"]),
    ("convert", &["geom", "extmem", "meshio", "strips", "simplify", "layout", "pack"]),
    ("paging", &["geom", "extmem", "pack"]),
    ("tracer", &["geom", "pack", "paging"]),
    ("reorder", &["geom", "extmem"]),
    ("render", &["geom", "extmem", "tracer", "reorder"]),
];

/// Crates that join all others.
const FREE: [&str; 2] = ["raystrips", "xtask"];

/// The running side.
const RUNNING: [&str; 4] = ["paging", "tracer", "reorder", "render"];

/// Crates of the preparing side, which meets the running side only in `pack` and `geom`.
const PREPARING: [&str; 5] = ["meshio", "strips", "simplify", "layout", "convert"];

/// Every arrow that is not allowed.
pub fn check(crates: &[Crate]) -> Vec<Finding> {
    let mut findings: Vec<Finding> = crates.iter().flat_map(check_arrows).collect();
    findings.extend(crates.iter().flat_map(|c| check_sides(c, crates)));
    findings
}

fn check_arrows(of: &Crate) -> Vec<Finding> {
    if FREE.contains(&of.name.as_str()) {
        return Vec::new();
    }
    let Some((_, allowed)) = ARROWS.iter().find(|(name, _)| *name == short(&of.name)) else {
        let what = format!("{} is not in the table of crates; add what it may use", of.name);
        return vec![Finding::new(&of.manifest, 1, what)];
    };
    let wrong = of.uses.iter().filter(|used| !allowed.contains(&short(used)));
    let finding = |used: &String| {
        let allowed = if allowed.is_empty() { "no crate".to_owned() } else { allowed.join(", ") };
        Finding::new(&of.manifest, 1, format!("{} must not use {used}; it may use {allowed}", of.name))
    };
    wrong.map(finding).collect()
}

fn check_sides(of: &Crate, crates: &[Crate]) -> Vec<Finding> {
    if !RUNNING.contains(&short(&of.name)) {
        return Vec::new();
    }
    let reached = reached_from(of, crates);
    let wrong = reached.into_iter().filter(|name| PREPARING.contains(&short(name)));
    let what = |name: &str| format!("{} runs and must not lead to {name}, which prepares", of.name);
    wrong.map(|name| Finding::new(&of.manifest, 1, what(name))).collect()
}

/// All crates that `of` uses, and that those use.
fn reached_from<'a>(of: &'a Crate, crates: &'a [Crate]) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut to_visit = vec![of];
    while let Some(next) = to_visit.pop() {
        for name in &next.uses {
            if reached.insert(name.as_str()) {
                to_visit.extend(crates.iter().find(|c| c.name == *name));
            }
        }
    }
    reached
}

fn short(name: &str) -> &str {
    name.strip_prefix("raystrips-").unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn krate(name: &str, uses: &[&str]) -> Crate {
        Crate {
            name: name.to_owned(),
            manifest: "Cargo.toml".into(),
            uses: uses.iter().map(|s| (*s).to_owned()).collect(),
        }
    }

    fn findings(crates: &[Crate]) -> Vec<String> {
        check(crates).into_iter().map(|finding| finding.what).collect()
    }

    #[test]
    fn arrows_of_the_table_are_allowed() {
        let crates = [
            krate("raystrips-geom", &[]),
            krate("raystrips-tracer", &["raystrips-geom"]),
            krate("raystrips", &["raystrips-tracer", "raystrips-geom"]),
        ];
        assert!(findings(&crates).is_empty());
    }

    #[test]
    fn other_arrows_and_unknown_crates_are_found() {
        let found = findings(&[krate("raystrips-geom", &["raystrips-pack"])]);
        assert_eq!(found, ["raystrips-geom must not use raystrips-pack; it may use no crate"]);
        assert!(findings(&[krate("raystrips-new", &[])])[0].contains("not in the table"));
    }

    #[test]
    fn the_running_side_does_not_lead_to_the_preparing_side() {
        let crates = [
            krate("raystrips-render", &["raystrips-tracer"]),
            krate("raystrips-tracer", &["raystrips-pack"]),
            krate("raystrips-pack", &["raystrips-layout"]),
        ];
        let found = findings(&crates);
        assert!(
            found
                .iter()
                .any(|what| what.contains("raystrips-render runs and must not lead to raystrips-layout"))
        );
        assert!(found.iter().any(|what| what.contains("raystrips-tracer runs")));
    }
}
