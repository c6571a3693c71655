//! Runs the program like a user.

use std::{
    ffi::OsStr,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;
use tempfile::TempDir;

use crate::ROOT;

/// A program to test: `Program(env!("CARGO_BIN_EXE_osp"))`. Methods without a folder run it in the repository.
#[derive(Clone, Copy, Debug)]
pub struct Program(pub &'static str);

impl Program {
    /// Returns the program with arguments, in a folder. A replay or study without `--budget` measures every frame, also on a
    /// slow machine.
    pub fn command_in<S: AsRef<OsStr>>(
        self,
        folder: impl AsRef<Path>,
        args: impl IntoIterator<Item = S>,
    ) -> Command {
        let mut command = Command::new(self.0);
        // Some graphics drivers print errors without this variable. Nothing may print them.
        command.args(args).current_dir(folder).env_remove("XDG_RUNTIME_DIR");
        let given: Vec<&OsStr> = command.get_args().collect();
        let is_measured = given.first().is_some_and(|name| *name == "replay" || *name == "study");
        if is_measured && !given.contains(&OsStr::new("--budget")) {
            command.args(["--budget", "1e9"]);
        }
        command
    }

    /// [`Self::command_in`] on a machine without a display.
    pub fn without_display_in<S: AsRef<OsStr>>(
        self,
        folder: impl AsRef<Path>,
        args: impl IntoIterator<Item = S>,
    ) -> Command {
        let mut command = self.command_in(folder, args);
        for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            command.env_remove(variable);
        }
        command
    }

    /// See [`Self::command_in`].
    pub fn command<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> Command {
        self.command_in(ROOT, args)
    }

    /// Returns the exit status and output.
    ///
    /// # Panics
    ///
    /// Panics if the program does not start.
    pub fn run_in<S: AsRef<OsStr>>(
        self,
        folder: impl AsRef<Path>,
        args: impl IntoIterator<Item = S>,
    ) -> Output {
        self.command_in(folder, args).output().expect("the program starts")
    }

    /// See [`Self::run_in`].
    pub fn run<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> Output {
        self.run_in(ROOT, args)
    }

    /// Returns the output of a successful run.
    ///
    /// # Panics
    ///
    /// Panics with the error message if the program fails.
    pub fn done_in<S: AsRef<OsStr>>(
        self,
        folder: impl AsRef<Path>,
        args: impl IntoIterator<Item = S>,
    ) -> String {
        let mut command = self.command_in(folder, args);
        let output = command.output().expect("the program starts");
        assert!(output.status.success(), "{command:?}: {}", stderr(&output));
        stdout(&output)
    }

    /// See [`Self::done_in`].
    pub fn done<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> String {
        self.done_in(ROOT, args)
    }

    /// Returns the error message of a run that ends with exit code 2.
    ///
    /// # Panics
    ///
    /// Panics if the program ends in another way.
    pub fn refused_in<S: AsRef<OsStr>>(
        self,
        folder: impl AsRef<Path>,
        args: impl IntoIterator<Item = S>,
    ) -> String {
        let mut command = self.command_in(folder, args);
        let output = command.output().expect("the program starts");
        assert_eq!(output.status.code(), Some(2), "{command:?}: {}", stderr(&output));
        stderr(&output)
    }

    /// See [`Self::refused_in`].
    pub fn refused<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> String {
        self.refused_in(ROOT, args)
    }

    /// Returns the JSON that a successful run prints.
    ///
    /// # Panics
    ///
    /// Panics if the program fails, and if the output is not one JSON value.
    pub fn json_in<S: AsRef<OsStr>>(
        self,
        folder: impl AsRef<Path>,
        args: impl IntoIterator<Item = S>,
    ) -> Value {
        serde_json::from_str(&self.done_in(folder, args)).expect("one JSON value")
    }

    /// See [`Self::json_in`].
    pub fn json<S: AsRef<OsStr>>(self, args: impl IntoIterator<Item = S>) -> Value {
        self.json_in(ROOT, args)
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
