//! The binary, a folder to run it in, and what it answered.

use serde_json::Value;
use std::ffi::OsStr;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longer than anything here takes on the slowest machine.
const TIME_LIMIT: Duration = Duration::from_secs(120);

/// Where the program is.
pub const BINARY: &str = env!("CARGO_BIN_EXE_raystrips");

/// A folder that is gone after the test.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file and gives its name as it was given.
    pub fn write<'a>(&self, name: &'a str, content: impl AsRef<[u8]>) -> &'a str {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
        name
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// What is in a file; nothing if there is none.
    pub fn read_if(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_default()
    }

    /// Names of what is in a folder of this folder; `""` is the folder itself.
    pub fn names(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(folder)).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Starts `raystrips` with these arguments, separated by spaces, in this folder.
    pub fn start(&self, arguments: &str) -> Running {
        self.start_command(Command::new(BINARY).args(arguments.split_whitespace()))
    }

    /// Runs `raystrips` with these arguments, separated by spaces, in this folder.
    pub fn run(&self, arguments: &str) -> Outcome {
        self.start(arguments).wait(TIME_LIMIT)
    }

    /// The same with arguments that may hold spaces.
    pub fn run_args<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Outcome {
        self.run_command(Command::new(BINARY).args(arguments))
    }

    /// Runs another program in this folder.
    pub fn run_command(&self, command: &mut Command) -> Outcome {
        self.start_command(command).wait(TIME_LIMIT)
    }

    fn start_command(&self, command: &mut Command) -> Running {
        // Nothing of the user's own cache is read or written.
        command.current_dir(self.0.path()).env("XDG_CACHE_HOME", self.path("user-cache"));
        Running::start(command)
    }
}

/// The binary while it runs.
pub struct Running {
    pub child: Child,
    what: String,
    stdout: JoinHandle<String>,
    stderr: JoinHandle<String>,
}

impl Running {
    pub fn start(command: &mut Command) -> Running {
        let what = format!("{command:?}");
        let mut child =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (stdout, stderr) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
        Running { child, what, stdout: read_aside(stdout), stderr: read_aside(stderr) }
    }

    /// Waits until it ends. A program that hangs fails the test.
    pub fn wait(mut self, limit: Duration) -> Outcome {
        let begin = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            if begin.elapsed() > limit {
                self.child.kill().unwrap();
                panic!("{} did not end within {limit:?}", self.what);
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        Outcome {
            what: self.what,
            code: status.code(),
            stdout: self.stdout.join().unwrap(),
            stderr: self.stderr.join().unwrap(),
        }
    }
}

/// Reads all of a pipe, so that the program never waits for us.
fn read_aside(mut pipe: impl Read + Send + 'static) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.read_to_end(&mut bytes).unwrap();
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// What a run of the binary came to.
#[derive(Debug)]
pub struct Outcome {
    /// The command, for messages of tests.
    pub what: String,
    /// `None` if a signal ended it.
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Outcome {
    /// It did what it was asked to, without a word on standard error.
    pub fn done(self) -> Outcome {
        let done = self.done_with_notes();
        assert_eq!(done.stderr, "", "{done:#?}");
        done
    }

    /// It succeeded, and may have said something on standard error.
    pub fn done_with_notes(self) -> Outcome {
        assert_eq!(self.code, Some(0), "{self:#?}");
        self
    }

    /// It failed with one line on standard error that holds all of `words`, and nothing on standard output.
    pub fn failed(self, words: &[&str]) {
        if let Err(problem) = self.check_failed(words) {
            panic!("{problem}");
        }
    }

    /// [`Outcome::failed`], for those who collect.
    pub fn check_failed(&self, words: &[&str]) -> Result<(), String> {
        let is_one_line = self.stderr.lines().count() == 1 && self.stderr.ends_with('\n');
        let lacking: Vec<_> = words.iter().filter(|word| !self.stderr.contains(**word)).collect();
        let is_error = self.stderr.starts_with("raystrips: error: ");
        if self.code == Some(1) && is_one_line && is_error && lacking.is_empty() && self.stdout.is_empty() {
            return Ok(());
        }
        Err(format!("{}: expected exit 1 and one line with {words:?}: {self:#?}", self.what))
    }

    /// The one JSON object on standard output.
    pub fn json(&self) -> Value {
        let value: Value = serde_json::from_str(&self.stdout)
            .unwrap_or_else(|e| panic!("not one JSON value: {e}: {self:#?}"));
        assert!(value.is_object(), "{self:#?}");
        value
    }
}

/// Panics unless `value` has all of these keys; `a.b` is key `b` of the object at `a`.
pub fn assert_keys(value: &Value, keys: &[&str]) {
    for key in keys {
        let found = key.split('.').try_fold(value, |value, part| value.get(part));
        assert!(found.is_some_and(|v| !v.is_null()), "no '{key}' in {value:#}");
    }
}

/// A file of the repository.
pub fn repository_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}
