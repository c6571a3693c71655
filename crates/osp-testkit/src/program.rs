//! The program, run as a user runs it.

use std::{
    ffi::OsStr,
    path::Path,
    process::{Command, Output},
};

use tempfile::TempDir;

/// A program to test: `Program(env!("CARGO_BIN_EXE_osp"))`.
#[derive(Clone, Copy, Debug)]
pub struct Program(pub &'static str);

impl Program {
    /// The program with arguments, in a folder.
    pub fn command<S: AsRef<OsStr>>(
        self,
        folder: impl AsRef<Path>,
        args: impl IntoIterator<Item = S>,
    ) -> Command {
        let mut command = Command::new(self.0);
        // Some graphics drivers complain if there is none.
        command.args(args).current_dir(&folder).env("XDG_RUNTIME_DIR", folder.as_ref());
        command
    }

    /// How it ends and what it prints.
    ///
    /// # Panics
    ///
    /// Panics if it does not start.
    pub fn run<S: AsRef<OsStr>>(self, folder: impl AsRef<Path>, args: impl IntoIterator<Item = S>) -> Output {
        self.command(folder, args).output().expect("the program starts")
    }

    /// What it prints where it has to succeed.
    ///
    /// # Panics
    ///
    /// Panics with its complaint if it fails.
    pub fn done<S: AsRef<OsStr>>(
        self,
        folder: impl AsRef<Path>,
        args: impl IntoIterator<Item = S>,
    ) -> String {
        let output = self.run(folder, args);
        assert!(output.status.success(), "{}", stderr(&output));
        stdout(&output)
    }
}

/// What a program printed.
pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// What a program complained of.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder that is gone after the test.
///
/// # Panics
///
/// Panics if none can be made.
pub fn temp() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// The path of a shipped session: `room` for `recordings/room.ron`.
pub fn shipped_session(name: &str) -> String {
    format!("{}/recordings/{name}.ron", crate::ROOT)
}
