//! `--tracker` and how to listen to it.

#[cfg(feature = "window")]
use anyhow::Context;
use clap::Args;

#[cfg(feature = "window")]
use super::output::complain;
#[cfg(feature = "window")]
pub(super) use crate::app::tracker::TrackerKey;
#[cfg(feature = "window")]
use crate::{
    app::tracker::{Listening, TrackerAddress, TrackerOptions},
    small_file::open_regular,
};

/// Without the window nothing listens: any word will do until the option is refused.
#[cfg(not(feature = "window"))]
pub(super) type TrackerAddress = String;
#[cfg(not(feature = "window"))]
pub(super) type TrackerKey = String;

#[derive(Args, Debug)]
pub(super) struct TrackerArgs {
    /// Listen to a tracker: udp://ADDRESS:PORT (udp:// is udp://127.0.0.1:9327), a file that grows, or - for standard
    /// input.
    #[arg(long, value_name = "FROM")]
    pub(super) tracker: Option<TrackerAddress>,
    /// Accept the messages of every sender, not only of the first.
    #[arg(long, requires = "tracker")]
    tracker_any: bool,
    /// Accept only packets that begin with this key. The key is sent unencrypted: whoever can read the packets knows it.
    #[arg(long, value_name = "KEY", requires = "tracker")]
    tracker_key: Option<TrackerKey>,
    /// The room of the DTrack system that sends was calibrated with z up, not y.
    #[arg(long, requires = "tracker")]
    tracker_z_up: bool,
}

#[cfg(feature = "window")]
impl TrackerArgs {
    /// Refuses a file that cannot be read, before anything else begins.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        if let Some(TrackerAddress::File(path)) = &self.tracker {
            open_regular(path).with_context(|| format!("tracker {}", path.display()))?;
        }
        Ok(())
    }

    /// How to listen; what is dangerous about it is said.
    pub(super) fn options(&self) -> TrackerOptions {
        let options = TrackerOptions {
            listening: if self.tracker_any { Listening::Everybody } else { Listening::First },
            key: self.tracker_key.clone(),
            z_up: self.tracker_z_up,
        };
        if let Some(warning) = self.tracker.as_ref().and_then(|from| from.warning(&options)) {
            complain(&format!("warning: {warning}"));
        }
        options
    }
}
