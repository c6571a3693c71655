//! Options of a command's tracker, and the key at the beginning of packets.

use std::{env, path::Path};

use anyhow::{Context, anyhow};

use super::{output::warn, sketch_args::TrackerArgs};
use osp_app::tracker::{Listening, TrackerAddress, TrackerKey, TrackerOptions};
use osp_session::small_file::{open_regular, read_text};

/// The environment variable that provides a key if the command line names no file.
const KEY_VARIABLE: &str = "OSP_TRACKER_KEY";

/// Largest size of a key file in bytes: the key and some line ends.
const KEY_FILE_BYTES: u64 = 2 * TrackerKey::MAX_BYTES as u64;

impl TrackerArgs {
    /// Returns an error if the tracker's file cannot be read, before the work begins.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        if let Some(TrackerAddress::File(path)) = &self.tracker {
            open_regular(path).with_context(|| format!("tracker {}", path.display()))?;
        }
        Ok(())
    }

    /// Returns the options of the tracker. Prints a warning about insecure options. Reads a key only with a tracker.
    pub(super) fn options(&self) -> anyhow::Result<TrackerOptions> {
        let key = match self.tracker {
            Some(_) => key(self.tracker_key_file.as_deref())?,
            None => None,
        };
        let options = TrackerOptions {
            listening: if self.tracker_any { Listening::Everybody } else { Listening::First },
            key,
        };
        if let Some(warning) = self.tracker.as_ref().and_then(|from| from.warning(&options)) {
            warn(&format!("warning: {warning}"));
        }
        Ok(options)
    }
}

/// Returns the key of the file, else of the environment variable. An empty variable is an
/// error, because without a key everybody could send.
pub(super) fn key(file: Option<&Path>) -> anyhow::Result<Option<TrackerKey>> {
    let (from, text) = match (file, env::var_os(KEY_VARIABLE)) {
        (Some(path), _) => {
            let from = path.display().to_string();
            (from.clone(), read_text(path, KEY_FILE_BYTES).context(from)?)
        }
        (None, Some(value)) => (KEY_VARIABLE.to_owned(), value.to_string_lossy().into_owned()),
        (None, None) => return Ok(None),
    };
    // The error does not contain the key.
    text.trim_end_matches(['\r', '\n']).parse().map(Some).map_err(|why| anyhow!("{from}: {why}"))
}
