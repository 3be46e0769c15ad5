//! Every model of a folder of real files, odd files and broken files: read, or refused in one line.
//!
//! The folder is named by `RAYSTRIPS_MODELS`; without it and without the usual place there is nothing to test.

use crate::support::{Folder, Outcome, repository_file};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Endings of models.
const ENDINGS: [&str; 6] = ["obj", "ply", "gltf", "glb", "off", "hair"];

/// Programs at a time.
const PROCESSES: usize = 2;

fn corpus() -> Option<PathBuf> {
    let named = std::env::var_os("RAYSTRIPS_MODELS").map(PathBuf::from);
    let folder = named.unwrap_or_else(|| repository_file("../shared/models"));
    folder.is_dir().then_some(folder)
}

/// All models below `folder`.
fn models(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(models(&path));
        } else if path
            .extension()
            .is_some_and(|e| ENDINGS.iter().any(|ending| e.eq_ignore_ascii_case(ending)))
        {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// What is wrong with how the program takes `model`, or whether it read it.
fn judge(folder: &Folder, model: &Path) -> Result<bool, String> {
    let pack = folder.path("a.rsp");
    let convert = folder.run_args(&["convert".as_ref(), model.as_os_str(), "-o".as_ref(), pack.as_os_str()]);
    if convert.stderr.contains("panicked") {
        return Err(format!("panic: {convert:#?}"));
    }
    if convert.code != Some(0) {
        // A broken model may name the file beside it that is missing or broken.
        let names = [model, model.parent().unwrap()].map(|path| path.to_str().unwrap().to_owned());
        convert.check_failed(&[&names[1]])?;
        let nothing_left = folder.names("").is_empty();
        return if nothing_left { Ok(false) } else { Err(format!("left behind: {convert:#?}")) };
    }
    let verify = folder.run("verify a.rsp");
    std::fs::remove_file(pack).unwrap();
    let good = |outcome: &Outcome| outcome.code == Some(0) && outcome.stderr.is_empty();
    if good(&verify) { Ok(true) } else { Err(format!("{convert:#?} {verify:#?}")) }
}

#[test]
fn every_model_is_read_or_refused() {
    let Some(corpus) = corpus() else {
        eprintln!("skipped: no model corpus; name a folder of models with RAYSTRIPS_MODELS");
        return;
    };
    let all = models(&corpus);
    let (to_do, problems, read) = (Mutex::new(all.iter()), Mutex::new(Vec::new()), Mutex::new(0));
    std::thread::scope(|scope| {
        let work = || {
            let folder = Folder::new();
            let next = || to_do.lock().unwrap().next();
            while let Some(model) = next() {
                match judge(&folder, model) {
                    Ok(true) => *read.lock().unwrap() += 1,
                    Ok(false) => {}
                    Err(problem) => problems.lock().unwrap().push(format!("{}: {problem}", model.display())),
                }
            }
        };
        for _ in 0..PROCESSES {
            scope.spawn(work);
        }
    });
    let (problems, read) = (problems.into_inner().unwrap(), read.into_inner().unwrap());
    assert!(problems.is_empty(), "{} of {} models:\n{}", problems.len(), all.len(), problems.join("\n"));
    assert!(2 * read > all.len(), "only {read} of {} models were read", all.len());
}
