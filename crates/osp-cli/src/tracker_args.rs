//! `--tracker` and the options for reading from it.

use std::path::PathBuf;

use clap::Args;

#[cfg(feature = "window")]
pub(super) use osp_app::tracker::TrackerAddress;

/// Without the window the value is not parsed; the command reports the missing feature.
#[cfg(not(feature = "window"))]
pub(super) type TrackerAddress = String;

#[derive(Args, Debug)]
pub(super) struct TrackerArgs {
    /// Read a tracker: udp://ADDRESS:PORT (udp:// is udp://127.0.0.1:9327), a file that grows, or - for standard input.
    #[arg(long, value_name = "FROM")]
    pub(super) tracker: Option<TrackerAddress>,
    /// Accept the messages of every sender, not only of the first sender.
    #[arg(long, requires = "tracker")]
    pub(super) tracker_any: bool,
    /// Accept only packets that begin with the key in this file of one line. Without this option, osp reads the key from
    /// the variable OSP_TRACKER_KEY, if it is set. The key is sent unencrypted: everybody who reads the packets can use
    /// it.
    #[arg(long, value_name = "FILE", requires = "tracker")]
    pub(super) tracker_key_file: Option<PathBuf>,
}
