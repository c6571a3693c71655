//! The choice of the frame for a picture.

use std::{path::Path, str::FromStr};

use anyhow::bail;

use osp_session::{recording::Pace, replay::Summary};

/// A frame, in the form of the command line.
#[derive(Clone, Copy, Debug)]
pub(super) enum FrameChoice {
    Last,
    Number(u64),
}

impl FromStr for FrameChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "last" => Ok(Self::Last),
            _ => text
                .parse()
                .map(Self::Number)
                .map_err(|_| format!("expected a frame number or `last`; found `{text}`")),
        }
    }
}

impl FrameChoice {
    /// Whether a command that plays up to this frame plays frame `number`.
    pub(super) fn includes(self, number: u64) -> bool {
        match self {
            Self::Last => true,
            Self::Number(last) => number <= last,
        }
    }

    /// Whether this is frame `number`, given by its number.
    pub(super) fn is(self, number: u64) -> bool {
        matches!(self, Self::Number(frame) if frame == number)
    }

    /// Returns the number of the frame in a session.
    pub(super) fn number(self, file: &Path, summary: &Summary, pace: Pace) -> anyhow::Result<u64> {
        let Some(end) = summary.frames.checked_sub(1) else {
            bail!("{}: nothing was drawn in this session", file.display());
        };
        match self {
            Self::Last => Ok(end),
            Self::Number(n) if n <= end => Ok(n),
            Self::Number(n) => bail!(
                "{}: there is no frame {n}; the session has {} frames at the pace {pace}",
                file.display(),
                summary.frames
            ),
        }
    }
}
