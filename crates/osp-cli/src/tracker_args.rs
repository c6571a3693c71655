//! `--tracker` and the options for reading from it.

use std::path::PathBuf;

use clap::Args;

#[cfg(feature = "window")]
pub(super) use osp_app::tracker::{TrackerAddress, TrackerKey};

/// Without the window the value is not parsed; the command reports the missing feature.
#[cfg(not(feature = "window"))]
pub(super) type TrackerAddress = String;
#[cfg(not(feature = "window"))]
pub(super) type TrackerKey = String;

#[derive(Args, Debug)]
pub(super) struct TrackerArgs {
    /// Read a tracker: udp://ADDRESS:PORT (udp:// is udp://127.0.0.1:9327), a file that grows, or - for standard input.
    #[arg(long, value_name = "FROM")]
    pub(super) tracker: Option<TrackerAddress>,
    /// Accept the messages of every sender, not only of the first sender.
    #[arg(long, requires = "tracker")]
    pub(super) tracker_any: bool,
    /// Accept only packets that begin with this key. The key is sent unencrypted: everybody who reads the packets can
    /// use it. The list of processes shows the key to everybody on this machine; use a file or the variable
    /// OSP_TRACKER_KEY to avoid that.
    #[arg(long, value_name = "KEY", requires = "tracker")]
    pub(super) tracker_key: Option<TrackerKey>,
    /// Read the key from a file of one line. Without --tracker-key-file and --tracker-key, osp reads the key from
    /// the variable OSP_TRACKER_KEY, if it is set.
    #[arg(long, value_name = "FILE", requires = "tracker", conflicts_with = "tracker_key")]
    pub(super) tracker_key_file: Option<PathBuf>,
}
