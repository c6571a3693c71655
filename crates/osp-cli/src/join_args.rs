//! The arguments of `osp join`, and of every member of a shared session: server and name.

use std::path::PathBuf;

use clap::Args;

use super::{numbers, outputs::ForceArgs, reading::ReadArgs};
use osp_session::recording::{Author, Pace};

/// Take part in a shared session without a window.
///
/// The command writes the session's recording, watches it, or plays another session into it. Several authors draw in one session over a NATS server with JetStream (`nats-server -js`), which stores the session.
/// Every member writes the whole session as a recording, beginning with the first event. The recordings of all members
/// are the same, byte for byte. If the connection is lost, a member continues, and catches up when it is connected
/// again.
///
/// Without --watch or --play, the member is an author that draws nothing. It writes the recording, and reports when
/// others leave.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  nats-server -js -a 127.0.0.1 -sd sessions
  osp join nats://127.0.0.1/house
  osp join nats://127.0.0.1/house watched.ron --watch
  osp join nats://127.0.0.1/house --play recordings/portrait.ron --name Ann
  osp join tls://ann:word@nats.example.org/house

If FILE has the beginning of the session, osp appends the rest. osp replaces other files only with --force.
A connection to this machine is not encrypted (nats://127.0.0.1, nats://localhost). A connection to another machine \
must be encrypted (tls://), unless --unencrypted is given.
A server's own certificate is trusted if the variable SSL_CERT_FILE names its file (PEM).
Credentials: nats://TOKEN@HOST/NAME, nats://USER:PASSWORD@HOST/NAME, or --credentials with a file of one line, TOKEN \
or USER:PASSWORD. The list of processes does not show the contents of this file.
Ctrl-C leaves the session.
Exit code 1: events of this member are not in the session, or the session was full or too crowded to join.")]
pub(super) struct JoinArgs {
    /// The session: nats://HOST[:PORT]/NAME or tls://HOST[:PORT]/NAME.
    // Parsed after clap, whose error message would print the password.
    #[arg(value_name = "ADDRESS")]
    pub(super) address: String,
    /// The recording to write (.ron) [default: NAME.ron].
    pub(super) file: Option<PathBuf>,
    /// Only watch: publish nothing.
    #[arg(long)]
    pub(super) watch: bool,
    /// Name of this member, which the other members see.
    #[arg(long, default_value = "", hide_default_value = true, conflicts_with = "watch", value_parser = name)]
    pub(super) name: String,
    /// Send the events of this session, with this member as their author, then leave.
    #[arg(long, value_name = "SESSION", conflicts_with = "watch")]
    pub(super) play: Option<PathBuf>,
    /// With --play: play only the strokes and edits of this author of the session [default: all authors]. Required if
    /// the session has several authors and undo events.
    #[arg(long, value_name = "NUMBER", requires = "play")]
    pub(super) play_author: Option<u32>,
    /// Part of the session that each frame (90 a second) plays: `recorded` (by the time stamps) or `samples:N` (N
    /// samples of the hand).
    #[arg(long, default_value = "recorded", requires = "play")]
    pub(super) pace: Pace,
    /// Speed, as a multiple of the recorded speed.
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = numbers::factor, requires = "play")]
    pub(super) speed: f64,
    /// Leave after this many seconds.
    #[arg(long = "for", value_name = "SECS", value_parser = numbers::seconds)]
    pub(super) for_secs: Option<f64>,
    /// With --watch: end when everybody who joined has left. With --play: stay after the last event until everybody who
    /// joined has left.
    #[arg(long)]
    pub(super) until_empty: bool,
    #[command(flatten)]
    pub(super) server: ServerArgs,
    #[command(flatten)]
    pub(super) force: ForceArgs,
    /// Print the summary as one JSON object.
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}

/// Address of a server, and access to it.
#[derive(Args, Debug)]
pub(super) struct ServerArgs {
    /// A file of one line with the credentials for the server: a token or USER:PASSWORD.
    #[arg(long, value_name = "FILE")]
    pub(super) credentials: Option<PathBuf>,
    /// Allow an unencrypted connection to another machine. Everybody between the two machines can then read and change
    /// the drawing.
    #[arg(long)]
    pub(super) unencrypted: bool,
}

/// Parses the name of an author.
pub(super) fn name(text: &str) -> Result<String, String> {
    match text.len() <= Author::MAX_NAME_BYTES {
        true => Ok(text.to_owned()),
        false => Err(format!("expected a name of at most {} bytes", Author::MAX_NAME_BYTES)),
    }
}
