//! The machine that determines how many events of the session each frame of a wall shows, and when the frame is shown.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use glam::{Quat, Vec3};

use super::{
    HubEvent, WallError, WallReport,
    barrier::{Answer, Barrier},
    follower::Follower,
    message::{self, Frame, FromHub, FromNode, MAX_NAME_BYTES, Numbers},
    wire::{HUB, NODE, Received, STATUS, Wire},
};
use crate::live::{Address, Connection, new_sender};
use osp::{
    math::Aabb,
    polygon::Change,
    view::{Projection, View},
};
use osp_session::{
    replay::{RigPath, RigView, RoomMotion, far_m},
    rig::{Rig, Stereo},
};

/// Number of events of the session after which a frame applies no more messages. Applying these events takes a few
/// milliseconds.
const EVENTS_A_FRAME: u64 = 1 << 12;
/// Largest number of computers' messages that a frame processes after its time is over.
const MESSAGES_AFTER_TIME: u32 = 256;
/// Shortest interval between two new reports of the state, for any number of requests.
const REPORT: Duration = Duration::from_millis(100);
/// Time without a session after which the hub reports that it searches for a session.
const SEARCH: Duration = Duration::from_secs(2);
/// Animated brushes start again after this time, seconds, before a shader's numbers become too coarse.
const MOST_TIME_S: f64 = 1000.0;

/// Position of [`STATUS`] among the subjects that a hub subscribes to.
const ON_STATUS: usize = 1;
/// Position of [`HUB`] among the subjects that a hub subscribes to.
const ON_HUB: usize = 2;

/// Options of a hub.
#[derive(Clone, Debug)]
pub struct HubOptions {
    /// A file of certificates (PEM) that are trusted in addition to the system's certificates.
    pub certificates: Option<PathBuf>,
    /// The rig with the screens.
    pub rig: Rig,
    /// Form of the pictures for the two eyes.
    pub stereo: Stereo,
    /// Motion of the room when the session's head moves. With a tracked head, the room does not move.
    pub motion: RoomMotion,
    /// Largest number of frames a second.
    pub rate_hz: f64,
    /// Longest time that the hub waits for a computer's answer. The hub does not wait for computers that are always
    /// slower.
    pub most_patience: Duration,
}

/// The hub of a wall; see the [module](self).
#[derive(Debug)]
pub struct Hub {
    number: u64,
    session: String,
    rig_number: u64,
    rate_hz: f64,
    wire: Wire,
    follower: Follower,
    barrier: Barrier,
    path: RigPath,
    bounds: Aabb,
    changes: Vec<Change>,
    views: Vec<RigView>,
    started: Instant,
    /// Time at which the next frame begins.
    due: Duration,
    frame: u64,
    garbage: u64,
    /// The last report, and the time at which it was made.
    last_report: Option<(Duration, String)>,
    /// Whether another, older hub shows the session.
    is_second: bool,
}

