use std::{
    io,
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::journal::OpenElsewhere;
use osp_session::recording::{Limits, OpenOptions, RecordingError};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Access {
    /// Draw on the session.
    #[default]
    Write,
    ReadOnly,
    /// Draw on a copy of the session.
    Copy,
}

/// Options for opening a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Opening {
    pub access: Access,
    /// Whether to skip damaged parts instead of refusing the session. The user then draws on a copy.
    pub lenient: bool,
    pub limits: Limits,
    /// Whether the window shows the tools at once. Otherwise a sketch of another program is only looked at.
    pub draws: bool,
}

impl Opening {
    /// Options for this access; damaged sessions are refused.
    pub fn with(access: Access) -> Self {
        Self { access, ..Self::default() }
    }

    pub(super) fn options(self) -> OpenOptions {
        OpenOptions { lenient: self.lenient, limits: self.limits, ..OpenOptions::STRICT }
    }
}

/// The remarks from opening a session.
#[derive(Clone, Debug, Default)]
pub struct Opened {
    /// Messages to the user, one line each.
    pub remarks: Vec<String>,
    /// Whether the session was restored after a crash.
    pub is_recovered: bool,
}

/// Reason for which a session was not opened.
#[derive(Debug, Error)]
pub enum OpenError {
    /// The session cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Another window draws on the session.
    #[error(transparent)]
    Held(OpenElsewhere),
    #[error("{}: opening it was cancelled", .0.display())]
    Cancelled(PathBuf),
}

impl OpenError {
    pub(super) fn io(path: &Path, error: io::Error) -> Self {
        Self::Recording(RecordingError::io(path, error))
    }

    /// Whether a part of the session can be read: all but damaged parts, or up to a limit. From a file that does not
    /// begin as its format does, nothing can be read.
    pub fn is_damage(&self) -> bool {
        match self {
            Self::Recording(RecordingError::Byte { offset, .. }) => *offset > 0,
            Self::Recording(RecordingError::Line { .. } | RecordingError::Limit { .. }) => true,
            _ => false,
        }
    }
}
