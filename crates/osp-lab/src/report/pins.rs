use std::{
    io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::RunReport;
use osp_session::{replay::SessionFingerprint, small_file};

/// Number of parts of a session, each with its own fingerprint, to locate differences between two runs.
const PARTS: u64 = 16;
/// Largest file of pins that is read, bytes; it suffices for 50,000 recordings.
const MOST_BYTES: u64 = 64 << 20;

/// The pins of several recordings, the fingerprints that replays must have; stored in a file of RON text.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pins {
    /// The entries, by recording.
    pub pins: Vec<Pin>,
}

/// The fingerprints that the replay of one recording must have.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pin {
    /// The recording, as a path relative to the folder of the pins with `/` as separator (see [`pinned_name`]).
    pub recording: String,
    pub pace: String,
    pub camera: String,
    pub frames: u64,
    pub fingerprint: String,
    /// Fingerprint of each sixteenth of the session.
    pub parts: Vec<String>,
}

#[derive(Debug, Error)]
pub enum PinError {
    #[error("{}: {cause}", path.display())]
    Io { path: PathBuf, cause: io::Error },
    #[error("{}, line {}: expected a list of pinned fingerprints; {}", path.display(), cause.span.start.line, cause.code)]
    Format { path: PathBuf, cause: Box<ron::error::SpannedError> },
}

impl Pin {
    /// The pin of a run; `None` if the run skipped a frame.
    pub fn of(recording: &str, pace: &str, camera: &str, run: &RunReport) -> Option<Self> {
        if !run.is_complete() {
            return None;
        }
        let frames = run.frames.len() as u64;
        let mut parts = [SessionFingerprint::new(); PARTS as usize];
        for &(frame, fingerprint) in &run.frames {
            parts[(frame * PARTS / frames) as usize].add(frame, fingerprint);
        }
        let hex = |n: u64| format!("{n:016x}");
        Some(Self {
            recording: recording.to_owned(),
            pace: pace.to_owned(),
            camera: camera.to_owned(),
            frames,
            fingerprint: hex(run.fingerprint()),
            parts: parts.iter().map(|p| hex(p.value())).collect(),
        })
    }

    fn is_about(&self, other: &Self) -> bool {
        self.recording == other.recording && self.pace == other.pace && self.camera == other.camera
    }

    /// The difference between `found` and this pin as text; `None` if they are equal.
    pub fn difference(&self, found: &Self) -> Option<String> {
        if self.frames != found.frames {
            return Some(format!("pinned with {} frames, replayed with {}", self.frames, found.frames));
        }
        if self.fingerprint == found.fingerprint {
            return None;
        }
        let part = self.parts.iter().zip(&found.parts).position(|(a, b)| a != b).unwrap_or(0) as u64;
        let (first, last) = (part * self.frames / PARTS, (part + 1) * self.frames / PARTS);
        Some(format!(
            "pinned {}, replayed {}; the first difference lies in frames {first} to {last}",
            self.fingerprint, found.fingerprint
        ))
    }
}

/// Name of a recording in the file of pins at `pins`: its path relative to the folder of this file if the recording
/// lies below this folder, else its absolute path. So recordings of the same name in two folders have different names.
pub fn pinned_name(recording: &Path, pins: &Path) -> String {
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let resolved = |path: &Path| path.canonicalize().unwrap_or_else(|_| whole(path));
    let recording = resolved(recording);
    // The file of pins need not exist yet, but its folder must.
    let folder = whole(pins).parent().map(resolved).unwrap_or_default();
    let name = recording.strip_prefix(folder).unwrap_or(&recording);
    name.components()
        .map(|part| part.as_os_str().to_string_lossy())
        .collect::<Vec<_>>()
        .join("/")
        .replacen("//", "/", 1)
}

impl Pins {
    pub fn read(path: &Path) -> Result<Self, PinError> {
        let text = small_file::read_text(path, MOST_BYTES)
            .map_err(|cause| PinError::Io { path: path.to_owned(), cause })?;
        ron::from_str(&text).map_err(|e| PinError::Format { path: path.to_owned(), cause: Box::new(e) })
    }

    /// Writes the text of the file.
    ///
    /// # Errors
    /// `out` returns one.
    pub fn write(&self, out: &mut dyn io::Write) -> io::Result<()> {
        let pretty = ron::ser::PrettyConfig::new().depth_limit(2);
        let text = ron::ser::to_string_pretty(self, pretty).map_err(io::Error::other)?;
        writeln!(out, "{text}")
    }

    /// The pin for the same recording and settings.
    pub fn find(&self, like: &Pin) -> Option<&Pin> {
        self.pins.iter().find(|pin| pin.is_about(like))
    }

    /// Adds a pin, or replaces the one for the same recording and settings.
    pub fn set(&mut self, pin: Pin) {
        self.pins.retain(|old| !old.is_about(&pin));
        self.pins.push(pin);
        self.pins.sort_by(|a, b| (&a.recording, &a.pace, &a.camera).cmp(&(&b.recording, &b.pace, &b.camera)));
    }
}
