//! Poses from outside: a socket, a file or standard input, as lines of text or OSC messages.
//!
//! Every tracker has some way to print numbers; ten lines of script turn them into this format. One message a line,
//! one or several lines in a packet, numbers in metres and unit quaternions `x y z w` (world from tracker), +y up:
//!
//! ```text
//! head  X Y Z  QX QY QZ QW                        the eye moves here
//! hand  X Y Z  QX QY QZ QW  PRESSURE  [HAND]      draws while the pressure is above 0
//! brush TOOL WIDTH  R G B A  [HAND] [NORMAL]      what the hand draws with next
//! erase X Y Z                                     the stroke at this place
//! undo
//! redo
//! frame N                                         first in a packet of a socket: its number; gaps are counted as lost
//! key WORD                                        first in every packet, where the listener asks for a key
//! # anything
//! ```
//!
//! `TOOL` is `ribbon`, `wall`, `tube` or the name of a brush, such as `Light`. An unknown brush is reported once and drawn
//! as a plain ribbon. `HAND` is 0 to 255 and 0 if left out: each hand draws its own stroke. `NORMAL` is the direction of a
//! ribbon relative to the pose: `local-x` (default), `side-x`, `travel` (default of brushes) or `transport`.
//!
//! The same as OSC: addresses `/osp/head`, `/osp/hand`, `/osp/brush`, `/osp/erase`, `/osp/undo`, `/osp/redo`, with the
//! numbers as floats (the hand as integer, tool and normal as strings), alone or in bundles. A key is `/osp/key` with a
//! string, the first message of a bundle.
//!
//! Packets of ART's DTrack (ASCII) are accepted on the same socket: body 0 is the head, Flysticks are the hands, and a
//! hand draws while the first button is pressed ([`parse_dtrack`]).
//!
//! A socket accepts one sender: the first with a valid message, until it is silent for five seconds. Datagrams of
//! other senders, and datagrams without a required key, are counted and not read. As an option, each sender is an
//! author of its own instead ([`Senders`]), sixteen at a time.
//!
//! Messages do not depend on each other: a lost packet costs only a sample. Malformed messages are counted and
//! dropped. [`Hands`] turns messages into the events of a session; [`Teller`] does the opposite.

mod door;
mod dtrack;
mod hands;
mod line;
mod message;
mod osc;
mod senders;
mod source;
mod teller;
mod watch;

pub use door::{Listening, TrackerKey, TrackerOptions};
pub use dtrack::parse_dtrack;
pub use hands::{Hands, HandsState};
pub use line::{parse_line, write_line};
pub use message::{BrushChoice, Message};
pub use osc::{osc_keyed, osc_packet, parse_osc};
pub use senders::Senders;
pub use source::{Came, Counts, Tracker, TrackerAddress, TrackerError};
pub use teller::Teller;
pub use watch::{Heard, Watch};
