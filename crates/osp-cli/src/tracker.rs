//! The tracker's file and its key, before the work begins.

use std::env;

use anyhow::{Context, anyhow};

use super::output::warn;
use osp_app::tracker::{TrackerAddress, TrackerKey, TrackerOptions};
use osp_session::small_file::open_regular;

/// The environment variable with the key. The list of processes does not show it, unlike an option.
const KEY_VARIABLE: &str = "OSP_TRACKER_KEY";

/// Returns the options of a tracker. Prints a warning about insecure ones.
pub(super) fn options(tracker: Option<&TrackerAddress>) -> anyhow::Result<TrackerOptions> {
    let Some(tracker) = tracker else { return Ok(TrackerOptions::default()) };
    if let TrackerAddress::File(path) = tracker {
        open_regular(path).with_context(|| format!("tracker {}", path.display()))?;
    }
    let options = TrackerOptions { key: key()? };
    if let Some(warning) = tracker.warning(&options) {
        warn(&format!("warning: {warning}"));
    }
    Ok(options)
}

/// Returns the key, if the variable is set. An empty variable is an error, because without a key everybody could send.
pub(super) fn key() -> anyhow::Result<Option<TrackerKey>> {
    let Some(value) = env::var_os(KEY_VARIABLE) else { return Ok(None) };
    // The error does not contain the key.
    value.to_string_lossy().parse().map(Some).map_err(|why| anyhow!("{KEY_VARIABLE}: {why}"))
}
