//! The arguments of `osp send`.

use std::path::PathBuf;

use clap::Args;

use super::{numbers, reading::ReadArgs};
#[cfg(feature = "window")]
use osp_app::tracker::TrackerKey;
use osp_session::recording::Pace;

/// Without the window the value is not parsed; the command reports the missing feature.
#[cfg(not(feature = "window"))]
type TrackerKey = String;

/// Send a session to a window, like a tracker (`osp sketch --tracker udp://…`).
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp send recordings/portrait.ron --to 127.0.0.1:9327
  osp send sketch.tilt --to 127.0.0.1:9327 --speed 10
  osp send sketch.tilt --to 192.168.0.7:9000 --osc
  osp send sketch.tilt --to 192.168.0.7:9000 --key-file word.txt")]
pub(super) struct SendArgs {
    /// The session: .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj, .obj.gz, .glb or .gltf.
    pub(super) file: PathBuf,
    /// Address and port of the window's --tracker.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub(super) to: String,
    /// Part of the session that each packet contains (90 packets a second): `recorded` (by its time stamps) or `samples:N`
    /// (N samples of the hand).
    #[arg(long, default_value = "recorded")]
    pub(super) pace: Pace,
    /// Speed, as a multiple of the recorded speed.
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = numbers::factor)]
    pub(super) speed: f64,
    /// The key that the window requires (`osp sketch --tracker-key-file`). The list of processes shows the key to everybody
    /// on this machine.
    #[arg(long)]
    pub(super) key: Option<TrackerKey>,
    /// Read the key from a file of one line. Without --key-file and --key, osp reads the key from the variable
    /// OSP_TRACKER_KEY, if it is set.
    #[arg(long, value_name = "FILE", conflicts_with = "key")]
    pub(super) key_file: Option<PathBuf>,
    /// Send OSC messages instead of lines of text.
    #[arg(long)]
    pub(super) osc: bool,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}
