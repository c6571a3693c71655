//! The arguments of `osp sketch` and `osp send`.

use std::path::PathBuf;

use clap::Args;

use super::{
    join_args::{self, ServerArgs},
    numbers,
    reading::{LimitArgs, ReadArgs},
    rig_args::RigArgs,
};
#[cfg(feature = "window")]
use osp_app::tracker::TrackerAddress;
use osp_session::recording::Pace;

/// Without the window the value is not parsed; the command reports the missing feature.
#[cfg(not(feature = "window"))]
type TrackerAddress = String;

/// Draw in a window: with a mouse or a pen, or with a tracker.
///
/// The window writes every sample to the session's file before it takes the next one. It flushes the file to the disk
/// at the next pause. If you name no file, the session is written to an autosave file; after a crash the next `osp
/// sketch` restores it. Nothing is written before you draw, and no file is replaced without your consent.
///
/// The menus and F1 list all keys. The window stores recent sessions, colours and letter size in osp/window.settings in
/// the folder XDG_CONFIG_HOME (else ~/.config). You may delete that file.
///
/// Only one window at a time draws on a session. A second window names the owner, and offers to view the session or to
/// draw on a copy. If the file is removed, replaced or changed, or the disk is full, the window reports that. It no
/// longer changes the file, and continues in an autosave file.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp sketch
  osp sketch house.ron
  osp sketch painting.tilt
  osp sketch house.ron --read-only
  osp sketch damaged.ron --lenient
  osp sketch --tracker udp://127.0.0.1:9327
  osp sketch --rig dual-wall --tracker poses.txt

A tracker sends lines of text (or the same as OSC), metres and unit quaternions, +y up:
  head  X Y Z  QX QY QZ QW
  hand  X Y Z  QX QY QZ QW  PRESSURE  [HAND]     draws while PRESSURE is above 0
  brush TOOL WIDTH  R G B A  [HAND] [NORMAL]
  erase X Y Z | undo | redo
  key WORD                first in each packet, if OSP_TRACKER_KEY is set
TOOL: ribbon, wall, tube, or the name of a brush, such as Light. HAND: 0 to 255. NORMAL: local-x, side-x, travel or \
transport.
The window accepts one sender, until this sender has been silent for 5 s. It counts and drops the packets of other \
senders.
As OSC: /osp/head, /osp/hand and so on; the key as /osp/key, the first message of a bundle.
If the variable OSP_TRACKER_KEY has a key, the window reads only packets that begin with it. The key is sent \
unencrypted: everybody who reads the packets can use it.
`osp send SESSION --to 127.0.0.1:9327` sends a recorded session as a tracker does.")]
pub(super) struct SketchArgs {
    /// The session to continue, or a new one (.ron). osp opens a copy of a session that is write-protected, has another
    /// format, or was not drawn with `osp sketch`.
    pub(super) file: Option<PathBuf>,
    #[command(flatten)]
    pub(super) rig: RigArgs,
    /// Width and height of the window, in points.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(super) window: Option<(u32, u32)>,
    /// Write one line of JSON for each frame to a new file.
    #[arg(long, value_name = "FILE")]
    pub(super) trace: Option<PathBuf>,
    /// Read a tracker: udp://ADDRESS:PORT (udp:// is udp://127.0.0.1:9327), a file that grows, or - for standard input.
    #[arg(long, value_name = "FROM")]
    pub(super) tracker: Option<TrackerAddress>,
    /// Only view the session, or only watch the others of a shared session.
    #[arg(long)]
    pub(super) read_only: bool,
    /// Skip and count damaged parts, instead of refusing the session, and draw on a copy.
    #[arg(long, requires = "file")]
    pub(super) lenient: bool,
    /// Draw together with others, in a session on a NATS server: nats://HOST[:PORT]/NAME or tls://HOST[:PORT]/NAME
    /// (`osp join --help` describes how to start one). The recording of the whole session is saved while you draw, in
    /// FILE if it is given. FILE must be new, or an unchanged recording of the beginning of this session; the newer
    /// events are appended.
    // Parsed after clap, whose error message would print the password.
    #[arg(long, value_name = "ADDRESS", conflicts_with = "lenient")]
    pub(super) join: Option<String>,
    /// Your name, which the other members see.
    #[arg(
        long,
        default_value = "",
        hide_default_value = true,
        requires = "join",
        conflicts_with = "read_only"
    )]
    #[arg(value_parser = join_args::name)]
    pub(super) name: String,
    #[command(flatten)]
    pub(super) server: ServerArgs,
    #[command(flatten)]
    pub(super) limits: LimitArgs,
    /// The folder for autosave files [default: the user's own data folder].
    #[arg(long, value_name = "DIR")]
    pub(super) autosave: Option<PathBuf>,
}

fn size(text: &str) -> Result<(u32, u32), String> {
    numbers::sides(text, &(1..=16_384))
}

/// Send a session to a window, like a tracker (`osp sketch --tracker udp://…`).
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp send recordings/portrait.ron --to 127.0.0.1:9327
  osp send sketch.tilt --to 127.0.0.1:9327 --speed 10
  osp send sketch.tilt --to 192.168.0.7:9000 --osc

If the variable OSP_TRACKER_KEY is set, each packet begins with this key.")]
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
    /// Send OSC messages instead of lines of text.
    #[arg(long)]
    pub(super) osc: bool,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}