impl Hub {
    /// Opens a hub: begins to follow a session and to receive messages of computers.
    ///
    /// # Errors
    /// The system provides no thread.
    pub fn open(address: &Address, options: &HubOptions) -> Result<Self, WallError> {
        let HubOptions { certificates, rig, stereo, motion, rate_hz, most_patience } = options.clone();
        let screens = rig.screens.iter().map(|screen| screen.name.clone()).collect();
        let mut path = RigPath::new(rig, stereo, motion).keeping_eyes_in_front();
        let mut views = Vec::new();
        // The first view determines the position of a room that does not move. This view makes room space equal to
        // world space.
        path.views_into(&camera(path.rig().head, Quat::IDENTITY), &mut views);
        Ok(Self {
            number: new_sender().0,
            session: address.session.to_owned(),
            rig_number: message::rig_hash(path.rig(), stereo),
            rate_hz,
            wire: Wire::open(address, certificates.clone(), &[NODE, STATUS, HUB], HUB, || {})?,
            follower: Follower::open(address, certificates, || {})?,
            barrier: Barrier::new(screens, most_patience),
            path,
            bounds: Aabb::EMPTY,
            changes: Vec::new(),
            views,
            started: Instant::now(),
            due: Duration::ZERO,
            frame: 0,
            garbage: 0,
            last_report: None,
            is_second: false,
        })
    }

    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// Waits until the next frame is due, and lets the computers draw and show it. Calls `head` for the tracked head in
    /// the room. If `head` returns `None`, the frame uses the head of the session's artist.
    ///
    /// # Errors
    /// The session or the connection has ended permanently, or another hub shows the session.
    pub fn frame(&mut self, head: impl FnOnce() -> Option<(Vec3, Quat)>) -> Result<Vec<HubEvent>, WallError> {
        self.receive_until(self.due, |_| false)?;
        if self.is_second {
            return Err(WallError::SecondHub { session: self.session.clone() });
        }
        self.due += Duration::from_secs_f64(1.0 / self.rate_hz);
        // A late frame does not shorten the interval to the next frame.
        self.due = self.due.max(self.now());
        self.follower.take()?;
        self.changes.clear();
        self.follower.free_unreachable();
        self.follower.advance(u64::MAX, EVENTS_A_FRAME, &mut self.changes);
        for change in &self.changes {
            if let Change::Insert(id) | Change::Update(id) = change {
                self.bounds = self.bounds.union(&self.follower.state.scene.bounds(*id));
            }
        }
        let recorded = self.follower.state.moment.head;
        let (eye, turn) = head().or(recorded).unwrap_or((self.path.rig().head, Quat::IDENTITY));
        self.path.views_into(&camera(eye, turn), &mut self.views);
        for view in self.views.iter_mut().filter_map(|seen| seen.view.as_mut()) {
            view.projection.far_m = far_m(view.eye_in_world, &self.bounds);
        }

        let views = self.views.iter().map(|seen| seen.view.as_ref().map(Numbers::of)).collect();
        let (hub, number, events) = (self.number, self.frame, self.follower.applied);
        let began = self.now();
        let time_s = (began.as_secs_f64() % MOST_TIME_S) as f32;
        self.wire.publish(message::write(&FromHub::Frame(Frame { hub, number, events, time_s, views })));
        let expected = self.cull();
        self.barrier.begin(number, expected, began);
        self.receive_until(self.barrier.deadline(), Barrier::is_complete)?;
        self.wire.publish(message::write(&FromHub::Swap { hub, frame: number }));
        self.barrier.swap(self.now());
        self.frame += 1;
        Ok(self.barrier.take_events())
    }

    /// The expected answer of each screen's computer.
    fn cull(&mut self) -> Vec<Answer> {
        let views: Vec<View> = self.views.iter().filter_map(|seen| seen.view).collect();
        self.follower.cull(&views);
        let mut first = 0;
        (0..self.path.rig().screens.len())
            .map(|screen| {
                let count =
                    self.views.iter().filter(|seen| seen.screen == screen && seen.view.is_some()).count();
                first += count;
                self.follower.answer(first - count..first)
            })
            .collect()
    }

    fn receive_until(
        &mut self,
        until: Duration,
        is_enough: impl Fn(&Barrier) -> bool,
    ) -> Result<(), WallError> {
        let mut after_time = 0;
        loop {
            if is_enough(&self.barrier) {
                return Ok(());
            }
            let left = until.saturating_sub(self.now());
            after_time += u32::from(left.is_zero());
            match self.wire.receive(left)? {
                Some(received) if after_time <= MESSAGES_AFTER_TIME => self.take(received),
                Some(_) => return Ok(()),
                None if left.is_zero() => return Ok(()),
                None => {}
            }
        }
    }

