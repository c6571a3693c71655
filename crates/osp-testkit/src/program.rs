//! Runs the program like a user.

use std::{
    ffi::OsStr,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;
use tempfile::TempDir;

use crate::ROOT;

/// A program to test, and the folder in which it runs.
#[derive(Clone, Copy, Debug)]
pub struct Program<'a> {
    /// The program's file: `env!("CARGO_BIN_EXE_osp")`.
    pub file: &'static str,
    folder: &'a str,
}

impl Program<'static> {
    /// Returns the program in the repository.
    pub const fn new(file: &'static str) -> Self {
        Self { file, folder: ROOT }
    }
}

impl Program<'_> {
    /// Returns the program in another folder.
    ///
    /// # Panics
    ///
    /// Panics if the folder's path is not UTF-8.
    pub fn at<'f, P: AsRef<Path> + ?Sized>(self, folder: &'f P) -> Program<'f> {
        Program { file: self.file, folder: folder.as_ref().to_str().expect("utf-8") }
    }

    /// Returns the program with arguments. A replay or study without `--budget` measures every frame, also on a slow
    /// machine.
    pub fn command<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(self.file);
        // Some graphics drivers print errors without this variable. Nothing may print them.
        command.args(args).current_dir(self.folder).env_remove("XDG_RUNTIME_DIR");
        let given: Vec<&OsStr> = command.get_args().collect();
        let is_measured = given.first().is_some_and(|name| *name == "replay" || *name == "study");
        if is_measured && !given.contains(&OsStr::new("--budget")) {
            command.args(["--budget", "1e9"]);
        }
        command
    }

    /// [`Self::command`] on a machine without a display.
    pub fn without_display<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> Command {
        let mut command = self.command(args);
        for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            command.env_remove(variable);
        }
        command
    }

    /// Returns the exit status and output.
    ///
    /// # Panics
    ///
    /// Panics if the program does not start.
    pub fn run<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> Output {
        self.command(args).output().expect("the program starts")
    }

    /// Returns the output of a successful run.
    ///
    /// # Panics
    ///
    /// Panics with the error message if the program fails.
    pub fn done<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> String {
        let mut command = self.command(args);
        let output = command.output().expect("the program starts");
        assert!(output.status.success(), "{command:?}: {}", stderr(&output));
        stdout(&output)
    }

    /// Returns the error message of a run that ends with exit code 2.
    ///
    /// # Panics
    ///
    /// Panics if the program ends in another way.
    pub fn refused<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> String {
        let mut command = self.command(args);
        let output = command.output().expect("the program starts");
        assert_eq!(output.status.code(), Some(2), "{command:?}: {}", stderr(&output));
        stderr(&output)
    }

    /// Returns the JSON that a successful run prints.
    ///
    /// # Panics
    ///
    /// Panics if the program fails, and if the output is not one JSON value.
    pub fn json<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> Value {
        serde_json::from_str(&self.done(args)).expect("one JSON value")
    }
}

/// Returns the text that a program has printed.
pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Returns the text that a program has printed to standard error.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Returns the JSON that a successful program has printed.
///
/// # Panics
///
/// Panics with the error message if the program has failed, and if the output is not one JSON value.
pub fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", stderr(output));
    serde_json::from_slice(&output.stdout).expect("one JSON value")
}

/// Returns the names in a folder, sorted, so that a test finds a forgotten file.
///
/// # Panics
///
/// Panics if it is not a folder.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Makes a named pipe. Returns false if the system has none.
pub fn make_pipe(path: &Path) -> bool {
    Command::new("mkfifo").arg(path).status().is_ok_and(|status| status.success())
}

/// Makes a folder that is removed after the test.
///
/// # Panics
///
/// Panics if the folder cannot be made.
pub fn temp() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Returns the path of a shipped session: `room` for `recordings/room.ron`.
pub fn shipped_session(name: &str) -> String {
    format!("{ROOT}/recordings/{name}.ron")
}
