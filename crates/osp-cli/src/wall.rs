//! `osp wall`: a wall of several computers that show the same state of a shared session.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::bail;
use glam::{Quat, Vec3};

use super::{
    outcome::Outcome,
    output::{print_result, warn},
    shared,
    wall_args::{ConnectionArgs, WallArgs, What},
    wall_text::{counts_text, text},
};
use osp_net::{
    live::Address,
    wall::{Hub, HubOptions, Node, NodeCounts, NodeOptions, Step, ask},
};
use osp_session::{
    platform::host_name,
    replay::RoomMotion,
    rig::{Rig, Stereo},
};

/// Longest time that a computer without a display waits for a message.
const NAP: Duration = Duration::from_millis(20);

pub(super) fn run(args: &WallArgs) -> anyhow::Result<Outcome> {
    if let Some(What::Status { address, connection }) = &args.what {
        return status(address, connection);
    }
    #[cfg(feature = "window")]
    anyhow::ensure!(
        args.hub || args.tracker.tracker.is_none(),
        "--tracker: expected --hub, which sends the head's position to the computers of the wall"
    );
    let Some(address) = &args.address else { bail!("expected an ADDRESS") };
    let address = args.connection.server.address(address)?;
    let Some((rig, stereo)) = args.rig.open()? else {
        bail!("expected --rig, with the screens of the wall");
    };
    let ending = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    shared::end_on_signals(&ending, Duration::from_secs(2));
    match &args.node {
        Some(screen) => args.show(&address, rig, stereo, screen, &ending),
        None => args.lead(&address, rig, stereo, &ending),
    }
}

fn status(address: &str, connection: &ConnectionArgs) -> anyhow::Result<Outcome> {
    let report = ask(&connection.server.address(address)?, connection.server.tls_ca.clone())?;
    print_result(&if connection.json { serde_json::to_string_pretty(&report)? } else { text(&report) })?;
    Ok(if report.is_well() { Outcome::Done } else { Outcome::CheckFailed })
}

impl WallArgs {
    fn is_over(&self, started: Instant, ending: &AtomicBool) -> bool {
        let is_late = |secs| started.elapsed() >= Duration::from_secs_f64(secs);
        ending.load(Ordering::Relaxed) || self.for_secs.is_some_and(is_late)
    }

    fn hub_options(&self, rig: Rig, stereo: Stereo, motion: RoomMotion) -> HubOptions {
        HubOptions {
            certificates: self.connection.server.tls_ca.clone(),
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
        warn(&format!("the hub of {address}; osp wall status lists the computers of the wall"));
        let started = Instant::now();
        let mut trouble = None;
        while !self.is_over(started, ending) {
            for said in hub.frame(|| head.as_mut().map(TrackedHead::now))? {
                warn(&said.to_string());
            }
            let now = hub.trouble();
            if now != trouble {
                warn(now.as_deref().unwrap_or("the session is available"));
                trouble = now;
            }
            if let Some(news) = head.as_mut().and_then(TrackedHead::news) {
                warn(news);
            }
        }
        let report = hub.report();
        print_result(&if self.connection.json {
            serde_json::to_string_pretty(&report)?
        } else {
            text(&report)
        })?;
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
        let certificates = self.connection.server.tls_ca.clone();
        let host = host_name();
        let options = NodeOptions { certificates, rig, stereo, screen: screen.to_owned(), host };
        let started = Instant::now();
        let counts = match self.headless {
            true => run_headless(address, &options, || self.is_over(started, ending))?,
            #[cfg(feature = "window")]
            false => osp_app::show_node(address, &options, || self.is_over(started, ending), warn)?,
            #[cfg(not(feature = "window"))]
            false => {
                let needed = [super::built::Feature::Window];
                super::built::refuse("osp wall --node without --headless", &needed)?
            }
        };
        print_result(&if self.connection.json {
            serde_json::to_string_pretty(&counts)?
        } else {
            counts_text(&counts)
        })?;
        Ok(Outcome::Done)
    }
}

/// Runs a computer of the wall without a display.
fn run_headless(
    address: &Address,
    options: &NodeOptions,
    is_over: impl Fn() -> bool,
) -> anyhow::Result<NodeCounts> {
    let mut node = Node::open(address, options, || {})?;
    while !is_over() {
        if let Some(news) = node.news() {
            warn(&news);
        }
        match node.step(NAP)? {
            Step::Nothing => {}
            Step::Draw => node.ready(),
            Step::Show => node.shown(),
        }
    }
    Ok(node.counts())
}

/// The head's pose in the hub's room, from a tracker.
#[derive(Debug)]
struct TrackedHead {
    #[cfg(feature = "window")]
    tracker: osp_app::tracker::Tracker,
    #[cfg(feature = "window")]
    rig: Rig,
    head: (Vec3, Quat),
    last_pose: Instant,
    /// Whether the lack of messages has been reported.
    is_missed: bool,
}

impl TrackedHead {
    #[cfg(feature = "window")]
    fn open(args: &WallArgs, rig: &Rig) -> anyhow::Result<Option<Self>> {
        use osp_app::tracker::Tracker;
        let Some(address) = &args.tracker.tracker else { return Ok(None) };
        args.tracker.check()?;
        let tracker = Tracker::open(address, &args.tracker.options()?, || {})?;
        let head = (rig.head, Quat::IDENTITY);
        Ok(Some(Self { tracker, rig: rig.clone(), head, last_pose: Instant::now(), is_missed: false }))
    }

    #[cfg(not(feature = "window"))]
    fn open(_: &WallArgs, _: &Rig) -> anyhow::Result<Option<Self>> {
        Ok(None)
    }

    /// Returns the current pose of the head in the room.
    fn now(&mut self) -> (Vec3, Quat) {
        #[cfg(feature = "window")]
        while let Some(message) = self.tracker.take() {
            if let osp_app::tracker::Message::Head { p, q } = message {
                let of_rig = self.rig.room_from_tracker;
                self.head = (of_rig.point(p), of_rig.turn(q));
                self.last_pose = Instant::now();
            }
        }
        self.head
    }

    /// Returns a message when the tracker's poses stop or start again.
    fn news(&mut self) -> Option<&'static str> {
        let is_missed = self.last_pose.elapsed() > Duration::from_secs(1);
        let is_new = std::mem::replace(&mut self.is_missed, is_missed) != is_missed;
        is_new.then_some(match is_missed {
            true => "the tracker has sent no pose of the head for a second",
            false => "the tracker sends poses of the head",
        })
    }
}
