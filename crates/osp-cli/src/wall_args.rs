//! The arguments of `osp wall`.

use clap::{Args, Subcommand};

use super::{
    numbers,
    rig_args::{RigArgs, room_parser},
    shared_args::ServerArgs,
    tracker_args::TrackerArgs,
};
use osp_session::replay::RoomMotion;

/// Show a shared session on a wall of several computers, with each frame on all screens at the same time.
///
/// The hub decides how many events of the session each frame shows. For each screen of the rig, a computer draws the
/// model after these events. The hub waits until every active computer has drawn a frame, then lets all of them show
/// it. The hub also has the model, and reports each computer that shows other polygons. A computer that misses three
/// frames in a row becomes inactive: the hub no longer waits for it. A computer that then draws 20 frames in time
/// becomes active again.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:
  nats-server -js -a 127.0.0.1 -sd sessions
  osp wall --hub nats://127.0.0.1/house --rig cave4
  osp wall --node front nats://127.0.0.1/house --rig cave4
  osp wall --node left nats://127.0.0.1/house --rig cave4 --headless
  osp wall status nats://127.0.0.1/house

Several people may draw in the session (osp sketch --join, osp join). osp join ADDRESS --play FILE plays a recording \
in it.
The rig is the same on all computers; only the outputs may differ.
The screens show the view of the session's artist: the first author with a recorded head. With --tracker they show \
the view of the head in the hub's room.
osp does not lock the displays to each other: the graphics driver can (genlock)."
)]
pub(super) struct WallArgs {
    #[command(subcommand)]
    pub(super) what: Option<What>,
    /// The session: nats://HOST[:PORT]/NAME or tls://HOST[:PORT]/NAME.
    // Parsed after clap, whose error message would print the password.
    #[arg(value_name = "ADDRESS", required = true)]
    pub(super) address: Option<String>,
    /// Be the hub, which chooses the content and time of each frame.
    #[arg(long, required_unless_present = "node", conflicts_with = "node")]
    pub(super) hub: bool,
    /// Show this screen of the rig, as one computer of the wall.
    #[arg(long, value_name = "SCREEN")]
    pub(super) node: Option<String>,
    #[command(flatten)]
    pub(super) rig: RigArgs,
    /// Motion of the hub's room. `follows`: the room moves with the head of the session's artist. `stands`: the room's
    /// space is the world's, and the artist's head moves in it. With --tracker the room stands.
    #[arg(long, value_name = "HOW", default_value = "follows", conflicts_with = "node", value_parser = room_parser())]
    pub(super) room: RoomMotion,
    /// Largest frame rate of the hub.
    #[arg(long, default_value_t = 90.0, value_name = "FRAMES", conflicts_with = "node", value_parser = rate)]
    pub(super) rate: f64,
    /// Longest time that the hub waits for a computer in a frame, milliseconds. It limits the delay by a slow computer.
    #[arg(long, default_value_t = 1000.0, value_name = "MS", conflicts_with = "node", value_parser = patience)]
    pub(super) patience: f64,
    #[command(flatten)]
    pub(super) tracker: TrackerArgs,
    /// With --node: draw nothing, and only cull the views of the screen.
    #[arg(long, conflicts_with = "hub")]
    pub(super) headless: bool,
    /// End after this many seconds.
    #[arg(long = "for", value_name = "SECS", value_parser = numbers::seconds)]
    pub(super) for_secs: Option<f64>,
    #[command(flatten)]
    pub(super) connection: ConnectionArgs,
}

/// Access to the server, and form of the output.
#[derive(Args, Debug)]
pub(super) struct ConnectionArgs {
    #[command(flatten)]
    pub(super) server: ServerArgs,
    /// Print the summary as one JSON object.
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Subcommand, Debug)]
pub(super) enum What {
    /// Print the computers, frame rate, skew and lag of a wall. The exit code is 1 if a screen has no active computer,
    /// or if a computer shows something else than the hub.
    Status {
        /// The session.
        #[arg(value_name = "ADDRESS")]
        address: String,
        #[command(flatten)]
        connection: ConnectionArgs,
    },
}

fn patience(text: &str) -> Result<f64, String> {
    let ms = text.parse().ok().filter(|ms| (1.0..=10_000.0).contains(ms));
    ms.ok_or_else(|| "expected 1 to 10000 milliseconds".to_owned())
}

fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| (1.0..=1000.0).contains(rate));
    rate.ok_or_else(|| "expected 1 to 1000 frames a second".to_owned())
}