    fn take(&mut self, received: Received) {
        let now = self.now();
        if received.on == ON_HUB {
            if let Ok(FromHub::Frame(Frame { hub, number, .. })) = message::read(&received.bytes) {
                // The hub's own messages come back, too. If there are two hubs, the older hub stays.
                self.is_second |= hub != self.number && (number, hub) > (self.frame, self.number);
            }
            return;
        }
        if received.on == ON_STATUS {
            // The hub answers only to an inbox, because another address would let a client write with the hub's rights.
            match received.reply.filter(|reply| reply.starts_with("_INBOX.")) {
                Some(reply) => self.reply(reply, now),
                None => self.garbage += 1,
            }
            return;
        }
        match message::read(&received.bytes) {
            Ok(FromNode::Here { node, screen, host, rig, events })
                if screen.len() <= MAX_NAME_BYTES && host.len() <= MAX_NAME_BYTES =>
            {
                self.here(node, &screen, &host, rig, events, now);
            }
            Ok(FromNode::Ready { node, hub, frame, log, seen }) if hub == self.number => {
                self.barrier.ready(node, frame, Answer { log, seen }, now);
            }
            Ok(FromNode::Shown { node, hub, frame }) if hub == self.number => {
                self.barrier.shown(node, frame, now);
            }
            Ok(FromNode::Leaving { node }) => self.barrier.leaves(node),
            // These messages belong to an earlier hub.
            Ok(FromNode::Ready { .. } | FromNode::Shown { .. }) => {}
            Ok(FromNode::Here { .. }) | Err(_) => self.garbage += 1,
        }
    }

    fn reply(&mut self, reply: String, now: Duration) {
        let is_fresh = |(last_report, _): &(Duration, String)| now.saturating_sub(*last_report) < REPORT;
        if !self.last_report.as_ref().is_some_and(is_fresh) {
            self.last_report = Some((now, message::write(&self.report())));
        }
        if let Some((_, text)) = &self.last_report {
            self.wire.answer(reply, text.clone());
        }
    }

    fn here(&mut self, node: u64, screen: &str, host: &str, rig: u64, events: u64, now: Duration) {
        let is_same = rig == self.rig_number;
        let outcome = match is_same {
            true => self.barrier.here(node, screen, host, events, now),
            false => Err("its rig has other screens or eyes than the hub's".to_owned()),
        };
        if let Err(why) = outcome {
            self.wire.publish(message::write(&FromHub::Refused {
                hub: self.number,
                node,
                why,
                is_for_good: !is_same,
            }));
        }
    }

    /// The last error of the connection to the session, if any.
    pub fn trouble(&self) -> Option<String> {
        let status = self.follower.link.status();
        match (&status.connection, status.trouble) {
            (_, Some(trouble)) => Some(trouble),
            (Connection::Silent, None) => Some("the server does not answer".to_owned()),
            (Connection::Connecting, None) if self.now() > SEARCH => {
                Some("the session is not found yet".to_owned())
            }
            _ => None,
        }
    }

    /// The state of the wall.
    pub fn report(&self) -> WallReport {
        let trouble = self.trouble();
        let [frame, period, skew] = self.barrier.times();
        WallReport {
            session: self.session.clone(),
            rig: self.path.rig().name.clone(),
            trouble,
            rate_hz: self.rate_hz,
            frames_a_second: self.barrier.frames_a_second(self.now()),
            frames: self.barrier.frames,
            events: self.follower.applied,
            polygons: self.follower.pipeline.polygon_count() as u64,
            garbage: self.garbage,
            frame,
            period,
            skew,
            nodes: self.barrier.nodes(self.follower.applied),
        }
    }
}

/// A view from the head, from which the views of the rig's screens and eyes are computed.
fn camera(eye: Vec3, turn: Quat) -> View {
    let projection = Projection::symmetric(60.0, 1.0, 0.01, far_m(eye, &Aabb::EMPTY));
    View { eye_in_world: eye, world_from_view: turn, projection }
}
