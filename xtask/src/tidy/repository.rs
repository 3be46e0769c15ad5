//! The texts of the repository.

use anyhow::{Context, Result};
use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

/// Endings of the files that are read.
const TEXT_ENDINGS: [&str; 2] = ["rs", "md"];

/// A file and what is in it.
pub struct TextFile {
    /// Seen from the root of the repository.
    pub path: PathBuf,
    pub text: String,
}

/// All files and folders, and the texts among them.
#[derive(Default)]
pub struct Repository {
    pub texts: Vec<TextFile>,
    /// Files and folders, seen from the root, which is the empty path.
    names: BTreeSet<PathBuf>,
}

impl Repository {
    /// Reads everything but hidden folders and what builds leave.
    pub fn read(root: &Path) -> Result<Repository> {
        let mut repository = Repository::default();
        repository.read_folder(root, Path::new(""))?;
        Ok(repository)
    }

    fn read_folder(&mut self, root: &Path, folder: &Path) -> Result<()> {
        self.names.insert(folder.to_owned());
        let full = root.join(folder);
        let mut entries: Vec<_> = std::fs::read_dir(&full)
            .and_then(Iterator::collect)
            .with_context(|| full.display().to_string())?;
        entries.sort_by_key(std::fs::DirEntry::file_name);
        for entry in entries {
            let path = folder.join(entry.file_name());
            if entry.file_type()?.is_dir() {
                if !is_left_out(&path) {
                    self.read_folder(root, &path)?;
                }
            } else {
                self.read_file(root, path)?;
            }
        }
        Ok(())
    }

    fn read_file(&mut self, root: &Path, path: PathBuf) -> Result<()> {
        if path.extension().is_some_and(|e| TEXT_ENDINGS.iter().any(|ending| e == *ending)) {
            let text =
                std::fs::read_to_string(root.join(&path)).with_context(|| path.display().to_string())?;
            self.texts.push(TextFile { path: path.clone(), text });
        }
        self.names.insert(path);
        Ok(())
    }

    /// Texts whose names end so.
    pub fn files_ending(&self, ending: &str) -> impl Iterator<Item = &TextFile> {
        self.texts.iter().filter(move |file| file.path.extension().is_some_and(|e| e == ending))
    }

    /// The text of that name.
    pub fn text(&self, path: &Path) -> Option<&TextFile> {
        self.texts.iter().find(|file| file.path == path)
    }

    /// True for a file or folder of the repository.
    pub fn contains(&self, path: &Path) -> bool {
        self.names.contains(path)
    }
}

fn is_left_out(folder: &Path) -> bool {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') || name == "target"
}

/// `path` without `.` and `..`; `None` where it leads out of the repository.
pub fn normalized(path: &Path) -> Option<PathBuf> {
    let mut normal = PathBuf::new();
    for component in path.components() {
        match component {
            Component::Normal(name) => normal.push(name),
            Component::CurDir => {}
            Component::ParentDir => {
                if !normal.pop() {
                    return None;
                }
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(normal)
}

#[cfg(test)]
impl Repository {
    /// A repository of these texts, for tests of checks.
    pub fn of(texts: &[(&str, &str)]) -> Repository {
        let texts: Vec<TextFile> = texts
            .iter()
            .map(|(path, text)| TextFile { path: PathBuf::from(path), text: (*text).to_owned() })
            .collect();
        let names = texts.iter().flat_map(|file| file.path.ancestors().map(Path::to_owned)).collect();
        Repository { texts, names }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_folders_and_builds_are_left_out() {
        let root = tempfile::tempdir().unwrap();
        for path in ["a/b.rs", "target/c.rs", ".git/d.rs", "e.md", "f.png"] {
            let path = root.path().join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "text").unwrap();
        }
        let repository = Repository::read(root.path()).unwrap();
        let read: Vec<_> = repository.texts.iter().map(|file| file.path.to_str().unwrap()).collect();
        assert_eq!(read, ["a/b.rs", "e.md"]);
        assert!(repository.contains(Path::new("f.png")) && repository.contains(Path::new("a")));
        assert!(!repository.contains(Path::new("target/c.rs")));
    }

    #[test]
    fn paths_stay_in_the_repository() {
        assert_eq!(normalized(Path::new("a/../b/./c")), Some("b/c".into()));
        assert_eq!(normalized(Path::new("a/..")), Some("".into()));
        assert_eq!(normalized(Path::new("a/../../b")), None);
        assert_eq!(normalized(Path::new("/a")), None);
    }
}
