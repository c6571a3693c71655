//! `osp wall`: a wall of several machines that show one moment of one shared session.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::{bail, ensure};
use clap::{Args, Subcommand};
use glam::{Quat, Vec3};

use super::{
    Outcome, numbers,
    output::{complain, say},
    rig_args::{RigArgs, room_parser},
    shared_args::{self, ServerArgs},
    wall_text::{counts_text, text},
};
use crate::{
    live::Address,
    platform::host_name,
    replay::RoomMotion,
    view::{Rig, Stereo},
    wall::{Hub, HubOptions, Node, NodeCounts, NodeOptions, Step, ask},
};

/// How long a node without a display waits for something to do, at most.
const NAP: Duration = Duration::from_millis(20);

/// Show a shared session on a wall of several machines, each frame on all screens at once.
///
/// A hub says which moment of the session is shown, and a node on each machine shows it on one screen of the rig. The hub
/// waits until every node that is in has drawn a frame, then has all of them show it. It has the model, too, and names a
/// node that shows something else. A node that misses three frames in a row is out: the hub no longer waits for it, until it
/// has answered 20 frames in time.
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

The session is one that several people may draw in (osp sketch --join, osp join). A recording is put into one
by osp join ADDRESS --play FILE.
The rig is the same on all machines, but for its outputs: each machine has monitors of its own.
The screens show what the head of the session's artist sees (the first author who has recorded one), or with
--tracker what the head in the hub's room sees.
The displays are not locked to each other: that all show their picture at the same refresh is for the
graphics driver (genlock)."
)]
pub(super) struct WallArgs {
    #[command(subcommand)]
    what: Option<What>,
    /// The session: nats://HOST[:PORT]/NAME or tls://HOST[:PORT]/NAME.
    // Parsed later: what is wrong with it is said without the password in it.
    #[arg(value_name = "ADDRESS", required = true)]
    address: Option<String>,
    /// Be the hub: say what is shown, and when.
    #[arg(long, required_unless_present = "node", conflicts_with = "node")]
    hub: bool,
    /// Be a node: show this screen of the rig.
    #[arg(long, value_name = "SCREEN")]
    node: Option<String>,
    #[command(flatten)]
    rig: RigArgs,
    /// What the hub's room does: `follows`: it goes along with the head of the session's artist; `stands`: the room's space is
    /// the world's, and the artist's head walks in it. With --tracker it stands.
    #[arg(long, value_name = "HOW", default_value = "follows", conflicts_with = "node", value_parser = room_parser())]
    room: RoomMotion,
    /// Most frames a second of the hub.
    #[arg(long, default_value_t = 90.0, value_name = "FRAMES", conflicts_with = "node", value_parser = rate)]
    rate: f64,
    /// The longest that a frame waits for a node, milliseconds: a node that takes longer is left out, so that it does not slow
    /// the others down.
    #[arg(long, default_value_t = 1000.0, value_name = "MS", conflicts_with = "node", value_parser = patience)]
    patience: f64,
    #[cfg(feature = "window")]
    #[command(flatten)]
    tracker: super::tracker_args::TrackerArgs,
    /// A node that draws nothing: it culls its screen's views and answers.
    #[arg(long, conflicts_with = "hub")]
    headless: bool,
    /// End after so many seconds.
    #[arg(long = "for", value_name = "SECS", value_parser = numbers::seconds)]
    for_secs: Option<f64>,
    #[command(flatten)]
    way: WayArgs,
}

