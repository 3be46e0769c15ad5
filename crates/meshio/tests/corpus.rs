//! Reads every model of a folder of real files, odd files and broken files, and compares with its manifest.
//!
//! The folder is named by `RAYSTRIPS_MODELS`; without it and without the usual place there is nothing to test.

use raystrips_meshio::{Import, ImportError, ImportOptions, TriangleBatch, TriangleSink, import, survey};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Checks batches and forgets them.
#[derive(Default)]
struct Check {
    next_unseen_id: u64,
}

impl TriangleSink for Check {
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()> {
        assert!(!batch.triangles.is_empty() && batch.triangles.len() <= 1 << 16);
        assert!(batch.triangles.iter().flatten().all(|&i| (i as usize) < batch.positions.len()));
        assert!(batch.positions.iter().flatten().all(|x| x.abs() <= 1e18));
        self.next_unseen_id = self.next_unseen_id.max(batch.first_triangle_id + batch.triangles.len() as u64);
        Ok(())
    }
}

/// A line of the manifest.
struct Entry {
    path: String,
    triangles: Option<u64>,
    expected: String,
    /// Triangles that other programs count.
    references: Vec<u64>,
}

impl Entry {
    fn parse(line: &str) -> Option<Entry> {
        let fields: Vec<&str> = line.split('\t').collect();
        let field = |i: usize| fields.get(i).copied().unwrap_or_default();
        let is_model =
            [".obj", ".ply", ".gltf", ".glb", ".off"].iter().any(|ending| field(0).ends_with(ending));
        let count = |text: &str| text.split(['f', 't']).next_back()?.strip_prefix('=')?.parse().ok();
        is_model.then(|| Entry {
            path: field(0).to_owned(),
            triangles: field(3).parse().ok(),
            expected: field(8).to_owned(),
            references: [field(9), field(10)].into_iter().filter_map(count).collect(),
        })
    }

    /// What is wrong with the outcome, if anything.
    fn judge(&self, outcome: &Result<Import, ImportError>) -> Option<String> {
        let allowed = KNOWN_DEVIATIONS.iter().any(|(path, _)| self.path.ends_with(path));
        match outcome {
            _ if allowed => None,
            Err(ImportError::Unsupported { .. }) if self.path.ends_with(".off") => None,
            Err(error)
                if self.expected.starts_with("accept") && self.triangles.is_some_and(|count| count > 0) =>
            {
                Some(format!("refused: {error}"))
            }
            Ok(_) if self.path.ends_with(".off") => Some("accepted a format that is not read".into()),
            Ok(_) if self.expected.contains("clean error") && !self.expected.contains("or ") => {
                Some(format!("accepted, expected {}", self.expected))
            }
            Ok(done) => {
                let dropped = done.report.dropped;
                let count = done.report.triangles + dropped.non_finite + dropped.out_of_range;
                let mut counts = self.triangles.iter().chain(&self.references);
                let wrong = self.triangles.is_some() && counts.all(|&expected| expected != count);
                wrong.then(|| format!("{count} triangles, not {:?} {:?}", self.triangles, self.references))
            }
            Err(_) => None,
        }
    }
}

/// Files for which the manifest is not the last word, and why.
const KNOWN_DEVIATIONS: [(&str, &str); 2] = [
    ("2CylinderEngine.glb", "counted without the meshes that several nodes show"),
    ("CesiumMilkTruck.gltf", "counted without the second pair of wheels, the same mesh as the first"),
];

#[test]
fn every_model_of_the_corpus() {
    let usual = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/models");
    let root = std::env::var_os("RAYSTRIPS_MODELS").map_or(usual, PathBuf::from);
    let Ok(manifest) = std::fs::read_to_string(root.join("MANIFEST.tsv")) else {
        eprintln!("skipped: no model corpus");
        return;
    };
    let entries: Vec<_> = manifest.lines().skip(1).filter_map(Entry::parse).collect();
    assert!(!entries.is_empty());
    let failures: Vec<_> = entries.iter().filter_map(|entry| check(&root, entry)).collect();
    assert!(failures.is_empty(), "{} of {} models:\n{}", failures.len(), entries.len(), failures.join("\n"));
}

fn check(root: &Path, entry: &Entry) -> Option<String> {
    let path = root.join(&entry.path);
    let name = path.file_name()?.to_str()?;
    let mut sink = Check::default();
    let attempt =
        AssertUnwindSafe(|| import(std::slice::from_ref(&path), &ImportOptions::default(), &mut sink));
    let Ok(outcome) = catch_unwind(attempt) else {
        return Some(format!("{}: panicked", entry.path));
    };
    let message = match &outcome {
        Ok(done) => done.report.warnings.join(" | "),
        Err(error) => error.to_string(),
    };
    if std::env::var_os("RAYSTRIPS_SHOW").is_some() {
        eprintln!("{} {}: {message}", if outcome.is_ok() { "ok" } else { "error" }, entry.path);
    }
    if outcome.is_err() && (message.contains('\n') || !message.contains(name)) {
        return Some(format!("{}: the message is not one line with the file's name: {message}", entry.path));
    }
    if let Some(what) = judge_survey(&path, &outcome) {
        return Some(format!("{}: {what}", entry.path));
    }
    entry.judge(&outcome).map(|what| format!("{}: {what}", entry.path))
}

/// What is wrong with what is told of the file before its import, if anything.
fn judge_survey(path: &Path, outcome: &Result<Import, ImportError>) -> Option<String> {
    let Ok(found) = catch_unwind(|| survey(&[path.to_owned()], &ImportOptions::default())) else {
        return Some("the survey panicked".into());
    };
    match (found, outcome) {
        (Err(error), Ok(_)) => Some(format!("the survey refused: {error}")),
        (Err(error), Err(expected)) => {
            let same = error.to_string() == expected.to_string();
            (!same).then(|| format!("the survey said: {error}, the import: {expected}"))
        }
        (Ok(found), Ok(done)) => {
            let dropped = done.report.dropped;
            let count = done.report.triangles + dropped.non_finite + dropped.out_of_range;
            let near = found.triangles <= 2 * count && 2 * found.triangles >= count;
            let good = if found.is_exact { found.triangles == count } else { near };
            (!good).then(|| format!("{found:?}, but {count} triangles"))
        }
        (Ok(_), Err(_)) => None,
    }
}
