use std::{
    io,
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::journal::OpenElsewhere;
use osp_session::recording::{Limits, OpenOptions, RecordingError};

/// What a session is opened for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Access {
    /// Draw on it.
    #[default]
    Write,
    /// Read it only.
    ReadOnly,
    /// Draw on a copy of it.
    Copy,
}

/// How a session is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Opening {
    /// What it is opened for.
    pub access: Access,
    /// Leave out damaged pieces, instead of refusing the session. Then a copy is drawn on.
    pub lenient: bool,
    /// How much the session may hold.
    pub limits: Limits,
    /// If it is not there yet, it is begun as one of several authors.
    pub of_several: bool,
}

impl Opening {
    /// For this access, damaged sessions refused.
    pub fn with(access: Access) -> Self {
        Self { access, ..Self::default() }
    }

    pub(super) fn options(self) -> OpenOptions {
        OpenOptions { lenient: self.lenient, limits: self.limits }
    }
}

/// The remarks from opening a session.
#[derive(Clone, Debug, Default)]
pub struct Opened {
    /// One line each, for people.
    pub remarks: Vec<String>,
    /// The session was left open by a program that is gone.
    pub is_recovered: bool,
}

/// Why a session was not opened.
#[derive(Debug, Error)]
pub enum OpenError {
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Another window draws on it.
    #[error(transparent)]
    Held(OpenElsewhere),
    /// Somebody did not want to wait.
    #[error("{}: opening it was cancelled", .0.display())]
    Cancelled(PathBuf),
}

impl OpenError {
    pub(super) fn io(path: &Path, error: io::Error) -> Self {
        Self::Recording(RecordingError::io(path, error))
    }

    /// Whether the session can be read but for damaged pieces, or up to a limit.
    pub fn is_damage(&self) -> bool {
        matches!(
            self,
            Self::Recording(
                RecordingError::Line { .. } | RecordingError::Byte { .. } | RecordingError::Limit { .. }
            )
        )
    }
}