/// How to reach the server, and what is printed.
#[derive(Args, Debug)]
struct WayArgs {
    #[command(flatten)]
    server: ServerArgs,
    /// Print what there was as one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Subcommand, Debug)]
enum What {
    /// Ask the hub of a wall for its nodes, frames a second, skew and lag; exit code 1 if a screen has no node that is in, or
    /// one that shows something else than the hub has.
    Status {
        /// The session.
        #[arg(value_name = "ADDRESS")]
        address: String,
        #[command(flatten)]
        way: WayArgs,
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

pub(super) fn run(args: &WallArgs) -> anyhow::Result<Outcome> {
    if let Some(What::Status { address, way }) = &args.what {
        return status(address, way);
    }
    #[cfg(feature = "window")]
    ensure!(
        args.hub || args.tracker.tracker.is_none(),
        "--tracker: expected --hub, which tells the nodes where the head is"
    );
    let Some(address) = &args.address else { bail!("expected an ADDRESS") };
    let address = args.way.server.address(address)?;
    let Some((rig, stereo)) = args.rig.open()? else {
        bail!("expected --rig, with the screens of the wall");
    };
    let ending = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    shared_args::end_on_signals(&ending, Duration::from_secs(2));
    match &args.node {
        Some(screen) => args.show(&address, rig, stereo, screen, &ending),
        None => args.lead(&address, rig, stereo, &ending),
    }
}

fn status(address: &str, way: &WayArgs) -> anyhow::Result<Outcome> {
    let report = ask(&way.server.address(address)?, way.server.tls_ca.clone())?;
    say(&if way.json { serde_json::to_string_pretty(&report)? } else { text(&report) })?;
    Ok(if report.is_well() { Outcome::Done } else { Outcome::CheckFailed })
}

impl WallArgs {
    fn is_over(&self, started: Instant, ending: &AtomicBool) -> bool {
        let is_late = |secs| started.elapsed() >= Duration::from_secs_f64(secs);
        ending.load(Ordering::Relaxed) || self.for_secs.is_some_and(is_late)
    }

    fn hub_options(&self, rig: Rig, stereo: Stereo, motion: RoomMotion) -> HubOptions {
        HubOptions {
            certificates: self.way.server.tls_ca.clone(),
            rig,
            stereo,
            motion,
            rate_hz: self.rate,
            most_patience: Duration::from_secs_f64(self.patience * 1.0e-3),
        }
    }

    fn lead(
        &self,
        address: &Address,
        rig: Rig,
        stereo: Stereo,
        ending: &AtomicBool,
    ) -> anyhow::Result<Outcome> {
        let mut head = TrackedHead::open(self, &rig)?;
        let motion = if head.is_some() { RoomMotion::Stands } else { self.room };
        let mut hub = Hub::open(address, &self.hub_options(rig, stereo, motion))?;
        complain(&format!("the hub of {address}; osp wall status shows its nodes"));
        let started = Instant::now();
        let mut trouble = None;
        while !self.is_over(started, ending) {
            for said in hub.frame(|| head.as_mut().map(TrackedHead::now))? {
                complain(&said.to_string());
            }
            let now = hub.trouble();
            if now != trouble {
                complain(now.as_deref().unwrap_or("the session is there"));
                trouble = now;
            }
            if let Some(news) = head.as_mut().and_then(TrackedHead::news) {
                complain(news);
            }
        }
        let report = hub.report();
        say(&if self.way.json { serde_json::to_string_pretty(&report)? } else { text(&report) })?;
        Ok(Outcome::Done)
    }

    fn show(
        &self,
        address: &Address,
        rig: Rig,
        stereo: Stereo,
        screen: &str,
        ending: &AtomicBool,
    ) -> anyhow::Result<Outcome> {
        let certificates = self.way.server.tls_ca.clone();
        let host = host_name();
        let options = NodeOptions { certificates, rig, stereo, screen: screen.to_owned(), host };
        let started = Instant::now();
        let counts = match self.headless {
            true => answer(address, &options, || self.is_over(started, ending))?,
            #[cfg(feature = "window")]
            false => crate::app::show_node(address, &options, || self.is_over(started, ending), complain)?,
            #[cfg(not(feature = "window"))]
            false => {
                bail!("this build opens no windows (it has not the feature `window`): expected --headless")
            }
        };
        say(&if self.way.json { serde_json::to_string_pretty(&counts)? } else { counts_text(&counts) })?;
        Ok(Outcome::Done)
    }
}

/// A node that shows nothing.
fn answer(
    address: &Address,
    options: &NodeOptions,
    is_over: impl Fn() -> bool,
) -> anyhow::Result<NodeCounts> {
    let mut node = Node::open(address, options, || {})?;
    while !is_over() {
        if let Some(news) = node.news() {
            complain(&news);
        }
        match node.step(NAP)? {
            Step::Nothing => {}
            Step::Draw => node.ready(),
            Step::Show => node.shown(),
        }
    }
    Ok(node.counts())
}

/// The head that a tracker in the hub's room sees.
#[derive(Debug)]
struct TrackedHead {
    #[cfg(feature = "window")]
    tracker: crate::app::tracker::Tracker,
    #[cfg(feature = "window")]
    rig: Rig,
    head: (Vec3, Quat),
    heard: Instant,
    /// Whether it was said that nothing is heard.
    is_missed: bool,
}

impl TrackedHead {
    #[cfg(feature = "window")]
    fn open(args: &WallArgs, rig: &Rig) -> anyhow::Result<Option<Self>> {
        use crate::app::tracker::Tracker;
        let Some(address) = &args.tracker.tracker else { return Ok(None) };
        args.tracker.check()?;
        let tracker = Tracker::open(address, &args.tracker.options()?, || {})?;
        let head = (rig.head, Quat::IDENTITY);
        Ok(Some(Self { tracker, rig: rig.clone(), head, heard: Instant::now(), is_missed: false }))
    }

    #[cfg(not(feature = "window"))]
    fn open(_: &WallArgs, _: &Rig) -> anyhow::Result<Option<Self>> {
        Ok(None)
    }

    /// In the room.
    fn now(&mut self) -> (Vec3, Quat) {
        #[cfg(feature = "window")]
        while let Some(message) = self.tracker.take() {
            if let crate::app::tracker::Message::Head { p, q } = message {
                let of_rig = self.rig.room_from_tracker;
                self.head = (of_rig.point(p), of_rig.turn(q));
                self.heard = Instant::now();
            }
        }
        self.head
    }

    /// What is to be said of the tracker, if that is new.
    fn news(&mut self) -> Option<&'static str> {
        let is_missed = self.heard.elapsed() > Duration::from_secs(1);
        let is_new = std::mem::replace(&mut self.is_missed, is_missed) != is_missed;
        is_new.then_some(match is_missed {
            true => "no pose of the head has come from the tracker for a second",
            false => "the tracker has the head",
        })
    }
}
