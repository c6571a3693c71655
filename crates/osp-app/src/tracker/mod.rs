//! Poses of a tracker from a socket, a file or standard input, as lines of text or OSC messages.
//!
//! Every tracker can print numbers; a script of ten lines converts them to this format. Each line is a message, and a
//! packet has one or several lines. Numbers are metres and unit quaternions `x y z w` (world from tracker), +y up:
//!
//! ```text
//! head  X Y Z  QX QY QZ QW                        the eye moves here
//! hand  X Y Z  QX QY QZ QW  PRESSURE  [HAND]      draws while the pressure is above 0
//! brush TOOL WIDTH  R G B A  [HAND] [NORMAL]      the brush of the hand's next stroke
//! erase X Y Z                                     erases the stroke at this place
//! undo
//! redo
//! key WORD                                        first in every packet, if the window requires a key
//! # anything
//! ```
//!
//! `TOOL` is `ribbon`, `wall`, `tube` or the name of a brush, such as `Light`. An unknown brush is reported once and
//! drawn as a plain ribbon. `HAND` is 0 to 255, and 0 if omitted; each hand draws its own stroke. `NORMAL` is the
//! orientation of a ribbon relative to the pose: `local-x` (default), `side-x`, `travel` (default of brushes) or
//! `transport`.
//!
//! In OSC, the messages have the addresses `/osp/head`, `/osp/hand`, `/osp/brush`, `/osp/erase`, `/osp/undo`,
//! `/osp/redo`, alone or in bundles. Numbers in these messages are floats; only the hand is an integer. The tool and
//! the normal are strings. A key is `/osp/key` with a string, the first message of a bundle.
//!
//! A socket accepts one sender: the first with a valid message, until it is inactive for five seconds. Datagrams of
//! other senders, and datagrams without a required key, are counted and not read.
//!
//! Messages do not depend on each other, so a lost packet costs only a sample. Malformed messages are counted and
//! dropped. [`Hands`] converts messages to the events of a session; [`EventEncoder`] does the opposite.

mod admittance;
mod event_encoder;
mod hands;
mod line;
mod message;
mod osc;
mod source;
mod watch;

pub use admittance::{TrackerKey, TrackerOptions};
pub use event_encoder::EventEncoder;
pub use hands::{Hands, Pose};
pub use line::{Malformed, parse_line, write_line};
pub use message::{BrushChoice, Message};
pub use osc::{osc_keyed, osc_packet, parse_osc};
pub use source::{Counts, ReceivedMessage, Tracker, TrackerAddress, TrackerError};
pub use watch::{Received, Watch};
